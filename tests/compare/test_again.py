"""The line that makes results again: of every command, with every option set; typed again, it asks for the same."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from compare import cli, commands
from compare.commands.line import recorded
from compare.commands.parser import Parser
from compare.page.page import Page, read_page
from compare.pages.report import html as report_html
from compare.pages.report import markdown as report_markdown
from compare.pages.report.folders import Part
from compare.pages.report.words import THROUGH_PYTHON
from compare.scene.scene import load
from compare.store.store import read_json
from compare.studies import cost_bench
from compare.studies.axes import parse_axis
from compare.sweep.file import load_sweep
from compare.sweep.parted import claimed
from compare.sweep.shard import Shard

#: Commands that leave no page.
WITHOUT = {"report", "scenes", "doctor", "new", "keys", "completion", "live"}
MESH = ("--set", "shell.elements=[10, 2]", "--set", "shell.width_to_thickness=20")
PLACE = ("--out", "some where", "--quiet", "--wide", "--json")
OUT = (*PLACE, "--units", "l")
PINS = """
[[agreement]]
scene = "curl_4_3"
width_to_thickness = 20
set = { "shell.elements" = [10, 2] }
distance = 1.0
validate = true
"""

#: The cantilever's middle and end.
POINTS = """x,y,z,s
0.0,-0.083,0.234,0.25
0.0,-0.272695,0.397485,0.5
0.0,-0.48,0.53,0.75
0.0,-0.700200,0.656354,1.0
"""

#: One or more lines of each command, which together set every option it has.
LINES = {
    "solve": [
        ("solve", "coil_10_100", "--set", "model.elements=4", "--leave-saddle", "--time", *OUT),
        ("solve", "daisy_5g", "--set", "model.elements=20", "--yes", *OUT),
        ("solve", "coil_10_100", "--set", "model.elements=2", "--set", "strip.gamma=1", "--all", *OUT),
        ("solve", "coil_10_100", "--set", "model.elements=4", "--stay", *OUT),
    ],
    "compare": [
        ("compare", "curl_4_3", *MESH, "--leave-saddle", "--yes", *OUT),
        ("compare", "curl_4_3", *MESH, "--stay", *OUT),
    ],
    "shell": [
        ("shell", "curl_4_3", "--set", "strip.gamma=90", "--width-to-thickness", "20", "--elements", "6", "1",
         "--tolerance", "0.09", "--plain", "--yes", *OUT),
    ],
    "limits": [
        ("limits", "limits_7_3", "--set", "strip.poisson=0.3", "--leave-saddle", "--quick", "--clamp", "both", "--vary",
         "strip.natural_curvature=1", "--widths", "0.2", "--gammas", "10", "--thickness-to-width",
         "0.05", "--distance", "9.5", "--share", "7", *OUT),
        ("limits", "limits_7_3", "--quick", "--width-to-thickness", "20", "30", "--stay", "--yes", *OUT),
    ],
    "cost": [
        ("cost", "cantilever", "--set", "strip.gamma=3", "--solvers", "chained", "placed",
         "--segments", "2", "3", "--tolerances", "3e-2", "--meshes", "4x1", "6x1", "--elastica-elements", "4", "8",
         "--width-to-thickness", "20", "--reference", "own", "--target", "1e-2", "--repeats", "1", "--budget", "1e9",
         "--compilation", "--fresh", "--leave-saddle", "--yes", *OUT),
        ("cost", "cantilever", "--solvers", "chained", "--segments", "2", "--repeats", "1", "--stay", *OUT),
    ],
    "converge": [
        ("converge", "curl_4_3", "--set", "strip.gamma=100", "--leave-saddle", "--width-to-thickness", "10", "20",
         "--elements", "10", "2", "--ruling", "free", "--yes", *OUT),
        ("converge", "curl_4_3", "--stay", "--width-to-thickness", "10", "20", "--elements", "10", "2", *OUT),
    ],
    "export": [("export", "coil_10_100", "--set", "model.elements=4", "--format", "npz,obj", "--scale", "2", *PLACE),
               ("export", "cantilever", "--set", "model.elements=4", "--to", "usd", *PLACE)],
    "sweep": [
        ("sweep", "cantilever", "--set", "model.elements=4", "--vary", "strip.gamma=1,3", "--solver", "ribbon",
         "--errors", "--leave-saddle", "--yes", "--show", "end.y", "--against", "strip.gamma", "--workers", "1",
         "--fresh", *OUT),
        ("sweep", "cantilever", "--set", "model.elements=4", "--vary", "strip.gamma=1,3", "--stay", "--shapes", "5",
         *OUT),
        ("sweep", "cantilever", "--set", "model.elements=4", "--vary", "strip.gamma=1,3", "--shard", "1/2", "--table",
         "csv", "--neighbours", *OUT),
        ("sweep", "cantilever", "--set", "model.elements=4", "--vary", "strip.gamma=1,3", "--join", "own part", *OUT),
    ],
    "identify": [
        ("identify", "cantilever", "own points.csv", "--set", "model.elements=6", "--free", "strip.gamma", "--yes",
         "--unit", "m", "--register", *OUT),
    ],
    "branches": [
        ("branches", "cantilever", "--set", "model.elements=4", "--along", "strip.gamma", "--from", "1", "--to", "3",
         "--model", "wunderlich,sadowsky", "--branches", "2", "--steps", "40", "--within", "100", "--no-errors",
         "--errors", "none",
         "--moving", "--yes", *OUT),
        ("branches", "cantilever", "--set", "model.elements=4", "--along", "strip.gamma", "--from", "1", "--to", "3",
         "--branches", "1", "--no-errors", "--over", "strip.width=0.02,0.03", *OUT),
    ],
    "explain": [
        ("explain", "cantilever", *MESH, "--run", "--shell", "--yes", *OUT),
        ("explain", "daisy_5g", "--set", "model.elements=20", *OUT),
    ],
    "check": [
        ("check", "curl_4_3", *MESH[:2], "--leave-saddle", "--distance", "0.9", "--share", "0.8", "--slope", "-9", "9",
         "--width-to-thickness", "10", "20", *OUT),
        ("check", "curl_4_3", *MESH, "--pin", "--stay", "--yes", *OUT),
        ("check", "own pins.toml", "--all", *OUT),
    ],
    "battery": [
        ("battery", "functions/rounded", "--long", "--fresh", *PLACE),
        ("battery", "functions", "--list", *PLACE),
    ],
    "suite": [
        ("suite", "run", "elastica_arch", "--runner", "ours", "--fast", "--seconds", "20", *PLACE),
        ("suite", "run", "arch", "--hidden", "3", *PLACE),
    ],
}  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Where all the lines run: the folder of results is shared, so a shell is solved once."""
    place = tmp_path_factory.mktemp("again")
    (place / "own pins.toml").write_text(PINS)
    (place / "own points.csv").write_text(POINTS)
    (place / "own part").mkdir()
    sweep = load_sweep("cantilever", {"model.elements": 4}, [parse_axis("strip.gamma=1,3")])
    claimed(place / "own part", sweep, Shard(1, 2), fresh=True)  # begun, and nothing finished
    return place


def parser_of(command: str) -> Parser:
    parser = Parser()
    commands.module(command).register(parser)
    return parser


def asked(line: str) -> dict:
    """What the command line asks for, by the command's own parser."""
    program, command, *words = shlex.split(line)
    assert program == "ribbonbench"
    return {"command": command, **vars(parser_of(command).parse_args(words))}


def test_the_lines_set_every_option_of_every_command():
    assert set(LINES) == set(commands.NAMES) - WITHOUT
    for command, lines in LINES.items():
        parser = parser_of(command)
        found = [vars(parser.parse_args(line[1:])) for line in lines]
        for action in parser._actions:
            if action.dest != "help":
                assert any(one[action.dest] != action.default for one in found), f"{command}: {action.dest}"


@pytest.mark.shell
@pytest.mark.parametrize("line", [pytest.param(line, id=line[0]) for lines in LINES.values() for line in lines])
def test_every_page_names_the_line_that_was_typed(line, folder, monkeypatch):
    pytest.importorskip("dolfinx")
    monkeypatch.chdir(folder)
    monkeypatch.setattr(cost_bench, "seconds_of_first", lambda *_, **__: 1.0)  # of minutes of compiling
    assert cli.main(line) in (cli.DONE, cli.NOT_CONVERGED)
    page = read_page(folder / "some where")
    assert page.command == line[0]
    assert asked(page.again) == asked(shlex.join(["ribbonbench", *line]))


def test_the_line_of_limits_gives_the_same_verdicts(tmp_path, monkeypatch):
    """Thresholds are part of what was asked: with the usual ones the level is another."""
    monkeypatch.chdir(tmp_path)
    line = ["limits", "limits_7_3", "--quick", "--clamp", "edge", "--distance", "9", "--share", "9"]
    assert cli.main([*line[:5], "--out", "usual"]) == cli.DONE
    assert cli.main(line) == cli.DONE
    usual, first = (read_json(tmp_path / out / "result.json")["rows"] for out in ("usual", "out/limits_7_3/limits"))
    levels = [row["level"] for row in first]
    assert levels != [row["level"] for row in usual]
    page = read_page(tmp_path / "out" / "limits_7_3" / "limits")
    (tmp_path / "out" / "limits_7_3" / "limits" / "result.json").unlink()
    assert cli.main(shlex.split(page.again)[1:]) == cli.DONE
    assert [
        row["level"] for row in read_json(tmp_path / "out" / "limits_7_3" / "limits" / "result.json")["rows"]
    ] == levels


@pytest.mark.parametrize("typed", ["{here}/scenes/mine one.toml", "../beside.toml"])
def test_a_scene_file_is_found_again_from_the_same_folder(typed, tmp_path, monkeypatch):
    here = tmp_path / "here"
    text = load("cantilever").replace({"model.energy": "elastica"}).to_toml()
    (here / "scenes").mkdir(parents=True)
    (here / "scenes" / "mine one.toml").write_text(text)
    (tmp_path / "beside.toml").write_text(text)
    monkeypatch.chdir(here)
    assert cli.main(["solve", typed.format(here=here), f"--out={here}/o", "--quiet"]) == cli.DONE
    page = read_page(here / "o")
    assert str(tmp_path) not in page.again
    first = read_json(here / "o" / "result.json")["energy"]
    (here / "o" / "result.json").unlink()
    assert cli.main(shlex.split(page.again)[1:]) == cli.DONE
    assert read_json(here / "o" / "result.json")["energy"] == first


def test_results_are_exported_again_from_their_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["solve", "coil_10_100", "--set", "model.elements=4", "--quiet"]) == cli.DONE
    assert cli.main(["export", "out/coil_10_100/solve", "--format", "obj", "--quiet"]) == cli.DONE
    page = read_page(tmp_path / "out" / "coil_10_100" / "solve" / "export")
    assert cli.main(shlex.split(page.again)[1:]) == cli.DONE


def test_absolute_paths_leave_no_machine_in_the_line(tmp_path, monkeypatch):
    here = tmp_path / "here"
    here.mkdir()
    (tmp_path / "link").symlink_to(here)
    monkeypatch.chdir(here)
    assert recorded(["solve", f"{here}/a b.toml"]) == "ribbonbench solve 'a b.toml'"
    assert recorded(["solve", f"{tmp_path}/link/a.toml", f"--out={tmp_path}"]) == "ribbonbench solve a.toml --out=.."
    assert recorded(["solve", f"{tmp_path}/b/a.toml"]) == "ribbonbench solve ../b/a.toml"
    assert recorded(["solve", "/no-such-folder/a.toml"]) == "ribbonbench solve a.toml"
    assert recorded(["solve", "../a.toml", "--out", "o", "--set", "x=/y"]) == (
        "ribbonbench solve ../a.toml --out o --set x=/y"
    )
    assert recorded(["export", str(Path("/"))]) == "ribbonbench export /"


def test_a_page_made_through_python_says_so():
    """Its scene may be none that a command could find, so no line is made up."""
    assert Page("compare", "T").again == ""
    part = Part(Path("x"), "x", Page("compare", "T"), {}, (), {})
    assert THROUGH_PYTHON in report_markdown.document([part], [""], "s.png")
    assert THROUGH_PYTHON in report_html.document([part], [None], [None])
