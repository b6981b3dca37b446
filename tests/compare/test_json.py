"""--json: the standard output is result.json and nothing else; words of progress and errors go to the error output."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from compare import commands
from compare.cli import BAD_INPUT, DONE, NOT_CONVERGED, main
from compare.scene.inputs.source import shipped_strips
from compare.scene.scene import shipped
from compare.studies import cost_bench
from tests.compare.scene import held_scenes

SMALL = ("--set", "model.elements=4")
MESH = ("--set", "shell.elements=[8,1]", "--set", "shell.width_to_thickness=[20]")
#: Cheap lines of every command that writes result.json.
LINES = [
    ("solve", "coil_10_100", *SMALL),
    ("limits", "limits_7_3", "--quick", "--clamp", "edge", *SMALL),
    ("explain", "coil_10_100", "--no-run", *SMALL),
    ("export", "coil_10_100", "--format", "obj", *SMALL),
    ("sweep", "cantilever", "--vary", "strip.gamma=1,3", "--solver", "ribbon", "--workers", "1", *SMALL),
    ("cost", "cantilever", "--solvers", "chained", "--segments", "2", "3", "--reference", "own", "--repeats", "1"),
]
SHELLS = [
    ("shell", "cantilever", *MESH),
    ("compare", "cantilever", *MESH),
    ("converge", "cantilever", "--elements", "8", "1", "--width-to-thickness", "10", "20"),
    ("check", "cantilever", *MESH, "--distance", "0.9"),
]


def run(capsys, *arguments):
    code = main([str(a) for a in arguments])
    said = capsys.readouterr()
    return code, said.out, said.err


def held(capsys, line, tmp_path):
    code, out, err = run(capsys, *line, "--json", "--out", tmp_path / "o")
    assert code in (DONE, NOT_CONVERGED), err
    stored = json.loads((tmp_path / "o" / "result.json").read_text())
    assert json.loads(out) == stored
    assert {"text", "grade", "checks"} == stored["answer"].keys()
    return code, stored, err


@pytest.mark.parametrize("line", LINES, ids=lambda line: line[0])
def test_the_output_is_the_result(line, capsys, tmp_path, monkeypatch):
    monkeypatch.setattr(cost_bench, "seconds_of_first", lambda *_, **__: 1.0)
    assert held(capsys, line, tmp_path)[0] == DONE


def test_the_output_of_a_fit(capsys, tmp_path):
    points = tmp_path / "points.csv"
    points.write_text("x,y,z\n0.0,-0.272695,0.397485\n0.0,-0.7002,0.656354\n")
    line = ("identify", "cantilever", points, "--free", "strip.gamma", "--set", "model.elements=6")
    assert held(capsys, line, tmp_path)[0] == DONE


@pytest.mark.shell
@pytest.mark.parametrize("line", SHELLS, ids=lambda line: line[0])
def test_the_output_of_commands_with_shells(line, capsys, tmp_path, kept_shells):
    pytest.importorskip("dolfinx")
    held(capsys, line, tmp_path)


def test_progress_is_told_elsewhere_and_quiet_tells_none(capsys, tmp_path):
    _, _, err = held(capsys, LINES[0], tmp_path)
    assert "ribbon" in err
    code, out, err = run(capsys, *LINES[0], "--json", "--quiet", "--out", tmp_path)
    assert (code, err) == (DONE, "")
    assert json.loads(out)["status"] == "converged"


def test_explain_without_a_folder(capsys):
    code, out, _ = run(capsys, *LINES[2], "--json")
    assert code == DONE
    assert json.loads(out)["explanation"]["effects"]


def test_exit_codes_and_errors_stay(capsys, tmp_path):
    code, out, err = run(capsys, "solve", "no_such_scene", "--json")
    assert (code, out) == (BAD_INPUT, "")
    assert err.count("\n") == 1
    path = tmp_path / "edge.toml"
    path.write_text(held_scenes.ON_EDGE)
    code, stored, _ = held(capsys, ("solve", path, "--stay"), tmp_path)
    assert (code, stored["stable"]) == (NOT_CONVERGED, False)


def test_lists_are_records(capsys, tmp_path):
    code, out, _ = run(capsys, "scenes", "--json")
    assert code == DONE
    assert [record["name"] for record in json.loads(out)] == [*shipped(), *shipped_strips()]
    assert "[strip]" in json.loads(run(capsys, "scenes", "cantilever", "--json")[1])["scene"]
    records = json.loads(run(capsys, "keys", "--json")[1])
    assert len(records) >= 30
    made = json.loads(run(capsys, "new", tmp_path / "my.toml", "--json")[1])
    assert Path(made["file"]).read_text() == made["scene"]


def test_report_names_its_files(capsys, tmp_path):
    run(capsys, *LINES[0], "--quiet", "--out", tmp_path / "o")
    found = json.loads(run(capsys, "report", tmp_path / "o", "--json")[1])
    assert found["results"] == 1
    assert Path(found["html"]).stat().st_size > 1000


def test_every_command_has_the_option():
    import argparse

    for name in set(commands.NAMES) - {"completion", "live"}:  # a script, and a page: no answers
        parser = argparse.ArgumentParser()
        commands.module(name).register(parser)
        assert any("--json" in action.option_strings for action in parser._actions), name
