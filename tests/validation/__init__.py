"""Measurements that are stated in the README: `python -m tests.validation [NAME ...]` remakes them under results/.

Each module has a function ``run(out: Path)`` that writes small tables (and pictures) and raises when a number that is
promised is not reached. Times are ratios within one run; single absolute times on a shared machine prove little.
"""
