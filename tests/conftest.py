"""For all tests: an example of hypothesis may take as long as a busy machine needs; ctrl-C reaches child processes;
finished shells are kept beside the results, and never in the user's own store; tests that are about something else
than the store share one, so that a shell is solved once in a run."""

import os
import signal
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from tests import slow

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


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What takes long is left to `make validate` (tests/slow.py)."""
    long = slow.listed()
    for item in items:
        if item.nodeid in long:
            item.add_marker("validate")


@pytest.fixture(scope="session")
def kept(tmp_path_factory) -> Path:
    """The folder of this run's finished shells, one for all its processes: the store is safe for several writers."""
    own = tmp_path_factory.getbasetemp()
    place = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "kept"
    (place / "cases").mkdir(parents=True, exist_ok=True)
    return place


@pytest.fixture
def kept_shells(kept, monkeypatch) -> Path:
    """Commands of this test keep their shells in the run's folder and find them there."""
    monkeypatch.setenv("RIBBONBENCH_STORE", str(kept / "cases"))
    monkeypatch.setenv("RIBBONBENCH_CHECK", str(kept))
    return kept / "cases"
