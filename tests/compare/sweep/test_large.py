"""Sweeps in parts: shards joined are one run, a killed run ends in the same table, damage is named; pyarrow is loaded
in processes of its own alone."""

from __future__ import annotations

import csv
import importlib.util
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import pytest

from compare.cli import BAD_INPUT, DONE, MISSING, NOT_CONVERGED, main
from compare.studies.axes import Axis, Grid
from compare.sweep.file import load_sweep
from compare.sweep.large.columns import fields_of
from compare.sweep.shard import Shard
from tests.patience import PATIENCE

needs_arrow = pytest.mark.skipif(importlib.util.find_spec("pyarrow") is None, reason="no pyarrow")
needs_mpirun = pytest.mark.skipif(shutil.which("mpirun") is None, reason="no mpirun")
ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1"}
#: Twelve light cantilevers, two of which no stable state is found of.
SWEEP = (
    "sweep", "cantilever", "--vary", "strip.gamma=log(1,300,4)", "--vary", "strip.natural_curvature=0,2.5,5",
    "--set", "model.elements=8", "--set", "gravity.up=[0.0,0.6,0.8]", "--stay", "--workers", "1", "--quiet",
)  # fmt: skip
PARTS = (*SWEEP, "--table", "parquet")


def run_in(code: str, *arguments: object) -> str:
    """What a program prints, in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE,
        env=ENVIRONMENT, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def bytes_of(out: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted((out / "table").glob("*.parquet"))}


def result_of(out: Path):
    return json.loads((out / "result.json").read_text())


@pytest.fixture(scope="module")
def one(tmp_path_factory):
    """The sweep in one run, with its table in a part."""
    out = tmp_path_factory.mktemp("one")
    if importlib.util.find_spec("pyarrow") is not None:
        assert main([*PARTS, "--out", str(out)]) == NOT_CONVERGED
    return out


@pytest.fixture(scope="module")
def shards(tmp_path_factory):
    """The sweep in three parts, in both kinds of table."""
    top = tmp_path_factory.mktemp("shards")
    for number in (1, 2, 3):
        for table in ("csv", "parquet") if importlib.util.find_spec("pyarrow") else ("csv",):
            main([*SWEEP, "--table", table, "--shard", f"{number}/3", "--out", str(top / f"{table}{number}")])
    return top


def test_every_case_is_in_one_shard_whatever_else_is_in_the_grid():
    values = [{"strip.gamma": float(g), "strip.width": 0.01 * w} for g in range(1, 60) for w in range(1, 6)]
    for of in (1, 2, 7, 64):
        assert all(sum(Shard(k, of).takes(v) for k in range(1, of + 1)) == 1 for v in values)
    counts = Counter(next(k for k in range(1, 5) if Shard(k, 4).takes(v)) for v in values)
    assert min(counts.values()) > 50  # of 295
    assert [Shard(1, 2).takes({"strip.gamma": 1.0 + k}) for k in range(6)] == [True, False] * 3  # of SHA-256
    vector = [{"clamp.end.position": [0.0, 0.0, 0.1 * k]} for k in range(20)]
    assert all(sum(Shard(k, 3).takes(v) for k in (1, 2, 3)) == 1 for v in vector)


def test_a_grid_gives_its_points_when_asked():
    from compare.scene.scene import load
    from compare.studies.axes import points

    axes = (Axis.of("strip.gamma", [1.0, 2.0, 3.0]), Axis(("strip.width", "model.elements"), ((0.05, 8), (0.1, 12))))
    grid = Grid(load("cantilever"), axes)
    every = points(grid.scene, axes)
    assert len(grid) == len(every) == 6
    assert [grid.point(k).values for k in range(6)] == [point.values for point in every]
    assert [point.values["strip.gamma"] for point in every] == [1.0, 1.0, 2.0, 2.0, 3.0, 3.0]
    assert [point.values["model.elements"] for point in every] == [8, 12] * 3
    assert grid.point(5).scene == every[5].scene


def test_columns_are_known_before_anything_runs():
    from compare.studies.axes import parse_axis

    axes = [parse_axis("strip.gamma=1,10"), parse_axis('model.energy="wunderlich","sadowsky"')]
    sweep = load_sweep("cantilever", {}, axes)
    fields = {field.key: field for field in fields_of(sweep, Grid(sweep.scene, sweep.axes))}
    kinds = {key: fields[key].kind for key in ("case", "strip.gamma", "model.energy", "stable", "end.x", "iterations")}
    assert list(kinds.values()) == ["integer", "number", "text", "truth", "number", "integer"]
    assert fields["energy.total"].unit == "D w / l"
    assert not {"seconds", "branch"} & set(fields)
    assert fields["warm"].kind == "integer"


READ = """
import json, sys
import pyarrow as pa
from pyarrow import parquet
pa.set_cpu_count(1)
table = parquet.read_table(sys.argv[1], use_threads=False)
print(json.dumps({
    "rows": table.to_pylist(), "units": {f.name: f.metadata[b"unit"].decode() for f in table.schema},
    "head": json.loads(table.schema.metadata[b"ribbonbench"]),
}))
"""


@needs_arrow
def test_the_table_holds_what_the_csv_holds(one, tmp_path):
    assert main([*SWEEP, "--out", str(tmp_path)]) == NOT_CONVERGED
    found = json.loads(run_in(READ, one / "table"))
    with (tmp_path / "cases.csv").open() as stream:
        expected = list(csv.DictReader(stream))
    assert len(found["rows"]) == len(expected) == 12
    for row, known in zip(found["rows"], expected, strict=True):
        for key, text in known.items():
            if key == "seconds":
                continue
            value = row[key]
            if isinstance(value, bool | None):
                assert text == {True: "true", False: "false", None: ""}[value], key
            elif isinstance(value, str):
                assert value == text
            else:
                assert value == float(text), key  # to the last digit
    assert found["units"]["energy.total"] == "D w / l"
    assert found["units"]["force.start.x"] == "D w / l^2"
    assert found["head"]["sweep"] == "cantilever"
    told, csv_told = result_of(one), result_of(tmp_path)
    for key in ("cases", "ok", "statuses", "lowest_eigenvalue", "residual", "iterations", "stable", "complete"):
        assert told[key] == csv_told[key], key
    assert told["statuses"]["saddle"] >= 1
    assert [case["case"] for case in told["failed"]] == [case["case"] for case in csv_told["failed"]]


@needs_arrow
def test_shards_joined_are_one_run_to_the_byte(one, shards, tmp_path):
    folders = [str(shards / f"parquet{k}") for k in (3, 1, 2)]
    assert main([*PARTS, "--join", *folders, "--out", str(tmp_path / "j")]) == NOT_CONVERGED
    assert bytes_of(tmp_path / "j") == bytes_of(one)
    assert sum(result_of(Path(folder))["cases"] for folder in folders) == 12
    assert main([*PARTS, "--join", *folders[:2], "--out", str(tmp_path / "two")]) == NOT_CONVERGED
    told = result_of(tmp_path / "two")
    assert told["missing"] == 12 - sum(result_of(Path(folder))["cases"] for folder in folders[:2])
    # what is missing is made by the same command without --join, and then it is the same table
    assert main([*PARTS, "--out", str(tmp_path / "two")]) == NOT_CONVERGED
    assert result_of(tmp_path / "two")["new"] == told["missing"]
    assert bytes_of(tmp_path / "two") == bytes_of(one)


def test_shards_in_csv_joined_are_one_run(shards, tmp_path):
    folders = [str(shards / f"csv{k}") for k in (1, 2, 3)]
    assert main([*SWEEP, "--out", str(tmp_path / "one")]) == NOT_CONVERGED
    assert main([*SWEEP, "--join", *folders, "--out", str(tmp_path / "j")]) == NOT_CONVERGED
    assert result_of(tmp_path / "j")["new"] == 0
    tables = []
    for out in ("one", "j"):
        with (tmp_path / out / "cases.csv").open() as stream:
            tables.append([{k: v for k, v in row.items() if k != "seconds"} for row in csv.DictReader(stream)])
    assert tables[0] == tables[1]
    assert main([*SWEEP, "--join", *folders[1:], "--out", str(tmp_path / "two")]) == NOT_CONVERGED
    absent = result_of(tmp_path / "two")["statuses"]["absent"]
    assert absent == result_of(Path(folders[0]))["cases"]
    assert main([*SWEEP, "--out", str(tmp_path / "two")]) == NOT_CONVERGED
    assert result_of(tmp_path / "two")["new"] == absent


@pytest.mark.parametrize("table", ["csv", pytest.param("parquet", marks=needs_arrow)])
def test_a_shard_of_another_sweep_is_refused(shards, tmp_path, capsys, table):
    other = [*SWEEP[:-1], "--set", "strip.poisson=0.2", "--quiet", "--table", table]
    cases = [
        ([*other, "--join", str(shards / f"{table}1")], "another sweep"),
        ([*SWEEP, "--table", table, "--join", str(tmp_path)], "no shard"),
        ([*SWEEP, "--table", table, "--join", str(tmp_path / "none")], "no folder"),
        ([*SWEEP, "--table", table, "--join", str(shards / f"{table}1"), str(shards / f"{table}1")], "second time"),
        ([*SWEEP, "--table", table, "--shard", "2/3", "--out", str(shards / f"{table}1")], "part 1/3"),
        ([*SWEEP, "--table", table, "--shard", "0/3"], "--shard"),
        ([*SWEEP, "--table", table, "--shard", "4/3"], "--shard"),
        ([*SWEEP, "--table", table, "--shard", "1/2", "--join", "x"], "one or the other"),
    ]
    for arguments, words in cases:
        more = [] if "--out" in arguments else ["--out", str(tmp_path / "out")]
        assert main([*arguments, *more]) == BAD_INPUT, arguments
        error = capsys.readouterr().err
        assert words in error
        assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()


@needs_arrow
@pytest.mark.parametrize("place", [1, 7])
def test_a_damaged_part_is_named_the_rest_is_read_and_it_is_made_again(one, shards, tmp_path, capsys, place):
    """One bit: among the pages, whose checksums would tell, and in the footer, whose would not."""
    for k in (1, 2, 3):
        shutil.copytree(shards / f"parquet{k}", tmp_path / f"p{k}")
    path = tmp_path / "p2" / "table" / "part-000000.parquet"
    raw = bytearray(path.read_bytes())
    raw[len(raw) * place // 8] ^= 0x10
    path.write_bytes(raw)
    folders = [str(tmp_path / f"p{k}") for k in (1, 2, 3)]
    spoken_of = [word for word in PARTS if word != "--quiet"]
    assert main([*spoken_of, "--join", *folders, "--out", str(tmp_path / "j")]) == NOT_CONVERGED
    spoken = capsys.readouterr()
    assert "p2: part-000000.parquet" in " ".join((spoken.out + spoken.err).split())
    told = result_of(tmp_path / "j")
    assert told["missing"] == result_of(tmp_path / "p2")["cases"]
    assert told["table"]["rows"] == 12 - told["missing"]
    assert not told["complete"]
    path.write_bytes(raw[: len(raw) // 2])  # torn: its end is gone
    assert main([*PARTS, "--shard", "2/3", "--out", folders[1]]) in (DONE, NOT_CONVERGED)
    assert bytes_of(tmp_path / "p2") == bytes_of(shards / "parquet2")


@needs_arrow
def test_a_folder_with_another_sweep_is_left_alone_unless_fresh(one, tmp_path, capsys):
    shutil.copytree(one, tmp_path / "a")
    other = [*PARTS, "--set", "strip.poisson=0.2"]
    assert main([*other, "--out", str(tmp_path / "a")]) == BAD_INPUT
    assert "--fresh" in capsys.readouterr().err
    assert bytes_of(tmp_path / "a") == bytes_of(one)
    main([*other, "--out", str(tmp_path / "a"), "--fresh"])
    assert result_of(tmp_path / "a")["new"] == 12
    assert bytes_of(tmp_path / "a") != bytes_of(one)


def test_without_pyarrow_it_is_one_line(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert main([*PARTS, "--out", str(tmp_path / "out")]) == MISSING
    assert "ribbonbench[table]" in capsys.readouterr().err


#: A sweep in parts of 15 rows.
SMALL_PARTS = """
import sys
from pathlib import Path
from compare.store.progress import Reporter
from compare.studies.axes import parse_axis
from compare.sweep.file import load_sweep
from compare.sweep.large import stream
from compare.sweep.shard import Shard
from compare.sweep.workers import LocalCrew
if __name__ == "__main__":
    out = Path(sys.argv[1])
    out.mkdir(exist_ok=True)
    axes = [parse_axis("strip.gamma=log(1,100,10)"), parse_axis("strip.natural_curvature=0:1:10")]
    sweep = load_sweep("cantilever", {"model.elements": 6}, axes)
    stream.TOGETHER = 7
    with Reporter(quiet=True) as reporter:
        found = stream.run(sweep, stream.grid_of(sweep), Shard(), out, LocalCrew(1), reporter, rows=15)
    print(found.cases, found.new)
"""


def written(out: Path) -> int:
    """Bytes of the journals and the parts."""
    size = 0
    for path in [*out.glob("journal/*"), *out.glob("table/part*"), *out.glob("times/part*")]:
        try:
            size += path.stat().st_size
        except FileNotFoundError:
            continue
    return size


@needs_arrow
def test_killed_at_random_moments_it_ends_in_the_same_table(tmp_path):
    script = tmp_path / "sweep.py"
    script.write_text(SMALL_PARTS)
    command = [sys.executable, str(script)]
    environment = {**ENVIRONMENT, "PYTHONPATH": os.pathsep.join([str(Path.cwd()), os.environ.get("PYTHONPATH", "")])}
    subprocess.run([*command, str(tmp_path / "a")], env=environment, check=True, timeout=PATIENCE, capture_output=True)
    whole = bytes_of(tmp_path / "a")
    assert len(whole) == 6  # 100 cases: five parts of 15 and one of 25
    rng = random.Random(8)
    out = tmp_path / "b"
    for _ in range(2):
        before = written(out)
        process = subprocess.Popen(
            [*command, str(out)], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE
        )
        while written(out) == before and process.poll() is None:  # until something more is kept
            time.sleep(0.002)
        time.sleep(rng.uniform(0.0, 0.4))
        process.send_signal(signal.SIGKILL)
        process.communicate()
    last = subprocess.run([*command, str(out)], env=environment, check=True, timeout=PATIENCE, capture_output=True)
    assert bytes_of(out) == whole
    assert int(last.stdout.split()[0]) == 100
    assert not (out / "journal").exists()


@needs_mpirun
def test_the_pool_of_mpi4py_futures_gives_the_same_cases(tmp_path):
    together = {**ENVIRONMENT, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "TERM": "dumb"}
    small = ("sweep", "cantilever", "--vary", "strip.gamma=1,10,100", "--set", "model.elements=8")
    done = subprocess.run(
        ["mpirun", "--oversubscribe", "-n", "3", sys.executable, "-m", "mpi4py.futures", "-m", "compare.cli", *small,
         "--out", str(tmp_path / "mpi")],
        env=together, capture_output=True, text=True, timeout=PATIENCE, check=False,
    )  # fmt: skip
    assert done.returncode == DONE, done.stderr
    assert "2 at once" in " ".join(done.stderr.split())
    assert main([*small, "--workers", "1", "--quiet", "--out", str(tmp_path / "here")]) == DONE
    rows = []
    for out in ("mpi", "here"):
        with (tmp_path / out / "cases.csv").open() as stream:
            rows.append([(row["case"], row["energy.total"], row["end.y"]) for row in csv.DictReader(stream)])
    assert rows[0] == rows[1]
