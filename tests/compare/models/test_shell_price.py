"""What a shell takes is said before it is begun, and asked about where it is hours or more memory than a desk has."""

from __future__ import annotations

from csv import DictReader
from itertools import pairwise
from statistics import geometric_mean

import pytest

from compare.cli import main
from compare.models.base import Options
from compare.models.effects.price import ITERATIONS, MEASURED, MOST, check_price, price
from compare.registry import model
from compare.scene.scene import load
from ribbonbench.accepted import YES, accepting
from ribbonbench.errors import BadInput
from tests.test_setup import ROOT
from tests.validation.record import Pages
from tests.validation.shell.shell_size import CELLS

#: Most that the machine of the page may be faster or slower than that of the price, what then is left from mesh to
#: mesh, and how far their memory may differ.
MACHINES, MESHES, MEMORY = 8.0, 2.0, 0.15


def test_the_price_is_made_of_what_was_measured():
    """The constants are the rows of the run that they were taken from (tests/reference), and the price goes through."""
    with (ROOT / "tests/reference/shell_prices.csv").open(newline="") as lines:
        rows = [tuple(map(float, row.values())) for row in DictReader(lines)]
    assert tuple(rows) == MEASURED
    for cells, seconds, newton, gigabytes in MEASURED:
        requested = price((cells, 1))
        assert requested.seconds == pytest.approx(ITERATIONS * seconds / newton, rel=1e-9)
        assert requested.gigabytes == pytest.approx(gigabytes, rel=1e-9)


def test_the_price_agrees_with_the_page():
    """Seconds of an iteration to what machines and meshes differ by, memory to what libraries do, on every mesh."""
    numbers = Pages().read("shell_size").numbers
    ratios = []
    for (along, across), row in zip(CELLS, MEASURED, strict=True):
        name = f"{along}x{across}"
        seconds, newton, memory = (numbers[f"{key}_{name}"].value for key in ("seconds", "iterations", "memory"))
        said = price((along, across))
        assert (along * across, newton) == (row[0], row[2])
        ratios.append(seconds / newton / (said.seconds / ITERATIONS))
        assert memory == pytest.approx(said.gigabytes, rel=MEMORY)
    machine = geometric_mean(ratios)
    assert 1.0 / MACHINES < machine < MACHINES
    assert all(1.0 / MESHES < ratio / machine < MESHES for ratio in ratios), ratios


def test_prices_rise_with_cells_and_degree():
    found = [price((n, n)) for n in (1, 5, 20, 70, 200, 1000, 6000)]
    for less, more in pairwise(found):
        assert 0.0 < less.seconds < more.seconds
        assert 0.0 < less.gigabytes < more.gigabytes
    assert price((100, 8), 3).cells == 1800.0


@pytest.mark.parametrize(
    ("elements", "dear"), [((100, 8), False), ((1000, 40), False), ((2000, 200), True), ((20000, 2000), True)]
)
def test_a_dear_shell_is_not_begun_without_a_word(elements, dear, monkeypatch):
    monkeypatch.delenv(YES, raising=False)
    scene = load("curl_4_3").replace({"shell.elements": list(elements), "shell.tolerance": None})
    assert price(elements).dear == dear
    if not dear:
        assert not check_price(scene).dear
        return
    with pytest.raises(BadInput, match=r"--yes .*Options\(yes=True\)") as refused:
        check_price(scene)
    assert refused.value.key == "shell.elements"
    assert price(elements).text in str(refused.value)
    with pytest.raises(BadInput, match="--yes"):
        model("shell").solve(scene, options=Options())
    assert check_price(scene, yes=True).seconds > MOST[0] or check_price(scene, yes=True).gigabytes > MOST[1]
    with accepting(True):
        assert check_price(scene).dear


@pytest.mark.parametrize("command", ["compare", "limits", "shell"])
def test_commands_end_before_anything_is_solved(command, tmp_path, capsys, monkeypatch):
    monkeypatch.delenv(YES, raising=False)

    def begun(*arguments, **keywords):
        raise AssertionError("something was solved")

    monkeypatch.setattr("compare.models.ribbon.model.RibbonModel.solve", begun)
    monkeypatch.setattr("compare.models.shell.run_shell", begun)
    words = [command, "curl_4_3", "--set", "shell.elements=[20000,2000]", "--out", str(tmp_path), "--quiet"]
    assert main(words) == 2
    said = capsys.readouterr().err
    assert "days" in said
    assert "TB" in said
    assert "--yes" in said
