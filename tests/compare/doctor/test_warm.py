"""What is compiled beforehand: a solve after it compiles nothing."""

import os
import subprocess
import sys

import pytest

from compare.models.warm import RIBBONS, forms, warm
from compare.scene.scene import load
from ribbonbench.errors import Missing

_COUNT = """
import sys
from compare import registry
from compare.models.base import Options
from compare.models.timing import compiled
from compare.scene.scene import load
with compiled() as count:
    for name in sys.argv[1:]:
        assert registry.model("ribbon").solve(load(name), options=Options(error=True)).ok
print(count())
"""

#: Kernels that a batch and a solve by Ipopt compile.
_COUNT_BESIDE = """
from compare.models.timing import compiled
from ribbon import Clamp, Gravity, Strip, solve, solve_many
strips = [Strip(1.0, 0.05, natural_curvature=curl, gamma=20.0) for curl in (1.0, 2.0)]
with compiled() as count:
    solve_many(strips, Clamp(), Gravity((0.6, 0.0, 0.8)), segments=12)
    solve(strips[0], Clamp(), Gravity((0.6, 0.0, 0.8)), segments=12, solver="ipopt")
print(count())
"""


def test_the_kinds_of_ribbons_are_scenes_and_warm_twice_compiles_nothing():
    for name, keys in RIBBONS:
        assert load(name).replace(keys).strip.width > 0.0
    warm(shell=False)
    assert warm(shell=False).kernels == 0


def test_a_machine_without_a_shell(monkeypatch):
    from compare import registry

    class Absent:
        def solve(self, *_: object, **__: object) -> object:
            raise Missing("dolfinx")

    monkeypatch.setattr(registry, "model", lambda _: Absent())
    assert forms() is None


@pytest.mark.validate
def test_solves_after_it_compile_nothing(tmp_path):
    """With a cache of its own: all that is compiled is compiled by `warm`."""
    place = {**os.environ, "RIBBONBENCH_CACHE": str(tmp_path), "PYTHONPATH": os.getcwd()}

    def run(*words: str) -> str:
        return subprocess.run([sys.executable, *words], env=place, capture_output=True, text=True, check=True).stdout

    scenes = ("coil_10_100", "two_clamps_5_3_2", "moebius_6_1", "hanging_5_3_1")
    assert int(run("-c", "from compare.models.warm import warm; print(warm(shell=False).kernels)")) > 50
    assert int(run("-c", _COUNT, *scenes)) == 0
    assert int(run("-c", _COUNT_BESIDE)) == 0
