"""For all tests: an example of hypothesis may take as long as a busy machine needs; ctrl-C reaches child processes;
finished shells are kept beside the results, and never in the user's own store."""

import os
import signal

from hypothesis import HealthCheck, settings

settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")

# Started in the background of a shell, pytest ignores ctrl-C, and so would the processes that tests interrupt.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

os.environ["RIBBONBENCH_STORE"] = "cases"

# `python -m tests.portable mumps-amf`: Ipopt reads no environment variable, its options are set here.
if order := os.environ.get("RIBBONBENCH_TESTS_IPOPT_ORDER"):
    from ribbon.solvers.ipopt import DEFAULT_OPTIONS

    DEFAULT_OPTIONS["mumps_pivot_order"] = int(order)
