"""pandas, polars and DuckDB read the table of a sweep that is in parts: the numbers, and the units in its metadata.

They stand apart from what the tests run with (`.ci/readers.lock`, which `make validate` brings into .venv/readers).
"""

from __future__ import annotations

import importlib.util
import json
import math
import os
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import pytest

from tests.compare.sweep.test_large import ENVIRONMENT, READ, needs_arrow, run_in
from tests.patience import PATIENCE
from tests.test_setup import ROOT

pytestmark = [needs_arrow, pytest.mark.validate]
OWN = Path(sys.prefix) / "readers"
#: A steel ruler, as heavy as it is, in ten directions and on six to fifteen elements; no number of it is varied.
SCENE = """
title = "A ruler"
[strip]
length = 0.30
width = 0.01
thickness = 1e-4
poisson = 0.3
young = 210e9
density = 7850.0
[gravity]
up = [0.0, 1.0, 0.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [0.0, 0.0, 1.0]
normal = [0.0, 1.0, 0.0]
"""
ELEMENTS = tuple(range(6, 16))
#: The sweep in parts of 15 rows.
PARTS = """
import sys
from pathlib import Path
from compare.store.progress import Reporter
from compare.sweep.file import load_sweep
from compare.sweep.large import stream
from compare.sweep.shard import Shard
from compare.sweep.workers import LocalCrew
if __name__ == "__main__":
    out = Path(sys.argv[1])
    sweep = load_sweep(str(out / "rulers.toml"), {}, ())
    with Reporter(quiet=True) as reporter:
        stream.run(sweep, stream.grid_of(sweep), Shard(), out / "o", LocalCrew(1), reporter, rows=15)
"""
#: What each program makes of the folder argv[1]: rows, the mean energy of the stable states for each number of
#: elements, in that order, and what the schema's metadata says of units, by the program's own means.
CODE = {
    "pandas": """
import pandas, pyarrow.parquet
frame = pandas.read_parquet(folder)
rows = len(frame)
means = frame[frame["stable"]].groupby("model.elements")["energy.total"].mean().sort_index().tolist()
units = json.loads(pyarrow.parquet.read_schema(first).metadata[b"units"])
""",
    "polars": """
import polars
table = polars.scan_parquet(folder + "/*.parquet")
rows = table.select(polars.len()).collect().item()
groups = table.filter(polars.col("stable")).group_by("model.elements").agg(polars.col("energy.total").mean())
means = groups.sort("model.elements").collect()["energy.total"].to_list()
units = json.loads(polars.read_parquet_metadata(first)["units"])
""",
    "duckdb": """
import duckdb
duckdb.sql("set threads to 1")
files = f"'{folder}/*.parquet'"
rows = duckdb.sql(f"select count(*) from {files}").fetchall()[0][0]
means = duckdb.sql(
    f'select avg("energy.total") from {files} where stable group by "model.elements" order by "model.elements"'
).fetchall()
means = [mean for (mean,) in means]
units = duckdb.sql(f"select value from parquet_kv_metadata('{first}') where key = 'units'").fetchall()[0][0]
units = json.loads(bytes(units).decode())
""",
}
HEAD = """
import glob, json, sys
folder = sys.argv[1]
first = sorted(glob.glob(folder + "/*.parquet"))[0]
"""
TAIL = "print(json.dumps({'rows': rows, 'means': means, 'units': units}))"


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    """The folder of the table, in six parts."""
    out = tmp_path_factory.mktemp("rulers")
    (out / "ruler.toml").write_text(SCENE)
    turned = [[0.0, math.cos(0.1 * k), math.sin(0.1 * k)] for k in range(10)]
    (out / "rulers.toml").write_text(
        f'title = "Rulers"\nscene = "ruler.toml"\n[[axis]]\nkey = "gravity.up"\nvalues = {turned}\n'
        f'[[axis]]\nkey = "model.elements"\nvalues = {list(ELEMENTS)}\n'
    )
    (out / "run.py").write_text(PARTS)
    environment = {**ENVIRONMENT, "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}
    command = [sys.executable, str(out / "run.py"), str(out)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 0, done.stderr
    assert len(list((out / "o" / "table").glob("*.parquet"))) == 6
    return out / "o" / "table"


def answered(reader: str, table: Path):
    """What the program says of the table."""
    paths = [*([str(OWN)] if OWN.is_dir() else []), os.environ.get("PYTHONPATH", "")]
    done = subprocess.run(
        [sys.executable, "-c", HEAD + CODE[reader] + TAIL, str(table)], capture_output=True, text=True,
        timeout=PATIENCE, check=False, env={**ENVIRONMENT, "PYTHONPATH": os.pathsep.join(paths)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("reader", sorted(CODE))
def test_a_program_reads_the_table(table, reader):
    """A query over all parts is what Python makes of pyarrow's rows; D w in SI is that of the steel."""
    if not (OWN / reader).is_dir() and importlib.util.find_spec(reader) is None:
        pytest.skip(f"no {reader} (make validate brings it)")
    known = json.loads(run_in(READ, table))["rows"]
    energies = defaultdict(list)
    for row in known:
        if row["stable"]:
            energies[row["model.elements"]].append(row["energy.total"])
    found = answered(reader, table)
    assert found["rows"] == len(known) == 100
    assert sorted(energies) == list(ELEMENTS)
    assert found["means"] == pytest.approx([sum(energies[n]) / len(energies[n]) for n in ELEMENTS], rel=1e-12)
    stiffness = 210e9 * 1e-4**3 / (12.0 * (1.0 - 0.3**2)) * 0.01
    assert found["units"]["known"] is True
    assert found["units"]["energy_J"] == pytest.approx(stiffness / 0.30)


def test_units_of_columns_are_in_the_fields(table):
    """As pyarrow, which pandas reads by, has them: for the energy, a force, what was varied."""
    found = json.loads(run_in(READ, table))["units"]
    assert (found["energy.total"], found["force.start.x"], found["model.elements"]) == ("D w / l", "D w / l^2", "")
