"""Other people's programs as runners: each in the interpreter that has it, by a script of its own.

The programs are no dependency: a runner is skipped, with the reason, where neither this interpreter nor the one that
the environment variable RIBBONBENCH_PEERS names (paths of pythons, as in PATH) has its library.
"""
