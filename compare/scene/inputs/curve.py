"""A drawn curve to begin in (`seed.curve`): read from a file beside the scene's, and whether it can be one.

It is looked at before anything is computed: as long as the strip, between its clamps, along them, and nowhere nearer to
itself than the strip's parts are kept. Distances here are in the scene's own unit of length.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compare.scene.data import SceneData
from compare.scene.inputs.source import MAX_BYTES
from ribbonbench.errors import BadInput

KEY = "seed.curve"
#: Points of a curve, at the least and at the most; how far its length, its ends (over the strip's length) and its
#: directions there (degrees) may be off: what is nearer is made right.
FEWEST, MOST = 4, 2000
LONGER, ASIDE, TURNED = 0.05, 0.02, 40.0
#: Points at which nearness is looked for, and over the distance how far along the curve.
_LOOKS, _ALONG = 600, 4.0


def with_points(document: Mapping[str, Any], source: str) -> Mapping[str, Any]:
    """The document with the points of its curve in place of the name of a file, which stands beside `source`."""
    seed = document.get("seed")
    if not isinstance(seed, Mapping) or not isinstance(seed.get("curve"), str):
        return document
    return {**document, "seed": {**seed, "curve": _read(seed["curve"], Path(source).parent)}}


def _read(name: str, folder: Path) -> list[list[float]]:
    """The points of a file: rows of three numbers, under a row of names or not."""
    remedy = "give a CSV file beside the scene's: a row x, y, z for each point, in the unit of strip.length"
    try:
        raw = (folder / name).read_bytes()[: MAX_BYTES + 1]
        text = raw.decode("utf-8-sig")
    except (OSError, ValueError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or "no text"
        raise BadInput(KEY, name, f"cannot be read ({reason})", remedy) from None
    if len(raw) > MAX_BYTES:
        raise BadInput(KEY, name, f"is larger than {MAX_BYTES} bytes", remedy)
    rows = [row for row in csv.reader(io.StringIO(text)) if any(map(str.strip, row)) and not row[0].startswith("#")]
    if rows and [part.strip().lower() for part in rows[0]] == ["x", "y", "z"]:
        rows = rows[1:]
    points = []
    for number, row in enumerate(rows, 1):
        try:
            x, y, z = map(float, row)
        except ValueError:
            raise BadInput(KEY, name, f"has a point {number} that is not three numbers", remedy) from None
        points.append([x, y, z])
    return points


def fault(scene: SceneData) -> BadInput | None:
    """What is wrong with the curve of a scene, whose clamps are those where it begins; None: nothing, or no curve."""
    if scene.seed.curve is None:
        return None
    given, length = np.array(scene.seed.curve), scene.strip.length
    if not FEWEST <= len(given) <= MOST:
        return _bad(f"has {len(given)} points", f"give {FEWEST} to {MOST}")
    edges = np.linalg.norm(np.diff(given, axis=0), axis=1)
    if not edges.min() > 1e-9 * length:
        return _bad(f"has point {int(np.argmin(edges)) + 2} where the one before is", "leave one out")
    for end, clamp, at, step in (
        ("start", scene.clamp_start, given[0], given[1] - given[0]),
        ("end", scene.clamp_end, given[-1], given[-1] - given[-2]),
    ):
        if clamp is None or not clamp.holds_all:
            return _bad(f"needs clamp.{end} to hold position and frame", "hold them, or draw no curve")
        off = float(np.linalg.norm(at - np.array(clamp.position)))
        if off > ASIDE * length:
            return _bad(f"has its {end} {off:.3g} away from clamp.{end}.position", "move one to the other")
        angle = float(np.degrees(np.arccos(np.clip(step @ np.array(clamp.tangent) / np.linalg.norm(step), -1.0, 1.0))))
        if angle > TURNED:
            return _bad(f"has its {end} {angle:.0f} degrees off clamp.{end}.tangent", f"keep within {TURNED:g} degrees")
    long = _length(given)
    if abs(long / length - 1.0) > LONGER:
        return _bad(
            f"is {long:.4g} long, strip.length is {length:.4g}",
            f"draw it to {100 * LONGER:g} %, or scale it between its ends",
        )
    if scene.apart is None:
        return None
    first, last = scene.clamp_start, scene.clamp_end
    ring = first is not None and last is not None and first.position == last.position
    return _near(given, scene.apart * length, ring)


def _bad(problem: str, remedy: str) -> BadInput:
    return BadInput(KEY, None, problem, remedy)


def _smooth(points: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """`count` points on the smooth curve through all."""
    from scipy.interpolate import CubicSpline

    d = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return np.asarray(CubicSpline(d, points)(np.linspace(0.0, d[-1], count)))


def _length(points: NDArray[np.float64]) -> float:
    return float(np.linalg.norm(np.diff(_smooth(points, 8 * _LOOKS), axis=0), axis=1).sum())


def _near(points: NDArray[np.float64], distance: float, ring: bool) -> BadInput | None:
    """A curve nearer to itself than `distance` somewhere, more than `_ALONG` times that from there along it, of a ring
    across its seam too: bends that are tighter are made wider."""
    fine = _smooth(points, _LOOKS)
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))])
    gap = np.linalg.norm(fine[:, None] - fine[None], axis=2)
    along = np.abs(s[:, None] - s[None])
    gap[(np.minimum(along, s[-1] - along) if ring else along) < _ALONG * distance] = np.inf
    i, j = np.unravel_index(int(np.argmin(gap)), gap.shape)
    if gap[i, j] >= distance:
        return None
    return _bad(
        f"is {gap[i, j]:.3g} from itself at s = {min(s[i], s[j]):.4g}, s' = {max(s[i], s[j]):.4g}, nearer than "
        f"{distance:.3g}, which parts of the strip keep",
        "draw it wider there, or give a smaller contact.distance",
    )
