"""Requests are refused with the key, the value and a remedy, before dolfinx is touched."""

import subprocess
import sys

import pytest

from shellref import Pose, ShellInputError, ShellOptions, ShellProblem, Waypoint
from shellref.shell.problem import IDENTITY
from shellref.shell.strip import strip_grid

GOOD = {"width": 0.03, "thickness": 3e-4, "poisson": 0.4}


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("width", 0.0),
        ("width", float("nan")),
        ("width", "0.03"),
        ("width", True),
        ("width", None),
        ("thickness", 0.0),
        ("thickness", -1e-3),
        ("thickness", float("inf")),
        ("poisson", 0.51),
        ("poisson", -1.0),
        ("poisson", float("nan")),
        ("natural_curvature", 10.0),
        ("natural_curvature", (1.0,)),
        ("natural_curvature", (1.0, float("nan"))),
        ("gamma", -1.0),
        ("gamma", 5.0),
        ("gamma", float("nan")),
        ("up", (1.0, 1.0, 0.0)),
        ("up", (1.0, 0.0)),
        ("up", "x"),
        ("clamp_position", (0.0, 0.0)),
        ("clamp", "corner"),
        ("clamp_frame", ((1, 0, 0), (0, 1, 0), (0, 0, -1))),
        ("clamp_frame", ((1, 0, 0), (0, 1, 0), (0, 0.1, 1))),
        ("clamp_frame", ((1, 0, 0), (0, 1, 0))),
        ("clamp_frame", 3),
        ("elements", (0, 4)),
        ("elements", (10,)),
        ("elements", (10.0, 4)),
        ("elements", (10, True)),
        ("elements", "ab"),
        ("grading", (0.0, 1.0)),
        ("grading", (1.0, 1.5)),
        ("transverse_curvature", 105.0),  # half a turn and more over the width
        ("transverse_curvature", float("nan")),
        ("start_curvature", "flat"),
        ("corner", 0.01),  # with a clamp that holds the edge
        ("edge_layer", 0.0),
        ("edge_layer", "wide"),
        ("end", 3),
        ("end", {"position": (0.0, 0.0, 1.0)}),
        ("path", 3),
        ("path", "release"),
    ],
)
def test_bad_problem_names_its_key(key, value):
    with pytest.raises(ShellInputError) as caught:
        ShellProblem(**{**GOOD, key: value})
    assert caught.value.key in (key, "up")  # a weight without a direction is the direction's fault
    assert caught.value.remedy
    assert caught.value.key in str(caught.value)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("tolerance", 0.0),
        ("max_newton", 0),
        ("max_newton", 2.5),
        ("first_step", 1.5),
        ("min_step", -1.0),
        ("growth", 0.5),
        ("cut", 1.0),
        ("stabilisation", -1.0),
        ("natural_path", "far"),
        ("iteration", "fast"),
        ("kick", 1),
        ("switch", "yes"),
        ("max_step", 2.0),
        ("max_steps", 0),
        ("arc_length", "maybe"),
        ("arc_step", 0.0),
        ("max_arc", -1.0),
        ("event_tolerance", 0.0),
        ("max_strain", 0.0),
        ("accuracy", 0.0),
        ("max_cells", 0),
    ],
)
def test_bad_option_names_its_key(key, value):
    with pytest.raises(ShellInputError) as caught:
        ShellOptions(**{key: value})
    assert caught.value.key == key


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"end": {"position": (0, 0), "frame": IDENTITY}}, "end.position"),
        ({"end": {"position": (0, 0, 1), "frame": 1}}, "end.frame"),
        ({"path": [{"natural": "x"}]}, "path.natural"),
        ({"path": [{"gravty": 1.0}]}, "path.gravty"),
        ({"path": [{"end": {"position": (0, 0, 1), "frame": IDENTITY}}]}, "path.end"),  # no clamp at the end
        ({"path": [{"start": {"position": (0, 0, 1)}}]}, "path.start"),
        ({"clamp": "free", "gamma": 1.0, "up": (1, 0, 0)}, "clamp"),
        ({"clamp": "free", "end": Pose((0, 0, 1), IDENTITY)}, "clamp"),
        ({"clamp": "free", "clamp_position": (1, 0, 0)}, "clamp"),
        ({"clamp": "corners", "corner": 0.015}, "corner"),
        ({"transverse_curvature": 5.0, "start_curvature": 1.0}, "start_curvature"),
    ],
)
def test_what_does_not_go_together_is_refused(change, key):
    with pytest.raises(ShellInputError) as caught:
        ShellProblem(**{**GOOD, **change})
    assert caught.value.key == key
    assert caught.value.remedy


def test_corners_need_knots_of_the_mesh():
    with pytest.raises(ShellInputError) as caught:
        strip_grid(ShellProblem(**GOOD, clamp="corners", corner=0.01, elements=(20, 2)))
    assert caught.value.key == "elements"
    assert "corner" in str(caught.value)


def test_poisson_one_half_is_allowed_in_plane_stress():
    assert ShellProblem(**{**GOOD, "poisson": 0.5}).poisson == 0.5


def test_dict_round_trip_and_strictness():
    problem = ShellProblem(**GOOD, natural_curvature=(1, 2), gamma=3, up=(0, 1, 0), elements=(7, 3))
    assert ShellProblem.from_dict(problem.to_dict()) == problem
    pose = Pose((0, 0, 0.9), IDENTITY)
    path = (Waypoint(natural=0.5, end=pose, name="bend"), Waypoint(gravity=1.0, start=pose))
    problem = ShellProblem(**GOOD, clamp="corners", corner=0.005, end=pose, path=path, edge_layer="auto")
    assert ShellProblem.from_dict(problem.to_dict()) == problem
    options = ShellOptions(first_step=0.2, kick=False, switch=True, accuracy=1e-3)
    assert ShellOptions.from_dict(options.to_dict()) == options
    with pytest.raises(ShellInputError, match="widht"):
        ShellProblem.from_dict({**GOOD, "widht": 1.0})
    with pytest.raises(ShellInputError, match="thickness"):
        ShellProblem.from_dict({"width": 0.03, "poisson": 0.4})
    with pytest.raises(ShellInputError):
        ShellOptions.from_dict([1])


def test_importing_the_package_does_not_import_dolfinx():
    code = "import sys, shellref, shellref.path.solve, shellref.worker; sys.exit('dolfinx' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
