"""What several files of this folder ask: followed once in a process."""

import pytest

from compare.battery.cases.branches.scenes import SHIFT, clamps
from compare.scene.scene import loads
from compare.studies.branches.run import Asked, diagram


@pytest.fixture(scope="session")
def tilted():
    """An elastica, its end shifted over a fold and back."""
    held = clamps((0.96, 0.0, -0.28), (0.28, 0.0, 0.96))
    return diagram(loads(held), SHIFT, 0.0, 0.5, asked=Asked(branches=1))
