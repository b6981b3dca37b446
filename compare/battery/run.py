"""Runs cases rung by rung; what is done is kept, so that an interrupted run goes on where it was."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from compare.battery.case import Case, Check, Rung
from compare.store import provenance
from compare.store.store import case_key
from ribbonbench.errors import Missing

PASSED, FAILED, KNOWN, MENDED, SKIPPED = "passed", "failed", "known failure", "no longer fails", "skipped"


@dataclass(frozen=True)
class Tried:
    """A rung that was tried: its checks, how it ended, the time on the processor of this process (s), why it was
    skipped or which exception it ended with."""

    rung: Rung
    checks: tuple[Check, ...]
    ended: str
    seconds: float
    why: str = ""

    @property
    def worst(self) -> Check | None:
        """The check that uses most of its bound, failed ones first."""
        return max(self.checks, key=lambda check: (not check.ok, check.strain), default=None)


@dataclass(frozen=True)
class Outcome:
    """A case with the rungs that were tried."""

    case: Case
    tried: tuple[Tried, ...]

    @property
    def ended(self) -> str:
        """The worst of its rungs."""
        order = (FAILED, KNOWN, MENDED, SKIPPED, PASSED)
        return min((t.ended for t in self.tried), key=order.index, default=SKIPPED)

    @property
    def reaches(self) -> Rung | None:
        """The last rung before the first that failed; None where the first did."""
        last: Rung | None = None
        for tried in self.tried:
            if tried.ended in (FAILED, KNOWN):
                break
            if tried.ended != SKIPPED:
                last = tried.rung
        return last

    @property
    def worst(self) -> Check | None:
        """The check that uses most of its bound; those of known failures only where there are no others."""
        found = [t for t in self.tried if t.ended != KNOWN] or list(self.tried)
        checks = [t.worst for t in found if t.worst is not None]
        return max(checks, key=lambda check: (not check.ok, check.strain), default=None)

    @property
    def seconds(self) -> float:
        """Time on the processor, s."""
        return sum(tried.seconds for tried in self.tried)

    @property
    def why(self) -> str:
        """What has to be said: of failures, known or not, and of what was skipped."""
        said = []
        for tried in self.tried:
            if tried.why:
                said.append(f"{tried.rung}: {tried.why}")
            elif tried.ended == FAILED:
                said += [f"{tried.rung}: {c.what} {c.value:.3g} > {c.bound:.3g} ({c.said})" for c in failed(tried)]
        return "; ".join(said)


def failed(tried: Tried, timed: bool = True) -> list[Check]:
    """The checks of a rung that did not keep their bounds; timed: with those of seconds."""
    return [check for check in tried.checks if not check.ok and (timed or not check.timed)]


def attempt(case: Case, rung: Rung, timed: bool = True) -> Tried:
    """One rung of a case. timed False: seconds are not judged."""
    began = time.process_time()
    known = case.known.get(rung, "")
    try:
        checks = tuple(case.run(rung))
    except Missing as error:
        return Tried(rung, (), SKIPPED, time.process_time() - began, str(error))
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        text = f"{type(error).__name__}: {error} ({where.name}, line {where.lineno} of {where.filename})"
        return Tried(rung, (), KNOWN if known else FAILED, time.process_time() - began, known or text)
    spent = time.process_time() - began
    bad = any(not check.ok and (timed or not check.timed) for check in checks)
    if known:
        return Tried(rung, checks, KNOWN if bad else MENDED, spent, known)
    return Tried(rung, checks, FAILED if bad or not checks else PASSED, spent, "" if checks else "it checked nothing")


CachedRun = Mapping[str, Mapping[str, Any]]


def run(
    cases: Sequence[Case],
    long: bool = False,
    software: str = "",
    kept: CachedRun | None = None,
    keep: Callable[[str, Mapping[str, Any]], None] | None = None,
    say: Callable[[str], None] | None = None,
) -> Iterator[Outcome]:
    """The cases in turn, without those that have no rung for this run.

    kept: rungs of an earlier run, by `software` and `label`; keep: called with every new one that is decided (what was
    skipped is tried again); say: told what is being done.
    """
    for case in cases:
        tried = []
        for rung in case.ladder(long):
            key = f"{software} {label(case, rung)}"
            if kept is not None and key in kept:
                tried.append(from_data(rung, kept[key]))
                continue
            if say is not None:
                say(label(case, rung))
            tried.append(attempt(case, rung))
            if keep is not None and tried[-1].ended != SKIPPED:
                keep(key, to_data(tried[-1]))
        if tried:
            yield Outcome(case, tuple(tried))


def software() -> str:
    """Digest of all sources and libraries that a rung depends on."""
    return case_key(provenance.software())


def label(case: Case, rung: Rung) -> str:
    """Name of a rung, e.g. "contact/roof [H / l = 0.0005]"."""
    return f"{case.name} [{case.parameter} = {rung}]"


def to_data(tried: Tried) -> dict[str, Any]:
    """A rung that was tried, for JSON."""
    return asdict(tried)


def from_data(rung: Rung, data: Mapping[str, Any]) -> Tried:
    """A rung that was tried, from JSON."""
    checks = tuple(Check(**check) for check in data["checks"])
    return Tried(rung, checks, data["ended"], data["seconds"], data["why"])


def counted(outcomes: Iterable[Outcome]) -> dict[str, int]:
    """How many rungs ended how."""
    counts = dict.fromkeys((PASSED, FAILED, KNOWN, MENDED, SKIPPED), 0)
    for outcome in outcomes:
        for tried in outcome.tried:
            counts[tried.ended] += 1
    return counts
