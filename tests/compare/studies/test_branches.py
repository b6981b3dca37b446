"""`ribbonbench branches`: critical numbers against closed forms, folds against shooting, what is refused, what is
written."""

import json

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve
from scipy.special import jv

from compare import registry
from compare.battery.cases.branches.scenes import SHIFT, clamps, mast
from compare.commands.main import main
from compare.continuation.correct import first_point
from compare.continuation.finer import relocated
from compare.continuation.follow import follow
from compare.models.base import Options as ModelOptions
from compare.models.branches.elastica import ElasticaEquations
from compare.models.branches.ribbon import equations
from compare.scene.scene import load, loads
from compare.studies.branches.along import Along
from compare.studies.branches.run import Asked, branch, diagram
from ribbon.judge.convexity import curved_slack, least_slack
from ribbonbench.errors import BadInput
from shellref.elastica.problem import ElasticaProblem
from tests.validation.workbench.on_edge_linear import developable

HELD = clamps((0.96, 0.0, -0.28), (0.28, 0.0, 0.96))
MAST = mast("Mast", 0.3, 2.0, "elastica", 6)


def strut(low, high):
    """The clamped strut whose end slides along it, over its load."""

    def at(t):
        force = (-(low + (high - low) * t), 0.0)
        return ElasticaProblem(force=force, end=(1.0, 0.0), slide=(1.0, 0.0), start_angle=0.0, end_angle=0.0)

    return at


def test_the_clamped_strut_buckles_where_the_closed_form_says():
    low, high = 20.0, 170.0
    system = ElasticaEquations(strut(low, high), np.linspace(0.0, 1.0, 7), 3)
    run = follow(first_point(system, np.zeros(system.size), 0.0, 1e-10))
    second = brentq(lambda k: np.tan(k) - k, 4.4, 4.6)
    exact = [4.0 * np.pi**2, 4.0 * second**2, 16.0 * np.pi**2]
    assert [s.kind for s in run.specials] == ["branch_point"] * 3
    assert [s.change for s in run.specials] == [1, 1, 1]
    for special, value in zip(run.specials, exact, strict=True):
        finest = relocated(relocated(special))
        assert low + (high - low) * finest.point.t == pytest.approx(value, rel=2e-6)
        assert max(abs(v) for v in special.values) < 1e-7


@pytest.fixture(scope="module")
def masts():
    return diagram(loads(MAST), "strip.gamma", 2.0, 30.0, ("elastica", "wunderlich"))


def test_a_heavy_mast_falls_over_where_greenhill_says(masts):
    exact = brentq(lambda gamma: jv(-1.0 / 3.0, 2.0 / 3.0 * np.sqrt(gamma)), 6.0, 9.0)
    assert exact == pytest.approx(7.8373474, abs=1e-7)
    for model in ("elastica", "wunderlich"):
        own, up, down = (b for b in masts.branches if b.model == model)
        (point,) = own.special
        assert point.kind == "branch_point"
        assert point.settles
        assert abs(point.settled.value - exact) <= point.error < 1e-4
        regular = [p for p in own.points if p.kind == "regular"]
        assert [p.unstable for p in regular] == [int(p.parameter > exact) for p in regular]
        assert down.image_of == up.number
        assert up.leaves == (own.number, point.parameter)
        assert {p.unstable for p in up.points} == {0}
        assert up.ended == "range"
        assert up.points[-1].energy < own.points[-1].energy
    ends = [b.points[-1].end for b in masts.branches if b.image_of is None and b.leaves is not None]
    assert abs(np.abs(ends[0]) - np.abs(ends[1])).max() < 2e-3  # one shape by both models, fallen to either side


def test_error_bars_hold_what_elements_four_times_as_fine_give(masts):
    scene = loads(MAST).replace({"model.elements": 24})
    finer = diagram(scene, "strip.gamma", 2.0, 30.0, ("wunderlich",), Asked(branches=1, errors=False))
    (coarse,) = next(b for b in masts.branches if b.model == "wunderlich").special
    (fine,) = finer.branches[0].special
    assert abs(coarse.settled.value - fine.parameter) <= coarse.error
    assert fine.parameter == pytest.approx(coarse.meshes[2], abs=1e-8)


def shot(moment, fx, fz):
    """(x, z, theta) of an elastica at s = 1 that is clamped at s = 0, and their derivatives by moment and force."""

    def rate(_, y):
        theta = y[2]
        out = [np.cos(theta), np.sin(theta), y[3], fx * np.sin(theta) - fz * np.cos(theta)]
        for k in range(3):
            turn, bend = y[6 + 4 * k : 8 + 4 * k]
            more = (0.0, np.sin(theta), -np.cos(theta))[k]
            pull = fx * np.cos(theta) + fz * np.sin(theta)
            out += [-np.sin(theta) * turn, np.cos(theta) * turn, bend, pull * turn + more]
        return out

    start = np.zeros(16)
    start[[3, 7]] = moment, 1.0
    end = solve_ivp(rate, (0.0, 1.0), start, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    return end[:3], np.array([end[4 + 4 * k : 7 + 4 * k] for k in range(3)]).T


def test_a_fold_is_where_the_shooting_equations_have_one(tilted):
    (own,) = tilted.branches
    (fold,) = own.special
    assert fold.kind == "fold"
    assert fold.settles
    assert (own.points[0].unstable, own.points[-1].unstable) == (0, 1)
    angle = float(np.arctan2(0.28, 0.96))  # in the plane of the elastica y points along -z

    def missed(unknowns):
        end, slopes = shot(*unknowns[:3])
        return [*(end - np.array([0.8, -unknowns[3], angle])), np.linalg.det(slopes)]

    result = fold.shape.result
    bend = float(np.diff(result.angle(np.array([0.0, 1e-5])))[0] / 1e-5)
    found = fsolve(missed, [bend, *result.forces.end, fold.parameter], xtol=1e-12, full_output=True)
    assert found[2] == 1
    assert found[0][3] == pytest.approx(fold.settled.value, abs=fold.error + 1e-8)


def test_the_ribbons_tangent_is_the_derivative_of_its_residual():
    scene = load("shift_7_2").replace({"path": None, "model.elements": 6})
    along = Along.of(scene, "clamp.end.position[1]", 0.05, 0.3)
    state = registry.model("ribbon").solve(along.scene_at(0.0), options=ModelOptions(error=False))
    system, z = equations(along.scene_at, 0.0, state.native)
    rng = np.random.default_rng(1)
    factor = system.factor(z, 0.2)
    for _ in range(3):
        v = rng.normal(size=system.size) * np.abs(z).clip(1e-2)
        step = 1e-6
        product = (system.residual(z + step * v, 0.2) - system.residual(z - step * v, 0.2)) / (2.0 * step)
        assert factor.solve(product) == pytest.approx(v, rel=1e-3, abs=1e-4 * np.abs(v).max())
    ahead, behind = system.residual(z, 0.21), system.residual(z, 0.19)
    assert system.rate(z, 0.2) == pytest.approx((ahead - behind) / 0.02, abs=1e-8)


def test_bounds_that_begin_to_hold_are_events_and_the_branch_goes_on():
    scene = load("shift_7_2").replace({"model.energy": "sadowsky", "model.elements": 20})
    (own,) = diagram(scene, "clamp.end.position[1]", 0.3, 0.45, asked=Asked(branches=1, errors=False)).branches
    assert own.ended == "range"
    assert [p.kind for p in own.special] == ["event", "event"]
    assert {p.what for p in own.special} == {
        "the ruling at s = 0.225 l comes to its bound", "the ruling at s = 0.775 l comes to its bound",
    }  # fmt: skip
    last = own.points[-1]
    again = registry.model("ribbon").solve(
        scene.replace({"clamp.end.position": [0.5, 0.45, 0.0]}), options=ModelOptions(error=False)
    )
    assert last.energy == pytest.approx(again.energy.total, rel=1e-8)
    assert last.unstable == 0
    assert again.native.active_bounds == 2


@pytest.mark.parametrize(
    ("key", "first", "last", "models", "named"),
    [
        ("strip.gama", 0.0, 1.0, (), "--along"),
        ("strip.poisson", 0.1, 0.2, (), "--along"),
        (SHIFT, None, 0.5, (), "--along"),
        (SHIFT, 0.1, 0.1, (), "--to"),
        (SHIFT, 0.0, 1.5, (), "--to"),
        ("clamp.end.position", 0.0, 0.5, (), "--along"),
        ("clamp.end.position[7]", 0.0, 0.5, (), "--along"),
        ("model.energy", 0.0, 0.5, (), "--along"),
        ("model.elements", 6.0, 9.0, (), "--along"),
        ("tip.force[0]", 0.0, 0.5, (), "--along"),
        ("clamp.end.position[-1]", 0.0, 0.5, (), "--along"),
        ("clamp.end.tangent[0]", 0.9, 0.5, (), "--from"),
        ("strip.gamma", 0.0, 0.5, (), "--along"),
        ("path", None, None, (), "--along"),
        (SHIFT, 0.0, 0.5, ("tape",), "--model"),
        (SHIFT, 0.0, 0.5, ("soap",), "--model"),
        (SHIFT, 0.0, 0.5, ("elastica", "elastica"), "--model"),
    ],
)
def test_what_cannot_be_followed_is_refused_by_name(key, first, last, models, named):
    with pytest.raises(BadInput) as caught:
        diagram(loads(HELD), key, first, last, models)
    assert caught.value.key == named
    assert caught.value.remedy


def test_the_points_of_a_branch_in_python():
    points = list(branch(loads(HELD), along=SHIFT, start=0.0, stop=0.2, errors=False))
    assert [p.parameter for p in points][:1] == [0.0]
    assert points[-1].parameter == 0.2
    for point in points:
        assert point.end == pytest.approx([0.8, 0.0, point.parameter], abs=1e-9)
        assert point.residual < 1e-9


def test_the_command_writes_what_it_says(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mast.toml").write_text(MAST)
    line = ["branches", "mast.toml", "--along", "strip.gamma", "--from", "5", "--to", "10", "--out", "out"]
    assert main(line) == 0
    said = capsys.readouterr().out
    assert "7.83734" in said.splitlines()[0] + said.splitlines()[1]
    found = json.loads((tmp_path / "out" / "branches.json").read_text())
    special = [p for p in found["points"] if p["kind"] == "branch_point"]
    assert special
    assert abs(special[0]["limit"] - 7.8373474394) <= special[0]["parameter_error"]
    shapes = np.load(tmp_path / "out" / "shapes.npz")["centreline"]
    assert shapes.shape == (len(found["points"]), 101, 3)
    assert shapes[[p["shape"]["row"] for p in found["points"]], -1] == pytest.approx(
        np.array([p["end"] for p in found["points"]])
    )
    rows = (tmp_path / "out" / "points.csv").read_text().splitlines()
    assert len(rows) == len(found["points"]) + 1
    assert (tmp_path / "out" / "branches.png").stat().st_size > 10_000
    stable = [p["stable"] for p in found["points"] if p["branch"] == 0 and p["parameter"] > 7.84]
    assert stable
    assert not any(stable)


def test_elements_that_follow_passages_see_the_fork_that_equal_ones_hold_shut():
    """7.2: on three graded meshes it is at 0.3848 +- 0.001, on as many equal elements at 0.3367 (results/shift)."""
    scene = load("shift_7_2").replace({"model.elements": 100})
    asked = Asked(branches=1, errors=False, moving=True)
    (own,) = diagram(scene, "clamp.end.position[1]", 0.34, 0.42, asked=asked).branches
    (fork,) = own.special
    assert fork.kind == "branch_point"
    assert fork.parameter == pytest.approx(0.3848, abs=0.003)
    assert [p.unstable for p in own.points if p.kind == "regular"] == [
        int(p.parameter > fork.parameter) for p in own.points if p.kind == "regular"
    ]
    meshes = [p.shape.equilibrium.problem.lengths for p in own.points]
    assert min(m.min() for m in meshes) < 0.3 / 100
    assert not np.array_equal(meshes[0], meshes[-1])
    for point in (own.points[0], own.points[-1]):
        joints = np.concatenate([[0.0], np.cumsum(point.shape.equilibrium.problem.lengths)])
        passages = point.shape.equilibrium.omega(joints)
        assert np.abs(passages[1:-1]).min() < 0.3
        assert point.residual < 1e-9


#: Width upright and the whole edge clamped: thesis, 7.1.
EDGE = """
title = "On edge"
[strip]
length = 1.0
width = 0.05
poisson = 0.35
gamma = 5.0
[gravity]
up = [0.0, 0.0, 1.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 1.0, 0.0]
ruling = "straight"
[model]
energy = "wunderlich"
elements = 20
grading = "clamp"
"""


@pytest.fixture(scope="module")
def on_edge():
    return diagram(loads(EDGE), "strip.gamma", 5.0, 60.0)


def test_a_straight_strip_falls_by_rulings_that_its_own_modes_do_not_know(on_edge):
    """Its rulings move nothing, its own count of unstable modes stays zero: a quotient to second order, least over all
    rulings, says from which weight on it falls (no elements, nothing of `ribbon`)."""
    exact = developable(0.05, True, True, count=60).gamma
    own, *others = on_edge.branches
    (point,) = own.special
    assert (point.kind, point.unstable, point.error) == ("ruling", 0, None)
    assert 0.999 * exact <= point.parameter <= 1.01 * exact  # an upper bound, by a search
    for p in own.points:
        assert (p.unstable == 0) == (p.parameter <= point.parameter), p.parameter
    one, other = others
    assert one.leaves == (own.number, point.parameter)
    assert other.image_of == one.number
    assert one.ended == "range"
    assert {p.unstable for p in one.points} == {0}
    assert one.points[-1].energy < own.points[-1].energy - 1.0
    assert one.points[-1].end[2] < -0.3  # fallen to one side, and hanging
    assert on_edge.unsettled == 0


def test_what_is_searched_for_is_no_settled_number(on_edge):
    from compare.pages.branches.page import answer

    said = answer(on_edge)
    assert "at the latest" in said.line
    assert said.grade == "fair"


def test_where_the_twist_is_free_it_is_an_ordinary_branch_point():
    scene = loads(EDGE).replace({"strip.thickness": 1e-3, "model.energy": "finite"})
    found = diagram(scene, "strip.gamma", 5.0, 20.0, asked=Asked(branches=1))
    (point,) = found.branches[0].special
    assert point.kind == "branch_point"
    assert point.settles
    assert point.settled.value == pytest.approx(14.188, abs=0.005)  # on 80 elements; results/on_edge: 14.188


def test_a_branch_has_one_energy_where_the_scene_leaves_it_open():
    from compare.models.choice import settled

    scene = loads(EDGE.replace('energy = "wunderlich"\n', "")).replace(
        {"strip.thickness": 2e-3, "strip.natural_curvature": 3.0, "gravity.up": [1.0, 0.0, 0.0], "strip.poisson": 0.4}
    )  # fmt: skip
    assert scene.model.accuracy is not None
    found = diagram(scene, "strip.gamma", 5.0, 15.0, asked=Asked(branches=1, errors=False))
    energy = settled(scene).model.energy
    assert {b.model for b in found.branches} == {energy} == set(found.starts)
    named = diagram(scene, "strip.gamma", 5.0, 15.0, (energy,), Asked(branches=1, errors=False))
    assert named.branches[0].points[-1].energy == pytest.approx(found.branches[0].points[-1].energy, rel=1e-9)


def test_what_was_not_asked_is_not_called_stable(monkeypatch):
    """No time for the rulings, or no answer: then the branch is not good; a place that is not found is said."""
    from compare.pages.branches.page import answer
    from compare.studies.branches import freed

    monkeypatch.setattr(freed, "unstable", lambda points, asks, spent: [None] * len(points))
    found = diagram(loads(EDGE), "strip.gamma", 5.0, 15.0, asked=Asked(branches=1))
    assert found.branches[0].unasked == len(found.branches[0].points)
    assert answer(found).grade == "fair"
    monkeypatch.setattr(freed, "unstable", lambda points, asks, spent: [k > 0 for k in range(len(points))])
    monkeypatch.setattr(freed, "lost", lambda *told: None)
    found = diagram(loads(EDGE), "strip.gamma", 5.0, 15.0, asked=Asked(branches=1))
    assert "place was not found" in answer(found).line
    assert "stable all along" not in answer(found).line


def test_points_without_time_are_unknown():
    from types import SimpleNamespace

    from compare.models.capabilities import Freed
    from compare.studies.branches import freed

    points = [SimpleNamespace(unstable=count) for count in (0, 1, 0)]
    told = iter([Freed(False, lambda: iter(())), None])
    assert freed.unstable(points, lambda point: next(told), lambda: False) == [True, False, False]
    assert freed.unstable(points, lambda point: Freed(None, lambda: iter(())), lambda: False) == [None, False, None]
    assert freed.unstable(points, lambda point: None, lambda: True) == [None, False, None]


def test_a_curled_sadowsky_branch_ends_where_twist_has_no_stiffness_left():
    """Behind it there is a branch point for nearly every element (16 of 20)."""
    scene = loads(CURLED)
    (own,) = diagram(scene, "tip.force[0]", 0.0, 60.0, asked=Asked(branches=1, points=False)).branches
    assert own.ended == "unposed"
    fork, lost = own.special
    assert (fork.kind, lost.kind) == ("branch_point", "event")
    assert fork.settles
    assert lost.settles
    assert fork.settled.value < lost.settled.value
    omega = own.points[-1].shape.equilibrium.omega([0.05, 0.5])
    assert omega[0] == pytest.approx(0.4 * np.pi, abs=1e-6)  # nu K, at the first ruling that may turn
    assert omega[1] > 0.4 * np.pi


CURLED = """
[strip]
length = 1.0
width = 0.03
poisson = 0.4
gamma = 0.0
natural_curvature = 3.141592653589793
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[tip]
force = [0.0, 0.0, 0.0]
[model]
energy = "sadowsky"
elements = 20
"""


def test_a_stable_curled_branch_ends_at_its_first_mode_behind_the_loss():
    """It lost its convexity at 30.7, went on stable, and met three branch points of its elements up to 40."""
    scene = loads(UPRIGHT)
    (own,) = diagram(scene, "tip.force[1]", 0.0, 40.0, asked=Asked(branches=1, points=False)).branches
    assert own.ended == "unposed"
    (lost,) = own.special
    assert lost.kind == "event"
    assert lost.parameter == pytest.approx(31.358, abs=1e-3)
    assert own.points[-1].unstable == 0
    assert own.points[-1].shape.equilibrium.omega(np.linspace(0.0, 1.0, 13)).min() < 1.5  # nu K


UPRIGHT = """
[strip]
length = 1.0
width = 0.05
poisson = 0.5
gamma = 0.0
natural_curvature = 3.0
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
[tip]
force = [0.0, 0.0, 0.0]
[model]
energy = "sadowsky"
elements = 12
"""


def test_the_least_slack_of_segments_is_that_of_many_samples():
    """Of straight rulings whose bending passes zero it is -(nu K)^2 / 4, where joints have 1.9 and 0.5."""
    rng = np.random.default_rng(4)
    omega, eta, natural = rng.uniform(-2.0, 2.0, (3, 40))
    xi = np.linspace(0.0, 1.0, 4001)[:, None]
    along = [one[:-1] + xi * (one[1:] - one[:-1]) for one in (omega, eta, natural)]
    sampled = curved_slack(*along, 0.4).min(axis=0)
    assert least_slack(omega, eta, natural, 0.4) == pytest.approx(sampled, abs=1e-6)
    assert (
        sampled < np.minimum(*(curved_slack(omega, eta, natural, 0.4)[k] for k in (slice(1, None), slice(-1)))) - 0.01
    ).any()
    ends = np.array([-1.0, 1.0]), np.zeros(2), np.ones(2)
    assert least_slack(*ends, 0.5) == pytest.approx([-0.0625], abs=1e-14)


def test_a_curled_strip_whose_bending_passes_zero_between_joints_is_not_convex():
    from types import SimpleNamespace

    from ribbon.find.branch.equations import Equations

    problem = SimpleNamespace(
        strip=SimpleNamespace(poisson=0.5, curvature=(1.0, 1.0)), energy="sadowsky",
        joint_values=lambda x: (np.array([1.0, 1.0, -1.0]), np.zeros(3)), bounds=lambda: (np.zeros(3), np.ones(3)),
        layout=SimpleNamespace(columns=lambda which: slice(None)),
    )  # fmt: skip
    own = SimpleNamespace(problem=lambda t: problem, whole=lambda z, t: (z, z), lengths=np.full(2, 0.5))
    assert Equations.convexity(own, np.zeros(3), 0.0) == pytest.approx(-0.0625, abs=1e-14)


def test_a_curled_strips_density_is_convex_where_its_slack_is_positive():
    """By eigenvalues of the Hessian in curvature and twist: differences of a complex step."""
    rng = np.random.default_rng(3)
    natural, poisson, step = 2.0, 0.4, 1e-5

    def density(k, t):
        return 0.5 * (k * k + t * t) ** 2 / (k * k) - natural * (k + poisson * t * t / k)

    def slope(k, t):
        return np.array([density(k + 1e-30j, t).imag, density(k, t + 1e-30j).imag]) / 1e-30

    signs = []
    for k, eta in rng.uniform([-2.0, -1.0], [2.0, 1.0], (200, 2)):
        t = k * eta
        hessian = np.column_stack([
            (slope(k + step * abs(k), t) - slope(k - step * abs(k), t)) / (2.0 * step * abs(k)),
            (slope(k, t + step * abs(k)) - slope(k, t - step * abs(k))) / (2.0 * step * abs(k)),
        ])  # fmt: skip
        slack = float(curved_slack(np.array(k), np.array(eta), np.array(natural), poisson))
        if abs(slack) > 1e-3:
            signs.append(slack > 0.0)
            assert (np.linalg.eigvalsh(0.5 * (hessian + hessian.T)).min() > 0.0) == signs[-1]
    assert any(signs)
    assert not all(signs)
