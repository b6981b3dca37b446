"""Agreement of ribbon and shell as a claim that can fail: pins, their verdicts, and one line for a test-suite.

A pin bounds what separates the two models of a scene. It is decided by three numbers (design rule 7): with the distance
d between the models and the discretisation errors e of both, the claim "not farther than X" is

- agreed where d + e <= X: it holds, errors included;
- disproved where d - e > X: the errors cannot explain it;
- undecided in between: a finer mesh, or more segments, must say. Undecided is no agreement.

In a test-suite::

    from compare.check import assert_agreement

    def test_ribbon_is_enough():
        assert_agreement("my_scene.toml", distance=0.03, width_to_thickness=100)

Shell runs are kept (`cache_folder`) and found again until scene, mesh, versions or the shell's sources change.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from compare.page.pair import Row
from compare.page.remedies import message
from compare.scene.scene import Scene, load
from compare.store.progress import Reporter
from compare.store.shared import cache_root
from compare.store.store import CaseStore, check_writable
from compare.studies.agreement.pins import Pin, read_pins
from compare.studies.compare import Comparison, compare

__all__ = [
    "Claim", "Outcome", "Pin", "Verdict", "assert_agreement", "assert_pin", "cache_folder", "check", "read_pins",
]  # fmt: skip

CACHE = "RIBBONBENCH_CHECK"
"""Environment variable: the folder where the shell runs of checks are kept."""


class Verdict(Enum):
    """Of a claim, the worst one of a pin; the value is the word for files."""

    AGREED = "agreed"
    UNDECIDED = "undecided"
    DISPROVED = "disproved"
    UNSOLVED = "unsolved"


_WORST = (Verdict.AGREED, Verdict.UNDECIDED, Verdict.DISPROVED, Verdict.UNSOLVED)


@dataclass(frozen=True)
class Claim:
    """One bound at one w/h (None: the slope over all): what was measured, its error, and the verdict with its reason.

    bound: the largest value allowed; (lowest, highest) of a slope. provable: the bound that this discretisation proves;
    value, error None: not known.
    """

    what: str
    width_to_thickness: float | None
    bound: float | tuple[float, float]
    value: float | None
    error: float | None
    verdict: Verdict
    says: str
    provable: float | None = None
    ribbon_error: float | None = None
    shell_error: float | None = None


@dataclass(frozen=True)
class Outcome:
    """A checked pin: the verdict of its claims, and the comparison behind them."""

    pin: Pin
    claims: tuple[Claim, ...]
    comparison: Comparison

    @property
    def verdict(self) -> Verdict:
        """The worst one of the claims."""
        return max((claim.verdict for claim in self.claims), key=_WORST.index)

    @property
    def agreed(self) -> bool:
        """Every claim is proved."""
        return self.verdict is Verdict.AGREED

    def message(self) -> str:
        """One line for each claim."""
        return "\n".join(f"{self.pin.label}: {claim.says}" for claim in self.claims)


def cache_folder(given: str | os.PathLike[str] | None = None) -> Path:
    """Where shell runs are kept (in `cases` there): `given`, else ``RIBBONBENCH_CHECK``, else with those of all
    commands."""
    if given is not None:
        return check_writable(given, "cache")
    own = os.environ.get(CACHE)
    if own:
        return check_writable(own, CACHE)
    return check_writable(cache_root(), CACHE)


def check(pin: Pin, store: CaseStore, reporter: Reporter | None = None) -> Outcome:
    """Runs what the pin's scene needs and judges its claims.

    Raises `BadInput` for a scene that cannot be, or has no shell, and `Missing` where there is no dolfinx.
    """
    scene = pin.scene
    found = compare(scene, store, reporter or Reporter(quiet=True), leave_saddle=pin.leave_saddle, bare=True)
    claims: list[Claim] = []
    for row in found.rows:
        if pin.distance is not None:
            claims.append(_distance(pin.distance, row, found))
        if pin.share is not None:
            claims.append(_share(pin.share, row, found))
    if pin.slope is not None:
        claims.append(_slope(pin.slope, found))
    return Outcome(pin, tuple(claims), found)


def assert_agreement(
    scene: str | os.PathLike[str] | Scene,
    *,
    distance: float | None = None,
    share: float | None = None,
    slope: Sequence[float] | None = None,
    width_to_thickness: float | Sequence[float] | None = None,
    keys: Mapping[str, Any] | None = None,
    leave_saddle: bool | None = None,
    cache: str | os.PathLike[str] | None = None,
) -> None:
    """Fails, with the three numbers, unless ribbon and shell of the scene agree; both must be stable equilibria.

    Parameters
    ----------
    scene: name of a shipped scene, path of a TOML file, or a `compare.scene.Scene`.
    distance: largest Hausdorff distance between the surfaces, over l. share: largest membrane share of the shell's
        elastic energy. slope: lowest and highest slope of log(distance) against log(h/w), for two w/h or more.
    width_to_thickness: of the shells; None: the scene's own. keys: other keys replaced, e.g.
        ``{"shell.elements": [40, 4]}``. leave_saddle: as in `compare.models.base.Options`.
    cache: folder of finished shell runs; None: see `cache_folder`.

    Raises `AssertionError` where the claim is disproved, undecided or unsolved, `BadInput` for what cannot be asked.
    """
    __tracebackhide__ = True
    found = scene if isinstance(scene, Scene) else load(Path(scene) if isinstance(scene, os.PathLike) else scene)
    ratios = [width_to_thickness] if isinstance(width_to_thickness, (int, float)) else width_to_thickness
    assert_pin(Pin.of(found, distance, share, slope, ratios, keys, leave_saddle), cache)


def assert_pin(pin: Pin, cache: str | os.PathLike[str] | None = None) -> None:
    """Fails unless the pin holds: for `read_pins` in a parametrised test."""
    __tracebackhide__ = True
    found = check(pin, CaseStore(cache_folder(cache) / "cases"))
    if not found.agreed:
        raise AssertionError(found.message())


# -- verdicts ---------------------------------------------------------------------------------------------------------


def _unsolved(what: str, bound: Any, row: Row | None, found: Comparison) -> Claim | None:
    """The claim where one of the models is no stable equilibrium, or the two are in different states; or None."""
    fast = found.fast
    ratio = None if row is None else row.width_to_thickness
    rows = found.rows if row is None else (row,)
    if not fast.ok:
        return Claim(what, ratio, bound, None, None, Verdict.UNSOLVED, f"{what}: the {fast.model} is {message(fast)}")
    for r in rows:
        if r.status != "converged":
            says = f"{what} at w/h = {r.width_to_thickness:g}: the shell is {r.status}: {r.message}"
            return Claim(what, ratio, bound, None, None, Verdict.UNSOLVED, says)
        if r.same_state is not True:
            state = "not known to rest in the same state" if r.same_state is None else "in another state"
            at = f"{what} at w/h = {r.width_to_thickness:g} is undecided: the shell is {state} ({r.same_why})"
            return Claim(what, ratio, bound, None, None, Verdict.UNDECIDED, at)
    return None


def _distance(bound: float, row: Row, found: Comparison) -> Claim:
    what = "distance"
    ratio = row.width_to_thickness
    failed = _unsolved(what, bound, row, found)
    if failed is not None:
        return failed
    d, ribbon, shell = row.hausdorff, row.ribbon_error, row.shell_error
    if d is None or ribbon is None or shell is None:
        lacking = "ribbon's" if ribbon is None else "shell's"
        says = f"distance at w/h = {ratio:g} is undecided: the {lacking} discretisation error is unknown; refine it"
        return Claim(what, ratio, bound, d, None, Verdict.UNDECIDED, says, None, ribbon, shell)
    error = ribbon + shell
    verdict = judged(d, error, bound)
    numbers = f"distance {d:.2e} l, ribbon error {ribbon:.1e}, shell error {shell:.1e}"
    says = f"{numbers} at w/h = {ratio:g}: {_relation(verdict, bound)}"
    if verdict is Verdict.UNDECIDED:
        says += f"; {_refine(found, row, ribbon > shell)}"
    if verdict is not Verdict.AGREED:
        says += f"; these meshes prove a bound of {up(d + error):g}"
    return Claim(what, ratio, bound, d, error, verdict, says, d + error, ribbon, shell)


def _share(bound: float, row: Row, found: Comparison) -> Claim:
    what = "membrane share"
    ratio = row.width_to_thickness
    failed = _unsolved(what, bound, row, found)
    if failed is not None:
        return failed
    value = None if row.share is None else row.share["membrane"]
    error = row.share_error
    if value is None or error is None:
        says = f"{what} at w/h = {ratio:g} is undecided: its discretisation error is unknown (no coarser mesh)"
        return Claim(what, ratio, bound, value, None, Verdict.UNDECIDED, says)
    verdict = judged(value, error, bound)
    says = f"{what} {value:.2%}, its error {error:.2%} at w/h = {ratio:g}: {_relation(verdict, bound)}"
    if verdict is Verdict.UNDECIDED:
        says += f"; {_refine(found, row, False)}"
    if verdict is not Verdict.AGREED:
        says += f"; this mesh proves a bound of {up(value + error):g}"
    return Claim(what, ratio, bound, value, error, verdict, says, value + error)


def _slope(bound: tuple[float, float], found: Comparison) -> Claim:
    """The least-squares slope with the largest change that the rows' errors can make, to first order."""
    what = "slope"
    failed = _unsolved(what, bound, None, found)
    if failed is not None:
        return failed
    rows = [(r.width_to_thickness, r.hausdorff, r.ribbon_error, r.shell_error) for r in found.rows]
    if any(None in row for row in rows) or any(row[1] == 0.0 for row in rows):
        says = "slope is undecided: a distance or an error is unknown; refine the meshes"
        return Claim(what, None, bound, None, None, Verdict.UNDECIDED, says)
    ratio, d, ribbon, shell = np.array(rows, dtype=float).T
    x = -np.log(ratio)
    weights = (x - x.mean()) / np.sum((x - x.mean()) ** 2)
    value = float(weights @ np.log(d))
    error = float(np.abs(weights) @ ((ribbon + shell) / d))
    low, high = bound
    if low <= value - error and value + error <= high:
        verdict = Verdict.AGREED
    else:
        verdict = Verdict.DISPROVED if value + error < low or value - error > high else Verdict.UNDECIDED
    words = {Verdict.AGREED: "within", Verdict.DISPROVED: "outside", Verdict.UNDECIDED: "not decidedly within"}
    says = f"slope {value:.2f}, its error {error:.2f} over {len(rows)} w/h: {words[verdict]} {low:g} to {high:g}"
    return Claim(what, None, bound, value, error, verdict, says)


def judged(value: float, error: float, bound: float) -> Verdict:
    """Whether a value known to within `error` is below the bound, above it, or neither for sure."""
    if value + error <= bound:
        return Verdict.AGREED
    return Verdict.DISPROVED if value - error > bound else Verdict.UNDECIDED


def _relation(verdict: Verdict, bound: float) -> str:
    if verdict is Verdict.AGREED:
        return f"agreed to {bound:g}"
    if verdict is Verdict.DISPROVED:
        return f"NOT within {bound:g} (disproved: beyond it by more than the errors)"
    return f"undecided against {bound:g} (the errors reach across it)"


def _refine(found: Comparison, row: Row, ribbon: bool) -> str:
    """What to refine where the ribbon's error, or else the shell's, is the larger one."""
    scene = found.scene
    if not ribbon:
        if scene.shell.tolerance is not None:
            return f"lower shell.tolerance = {scene.shell.tolerance:g}"
        along, across = row.elements
        return f"refine the shell, e.g. shell.elements = [{2 * along}, {2 * across}]"
    if scene.model.tolerance is not None:
        return f"lower model.tolerance = {scene.model.tolerance:g}"
    return f"refine the ribbon, e.g. model.elements = {2 * len(scene.model.lengths)}"


def up(value: float, digits: int = 2) -> float:
    """The value rounded upwards to `digits` significant digits."""
    if value <= 0.0:
        return 0.0
    unit = 10.0 ** (math.floor(math.log10(value)) - digits + 1)
    return float(f"{math.ceil(value / unit) * unit:.{digits}g}")
