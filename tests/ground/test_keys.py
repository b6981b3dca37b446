"""Nothing kept outlives the code: on a copy of the tree, every module in the closure of what makes a result moves its
key, and none outside does (models, sweeps, studies, ways that are resumed, shells, the shell's own checkpoints)."""

from __future__ import annotations

import shutil
from collections.abc import Callable

import pytest

from compare import registry
from compare.models.ribbon.stages import run_key
from compare.models.shell_build import shell_problem
from compare.models.shell_process import shell_key
from compare.scene.scene import load
from compare.store import provenance
from compare.studies.cost_bench import made_by
from compare.sweep.case import COMPARE
from compare.sweep.run import software_digest
from ribbonbench import sources
from ribbonbench.sources import PACKAGES, Module, Sources, read
from shellref.shell.options import ShellOptions
from tests.test_setup import ROOT

SCENE = load("curl_4_3")
NAMES = tuple(entry.name for entry in registry.BUILT_IN)


PROBLEM = shell_problem(SCENE, 100.0, (8, 1))
RIBBON = registry.home("ribbon")


def kept(name: str) -> dict[str, tuple[Callable[[], object], tuple[str, ...]]]:
    """What is kept of a model: its key, and the modules that it begins with."""
    own = registry.home(name)
    return {
        f"model {name}": (lambda: provenance.software(own), (own,)),
        f"sweep {name}": (lambda: software_digest(name), ("compare.sweep.case", own)),
        f"cost {name}": (lambda: made_by(name, "ribbon"), ("compare.studies.cost_bench", own, RIBBON)),
    }


#: What is kept -> its key, and the modules that it begins with.
KEPT: dict[str, tuple[Callable[[], object], tuple[str, ...]]] = {
    **{key: value for name in NAMES for key, value in kept(name).items()},
    "sweep of comparisons": (lambda: software_digest(COMPARE), ("compare.sweep.pair", *map(registry.home, NAMES))),
    "way": (lambda: run_key(SCENE, False), ("compare.models.ribbon.stages",)),
    "shell": (lambda: shell_key(PROBLEM, ShellOptions()), ("shellref.worker",)),
    "shell's walk": (lambda: sources.digest("shellref.path.solver"), ("shellref.path.solver",)),
}


class Live(Sources):
    """A tree of which one file is read again after it has changed."""

    now: tuple[str, Module] | None = None

    def change(self, path):
        """From now on the file is as it is now; None: all are as they were."""
        self.now = None if path is None else (str(path), read(path.read_bytes()))

    def module(self, path):
        """As the file is."""
        return self.now[1] if self.now is not None and str(path) == self.now[0] else super().module(path)


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy of the four packages."""
    place = tmp_path_factory.mktemp("tree")
    for name in PACKAGES:
        shutil.copytree(ROOT / name, place / name, ignore=shutil.ignore_patterns("__pycache__"))
    return place


@pytest.fixture
def live(copy, monkeypatch):
    """The copy in place of the tree."""
    found = Live(copy)
    monkeypatch.setattr(sources, "ours", lambda: found)
    sources.digest.cache_clear()
    yield found
    sources.digest.cache_clear()


def keys() -> dict[str, object]:
    """All keys, as the sources are now."""
    sources.digest.cache_clear()
    return {name: key() for name, (key, _) in KEPT.items()}


def test_every_module_of_its_closure_moves_a_key_and_no_other(live):
    closures = {name: set(live.closure(*entries)) for name, (_, entries) in KEPT.items()}
    before = keys()
    wrong, moved = [], set()
    for module, path in sorted(live.every().items()):
        text = path.read_bytes()
        path.write_bytes(text + b"\nPLANTED = 1\n")
        live.change(path)
        after = keys()
        path.write_bytes(text)
        moves = {name for name in KEPT if after[name] != before[name]}
        moved |= moves
        wrong += [(module, name) for name in KEPT if (name in moves) != (module in closures[name])]
    live.change(None)
    assert wrong == []
    assert moved == set(KEPT)
    assert keys() == before


#: Kept result -> modules that its numbers depend on, and modules that they do not: those that were found wrong.
FACTS = {
    "shell": ({"shellref.kernels.fronts", "shellref.path.ldl", "shellref.shell.naghdi"}, {"ribbon.find.solve"}),
    "model shell": ({"shellref.kernels.fronts", "shellref.worker", "compare.measure.grid"}, {"ribbon.find.solve"}),
    "model curve_angle": ({"ribbon.energies.section.rod", "ribbon.rods.solve"}, {"ribbon.find.solve"}),
    "model ribbon": ({"ribbon.energies.wunderlich", "ribbon.find.solve"}, {"shellref.worker"}),
    "model elastica": ({"shellref.elastica.solve"}, {"ribbon.find.solve", "shellref.worker", "compare.models.shell"}),
    "way": ({"ribbon.find.continuation", "compare.scene.homotopy", "ribbon.find.solve"}, {"compare.page.remedies"}),
    "sweep elastica": (
        {"compare.page.force_displacement", "compare.page.remedies", "compare.sweep.case"},
        {"ribbon.find.solve", "shellref.worker", "compare.studies.compare", "compare.sweep.page", "compare.sweep.pair"},
    ),
    "sweep of comparisons": (
        {"compare.studies.compare", "shellref.kernels.fronts", "ribbon.find.solve", "compare.page.remedies"},
        {"compare.sweep.page", "compare.pages.report.html"},
    ),
    "cost elastica": ({"compare.studies.cost_runs", "ribbon.find.solve"}, {"compare.pages.cost"}),
    "shell's walk": ({"shellref.path.walk", "shellref.kernels.fronts", "shellref.path.arc"}, {"ribbon.find.solve"}),
}  # fmt: skip


@pytest.mark.parametrize("name", FACTS)
def test_what_a_kept_result_depends_on(name):
    """Facts that stand beside the computed closure: a closure that loses a module is seen here."""
    found = set(sources.closure(*KEPT[name][1]))
    inside, outside = FACTS[name]
    assert inside - found == set()
    assert outside & found == set()
    assert (inside | outside) - sources.ours().every().keys() == set()


def test_a_case_belongs_to_the_code_of_its_model(tmp_path):
    """A module of a model from outside, also one that it imports from beside itself, moves its own key and no other."""
    from tests.compare.studies.outside import Arc, registered

    (tmp_path / "arc_law.py").write_text("FACTOR = 1.0\n")
    (tmp_path / "arc_model.py").write_text(
        "import arc_law, compare.models.base\nfrom tests.compare.studies.outside import Arc as Base\n"
        "class Arc(Base):\n    pass\n"
    )
    own = type("Arc", (Arc,), {"__module__": "arc_model"})

    def digests(*names):
        sources.ours.cache_clear()
        sources.digest.cache_clear()
        return {name: software_digest(name) for name in names}

    ours = digests(*NAMES)
    assert len(set(ours.values())) == len(NAMES)
    with registered(tmp_path, own):
        first = digests("arc")
        assert registry.home("arc") == "arc_model"
        assert set(sources.closure("arc_model")) >= {"arc_model", "arc_law", "compare.models.base"}
        (tmp_path / "arc_law.py").write_text("FACTOR = 2.0\n")
        second = digests("arc")
        assert len({*ours.values(), first["arc"], second["arc"]}) == len(NAMES) + 2
        assert digests(*NAMES) == ours
    digests()


def test_versions_of_what_a_model_from_outside_imports_are_in_its_key(tmp_path, monkeypatch):
    (tmp_path / "hyp_model.py").write_text("import hypothesis\nimport numpy\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    sources.ours.cache_clear()
    found = provenance.software("hyp_model")["others"]
    sources.ours.cache_clear()
    import hypothesis

    assert found == {"hypothesis": hypothesis.__version__}
    assert "others" not in provenance.software("compare.models.elastica.model")
