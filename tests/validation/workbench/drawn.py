"""Scenes drawn at random, the same ones wherever this runs: forty of the table of hits, a hundred `unseen` ones, which
were drawn once when every constant stood as it does (`tests.validation.workbench.unseen`), and two hundred more."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from compare.scene.scene import Scene, load
from compare.studies.limits import with_clamp

#: Of the generator. The draws are rounded to three digits, so that a table can show a scene as it was.
SEED = 2026_11
#: Scenes of each kind, in the order of their names.
EDGE, CORNERS, ARCHES, SHIFTED = 25, 9, 3, 3
#: Ranges: w / l, w / h and Gamma by their logarithm, the others evenly. K l is 0 in one scene of three.
WIDTH, RATIO, GAMMA = (0.02, 0.3), (20.0, 400.0), (1.0, 1000.0)
POISSON, CURVATURE = (0.0, 0.45), (-15.0, 15.0)
_FLAT = 1.0 / 3.0
#: Angle of the clamp's tangent above the horizontal, of its width from the vertical plane of that tangent (degrees).
TANGENT, ACROSS = (-60.0, 60.0), (0.0, 90.0)
#: Between two clamps: narrower strips, lighter ones, how far the second clamp stands (arches: from the first; shifted
#: ones: to the side).
NARROW, LIGHT, APART, ASIDE = (0.02, 0.15), (1.0, 30.0), (0.85, 0.97), (0.02, 0.3)


def drawn() -> tuple[tuple[str, Scene], ...]:
    """Names and scenes: held by an edge, by its corners, bent between two clamps, between clamps that are shifted."""
    rng = np.random.default_rng(SEED)
    found = [(f"edge_{n:02d}", with_clamp(_held(rng), "edge")) for n in range(1, EDGE + 1)]
    found += [(f"corners_{n:02d}", with_clamp(_held(rng), "corners")) for n in range(1, CORNERS + 1)]
    found += [(f"arch_{n:02d}", _arch(rng)) for n in range(1, ARCHES + 1)]
    found += [(f"shifted_{n:02d}", _shifted(rng)) for n in range(1, SHIFTED + 1)]
    return tuple(found)


#: The same of a hundred scenes more, held at one end, arched, between clamps that are turned and shifted; their w / h.
UNSEEN_SEED = 2026_11_23
UNSEEN_HELD, UNSEEN_ARCHES, UNSEEN_TURNED = 60, 15, 25
UNSEEN_RATIO = (15.0, 400.0)
#: Turn of the second clamp about its tangent, and lean of its tangent (degrees).
TURN, LEAN = (-75.0, 75.0), (-25.0, 25.0)


def unseen() -> tuple[tuple[str, Scene], ...]:
    """Names and scenes of a hundred: pose, width, thickness, Poisson's ratio, curl and weight drawn for each."""
    return _unseen(UNSEEN_SEED, (UNSEEN_HELD, UNSEEN_ARCHES, UNSEEN_TURNED), 2)


#: Two hundred more, drawn when the estimate had been mended with those hundred in view: others than these, of the same
#: kinds, the kinds in turn, so that a run that was stopped has some of each.
AGAIN_SEED = 2026_11_24
AGAIN_HELD, AGAIN_ARCHES, AGAIN_TURNED = 100, 30, 70


def unseen_again() -> tuple[tuple[str, Scene], ...]:
    """Names and scenes of the two hundred, ten held at one end, three arches and seven turned ones in turn."""
    counts = (AGAIN_HELD, AGAIN_ARCHES, AGAIN_TURNED)
    found, rounds, mixed = list(_unseen(AGAIN_SEED, counts, 3)), counts[0] // 10, []
    for k in range(rounds):
        first = 0
        for count in counts:
            part = count // rounds
            mixed += found[first + k * part : first + (k + 1) * part]
            first += count
    return tuple(mixed)


def _unseen(seed: int, counts: tuple[int, int, int], digits: int) -> tuple[tuple[str, Scene], ...]:
    """So many held at one end, arches, and scenes with a turned and shifted clamp; digits: of the numbers in names."""
    rng = np.random.default_rng(seed)
    draws = {
        "held": lambda: with_clamp(_held(rng, UNSEEN_RATIO), "edge"),
        "arch": lambda: _arch(rng, UNSEEN_RATIO),
        "turned": lambda: _turned(rng),
    }
    return tuple(
        (f"{kind}_{n:0{digits}d}", draw())
        for (kind, draw), count in zip(draws.items(), counts, strict=True)
        for n in range(1, count + 1)
    )


def _turned(rng: np.random.Generator) -> Scene:
    """A strip between two clamps, the second one shifted aside, turned about its tangent and leaning."""
    keys = _strip(rng, NARROW, LIGHT, UNSEEN_RATIO)
    keys["clamp.end.position"] = [_evenly(rng, (0.5, 0.9)), _evenly(rng, ASIDE), _evenly(rng, (-0.1, 0.1))]
    turn, lean, aside = (math.radians(_evenly(rng, range_)) for range_ in (TURN, LEAN, LEAN))
    along = np.array([math.cos(lean) * math.cos(aside), math.cos(lean) * math.sin(aside), math.sin(lean)])
    flat = np.cross(along, [0.0, 1.0, 0.0])
    normal = -flat / np.linalg.norm(flat)
    keys["clamp.end.tangent"] = along.tolist()
    keys["clamp.end.normal"] = (math.cos(turn) * normal + math.sin(turn) * np.cross(along, normal)).tolist()
    keys |= {"gravity.up": [0.0, 0.0, 1.0], "strip.natural_curvature": _evenly(rng, (-4.0, 4.0))}
    return with_clamp(load("shift_7_2").replace({**keys, "shell.width_to_thickness": None}), "edge")


def _rounded(value: float) -> float:
    """Three digits of a number."""
    return float(f"{value:.3g}")


def _evenly(rng: np.random.Generator, range_: tuple[float, float]) -> float:
    return _rounded(rng.uniform(*range_))


def _logarithmically(rng: np.random.Generator, range_: tuple[float, float]) -> float:
    return _rounded(math.exp(rng.uniform(math.log(range_[0]), math.log(range_[1]))))


def _strip(
    rng: np.random.Generator,
    width: tuple[float, float],
    gamma: tuple[float, float] | None,
    ratio: tuple[float, float] = RATIO,
) -> dict[str, Any]:
    """Keys of a strip, l = 1: width, thickness, Poisson's ratio, weight."""
    w = _logarithmically(rng, width)
    keys: dict[str, Any] = {"strip.width": w, "strip.thickness": _rounded(w / _logarithmically(rng, ratio))}
    keys["strip.poisson"] = _evenly(rng, POISSON)
    if gamma is not None:
        keys["strip.gamma"] = _logarithmically(rng, gamma)
    return keys


def _held(rng: np.random.Generator, ratio: tuple[float, float] = RATIO) -> Scene:
    """A strip held at one end, curved or not, in any pose up to turns about the vertical."""
    keys = _strip(rng, WIDTH, GAMMA, ratio)
    flat = rng.uniform() < _FLAT
    keys["strip.natural_curvature"] = 0.0 if flat else _evenly(rng, CURVATURE)
    up, turn = (math.radians(_evenly(rng, range_)) for range_ in (TANGENT, ACROSS))
    along = np.array([math.cos(up), 0.0, math.sin(up)])
    across = math.cos(turn) * np.array([-math.sin(up), 0.0, math.cos(up)]) + math.sin(turn) * np.array([0.0, 1.0, 0.0])
    keys["clamp.start.tangent"] = along.tolist()
    keys["clamp.start.normal"] = np.cross(along, across).tolist()
    return load("limits_7_3").replace({**keys, "shell.corner": None})


def _arch(rng: np.random.Generator, ratio: tuple[float, float] = RATIO) -> Scene:
    """A flat strip bent between a vertical and a horizontal clamp (5.3.2), the second one a little aside."""
    keys = _strip(rng, NARROW, LIGHT, ratio)
    apart, aside = _evenly(rng, APART), 0.1 * _evenly(rng, (0.0, 1.0))
    keys["clamp.end.position"] = [apart * math.sqrt(0.5), aside, apart * math.sqrt(0.5)]
    return with_clamp(load("two_clamps_5_3_2").replace(keys), "edge")


def _shifted(rng: np.random.Generator) -> Scene:
    """A weightless arch whose second clamp is shifted to its side (7.2)."""
    keys = _strip(rng, NARROW, None)
    keys["clamp.end.position"] = [0.5, _evenly(rng, ASIDE), 0.0]
    return load("shift_7_2").replace({**keys, "shell.width_to_thickness": None})
