"""From a scene's drawn curve downhill, kept on the way and told; and onto segments that follow what touches."""

from __future__ import annotations

import json
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from compare.models.ribbon.build import build_arguments
from compare.store.arrays import npz_bytes
from compare.store.store import atomic_write_bytes
from ribbon.find.solving.request import How, Request

if TYPE_CHECKING:
    from compare.scene.scene import Scene
    from ribbon import Equilibrium

FloatArray = NDArray[np.float64]
Say = Callable[[str], None]

#: The file of an unfinished way downhill, in the folder of its results.
LANDING_FILE = "landing.npz"


class Landing:
    """The way downhill of one run: where it is stands in a file of `folder` (None: nothing is kept) under the key of
    the run, after every look at what could meet; `say` is told, None: nobody."""

    def __init__(self, folder: Path | None, key: str, say: Say | None) -> None:
        self.path = None if folder is None else folder / LANDING_FILE
        self.key, self.say = key, say
        self.looks, self.energy = 0, 0.0

    def begin(self) -> FloatArray | None:
        """The unknowns (n,) that an interrupted run of the same scene and sources got to; None: none, or unusable."""
        if self.path is None or not self.path.exists():
            return None
        try:
            with np.load(self.path, allow_pickle=False) as data:
                about, x = json.loads(str(data["about"])), np.asarray(data["x"], dtype=float)
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error):
            return None
        if about.get("key") != self.key or not np.all(np.isfinite(x)):
            return None
        self.looks = int(about["looks"])
        self._tell(f"goes on from look {self.looks}")
        return x

    def look(self, looks: int, x: FloatArray, energy: float) -> None:
        """Keeps the unknowns of a look (`ribbon.find.snap.Look`), and says so."""
        self.looks, self.energy = self.looks + 1, energy
        if self.path is not None:
            about = json.dumps({"key": self.key, "looks": self.looks})
            atomic_write_bytes(self.path, npz_bytes({"about": np.array(about), "x": x}))
        self._tell(f"look {self.looks}, energy {energy:.6g} D w / l")

    def step(self, iteration: int, energy: float, _: float) -> None:
        """Says where an iteration is (`ribbon.find.solving.request.Progress`)."""
        self._tell(f"look {self.looks + 1}, iteration {iteration}, energy {energy:.6g} D w / l")

    def _tell(self, text: str) -> None:
        if self.say is not None:
            self.say(f"downhill of seed.curve: {text}")

    def remove(self) -> None:
        """Forgets where it is: it is finished."""
        if self.path is not None:
            self.path.unlink(missing_ok=True)


def begun(scene: Scene, leave_saddle: bool, landing: Landing) -> Equilibrium:
    """The equilibrium downhill of the scene's drawn curve, on segments that stand still."""
    request = Request.of(**build_arguments(scene))
    how = How(leave_saddle=leave_saddle, progress=landing.step)
    assert scene.seed_points is not None
    from ribbon.find.jointed import drawn

    return drawn.solved(request, scene.seed_points, how, scene.model.budget, begin=landing.begin(), look=landing.look)


def followed(scene: Scene, state: Equilibrium, say: Say | None = None) -> Equilibrium:
    """The state on segments that follow what the rod touches itself with, where the scene asks for it."""
    if not scene.follows:
        return state

    def step(iteration: int, energy: float, _: float) -> None:
        if say is not None:
            say(f"segments that follow what touches: iteration {iteration}, energy {energy:.6g} D w / l")

    from ribbon.find.jointed import drawn

    return drawn.following(state, scene.model.budget, step)
