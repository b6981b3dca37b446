"""A grid of cantilevers as a table in parts: cost of a case in workers, master and writers, memory, kills, shards, MPI,
a query, and what 64 cores and 1e9 cases would take by the measured parts (results/million.md)."""

from __future__ import annotations

import functools
import importlib.util
import json
import math
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from compare.studies.axes import Grid, parse_axis
from compare.sweep.file import Sweep, load_sweep
from compare.sweep.journal import value_in
from compare.sweep.large import parts
from compare.sweep.large.stretch import Stretch, given
from compare.sweep.shard import Shard
from tests.validation import page
from tests.validation.number import Number

#: Points along the two axes, rows of a part, kills.
SIDES, ROWS, KILLS = (1000, 1000), parts.ROWS, 10
#: Of the grid in shards and by MPI, and how many shards.
SMALL, SMALL_ROWS, SHARDS = (200, 100), 4000, 4
SEGMENTS = 40
_TIME = "time of one run"
_ENVIRONMENT = {
    **os.environ, "OMP_NUM_THREADS": "1", "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
}  # fmt: skip
_DRIVER = """
import json, resource, sys, time
from pathlib import Path
from compare.store.progress import Reporter
from ribbonbench.world import pooled
from compare.sweep.large import parts, stream
from compare.sweep.shard import Shard
from compare.sweep.workers import ClusterCrew, LocalCrew
from tests.validation.workbench.million import swept
compact = parts.compact
def timed(folder, block, layout):
    began = time.process_time()
    compact(folder, block, layout)
    with (folder / "written.txt").open("a") as stream:
        stream.write(f"{time.process_time() - began}\\n")
def main(out, shard, rows, sides):
    parts.compact = timed
    sweep = swept(*json.loads(sides))
    if pooled():
        from mpi4py.futures import MPIPoolExecutor
        executor = MPIPoolExecutor()
        crew = ClusterCrew(executor, 2)
    else:
        crew = LocalCrew(2)
    out.mkdir(parents=True, exist_ok=True)
    began = time.process_time()
    with Reporter(quiet=True) as reporter:
        end = stream.run(sweep, stream.grid_of(sweep), Shard.parse(shard), out, crew, reporter, rows=int(rows))
    own, others = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    print(json.dumps({
        "cases": end.cases, "new": end.new, "wall": end.seconds, "master": time.process_time() - began,
        "others": others.ru_utime + others.ru_stime,
        "master_mb": own.ru_maxrss / 1e3, "most_mb": others.ru_maxrss / 1e3,
    }))
if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:])
"""
_QUERY = """
import sys, time
import pyarrow as pa
from pyarrow import dataset
pa.set_cpu_count(1)
began = time.perf_counter()
table = dataset.dataset(sys.argv[1]).to_table(
    columns=["strip.gamma", "energy.total"], filter=dataset.field("stable"), use_threads=False)
means = table.group_by("strip.gamma", use_threads=False).aggregate([("energy.total", "mean")])
print(time.perf_counter() - began, means.num_rows)
"""


def absent() -> str | None:
    """What is not here."""
    lacking = [name for name in ("pyarrow", "mpi4py") if importlib.util.find_spec(name) is None]
    return f"no {lacking[0]}" if lacking else None


def swept(heavy: int, curled: int) -> Sweep:
    """Cantilevers that lean, of so many weights and curls."""
    axes = [parse_axis(f"strip.gamma=log(1,1000,{heavy})"), parse_axis(f"strip.natural_curvature=-2:2:{curled}")]
    return load_sweep("cantilever", {"model.elements": SEGMENTS, "gravity.up": [0.6, 0.0, 0.8]}, axes)


@functools.cache
def few() -> tuple[int, float]:
    """Of 64 cases on the way of a worker: how many are stable, and the sum of their energies."""
    sweep = swept(*SIDES)
    job = Stretch(0, tuple(range(5000, 5064)), given(sweep, Grid(sweep.scene, sweep.axes)), tempfile.gettempdir())
    columns = value_in(job.work().line.rstrip(b"\n"))["columns"]
    return sum(columns["stable"]), math.fsum(columns["energy.total"])


PROBES = {"stable_of_few": lambda: few()[0], "energy_of_few": lambda: few()[1]}


def _start(
    out: Path, shard: str = "1/1", before: tuple[str, ...] = (), sides: tuple[int, int] = SMALL, rows: int = SMALL_ROWS
) -> Any:
    script = out.parent / "driver.py"
    script.write_text(_DRIVER, encoding="utf-8")
    environment = {**_ENVIRONMENT, "PYTHONPATH": os.pathsep.join([os.getcwd(), os.environ.get("PYTHONPATH", "")])}
    arguments = [str(script), str(out), shard, str(rows), json.dumps(sides)]
    return subprocess.Popen(
        [*before[:4], sys.executable, *before[4:], *arguments], env=environment, stdout=subprocess.PIPE, text=True
    )


def _run(*arguments: Any, **more: Any) -> dict[str, Any]:
    process = _start(*arguments, **more)
    said, _ = process.communicate()
    if process.returncode:
        raise RuntimeError(f"a run ended with code {process.returncode}")
    return json.loads(said.splitlines()[-1])  # type: ignore[no-any-return]


def _bytes(out: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in (out / "table").glob("*.parquet")}


def _kept(out: Path) -> int:
    sizes = 0
    for path in [*out.glob("journal/*"), *out.glob("table/part*")]:
        try:
            sizes += path.stat().st_size
        except FileNotFoundError:
            continue
    return sizes


def _killed(out: Path, pause: float) -> tuple[int, int]:
    """Kills a run at random moments, at most `pause` (s) after it has made something; how many kills, and how many
    cases the last run still had to make."""
    rng = random.Random(32)
    kills = 0
    while kills < KILLS:
        before = _kept(out)
        process = _start(out, sides=SIDES, rows=ROWS)
        while _kept(out) == before and process.poll() is None:
            time.sleep(0.01)
        time.sleep(rng.uniform(0.0, pause))
        if process.poll() is None:
            kills += 1
        elif _kept(out) == before:
            break  # it had ended before
        process.send_signal(signal.SIGKILL)
        process.communicate()
    return kills, _run(out, sides=SIDES, rows=ROWS)["new"]


def _walk() -> float:
    """Time (s) of asking of one case whether a shard has it."""
    from compare.sweep.large import stream

    sweep = swept(*SIDES)
    grid, shard = Grid(sweep.scene, sweep.axes), Shard(3, 64)
    began = time.process_time()
    sum(1 for _ in stream.cases_of(sweep, grid, shard))
    return (time.process_time() - began) / len(grid)


def run(folder: Path) -> dict[str, Number]:
    """Writes million.md into the folder."""
    top = Path(tempfile.mkdtemp(prefix="million-"))
    try:
        return _measured(folder, top)
    finally:
        shutil.rmtree(top)


def _measured(folder: Path, top: Path) -> dict[str, Number]:
    from compare.store.progress import Reporter
    from compare.sweep.large import stream
    from compare.sweep.shard import identity_of

    count = SIDES[0] * SIDES[1]
    small = _run(top / "small")
    small_bytes = _bytes(top / "small")
    one = _run(top / "one", sides=SIDES, rows=ROWS)
    whole = _bytes(top / "one")
    writing = sum(map(float, (top / "one" / "written.txt").read_text().split())) / count
    master, worker = one["master"] / count, one["others"] / count - writing
    kills, left = _killed(top / "killed", 1.2 * one["wall"] / KILLS)
    shards = [top / f"part{k}" for k in range(1, SHARDS + 1)]
    sizes = [_run(out, f"{k}/{SHARDS}")["cases"] for k, out in enumerate(shards, start=1)]
    sweep = swept(*SMALL)
    known = [(out, identity_of(out, "--join")) for out in shards]
    (top / "joined").mkdir()
    with Reporter(quiet=True) as reporter:
        grid = stream.grid_of(sweep)
        stream.joined(sweep, grid, top / "joined", [(o, i) for o, i in known if i], reporter, rows=SMALL_ROWS)
    _run(top / "mpi", before=("mpiexec", "--oversubscribe", "-n", "3", "-m", "mpi4py.futures"))
    same = {"killed": _bytes(top / "killed") == whole}
    same |= {name: _bytes(top / name) == small_bytes for name in ("joined", "mpi")}
    done = subprocess.run(
        [sys.executable, "-c", _QUERY, str(top / "one" / "table")], capture_output=True, text=True, check=True
    )
    query = float(done.stdout.split()[0])
    size = sum(map(len, whole.values()))
    walk = _walk()
    stable, energy = few()
    rate = min(63.0 / worker, 1.0 / master, 1.0 / writing)
    shard = (1e9 / 64.0 * (worker + master + writing) + 1e9 * walk) / 3600.0
    numbers = {
        "cases": Number(count, 0, shown="d"),
        "cpu": Number(1e3 * (one["others"] + one["master"]) / count, None, "ms", ".2f", why=_TIME),
        "worker": Number(1e3 * worker, None, "ms", ".2f", why=_TIME),
        "master": Number(1e6 * master, None, "us", ".0f", why=_TIME),
        "writing": Number(1e6 * writing, None, "us", ".0f", why=_TIME),
        "walk": Number(1e6 * walk, None, "us", ".2f", why=_TIME),
        "wall": Number(one["wall"], None, "s", ".1f", why=_TIME),
        "master_mb": Number(one["master_mb"], None, "MB", ".0f", why="memory of one run"),
        "master_mb_small": Number(small["master_mb"], None, "MB", ".0f", why="memory of one run"),
        "most_mb": Number(one["most_mb"], None, "MB", ".0f", why="memory of one run"),
        "bytes": Number(size / count, 0.5, "bytes", ".0f"),
        "kills": Number(kills, 0, shown="d"),
        "same": Number(sum(same.values()), 0, shown="d"),
        "query": Number(query, None, "s", ".3f", why=_TIME),
        "rate_64": Number(rate, None, "cases/s", ".3g", why="a model of measured parts"),
        "billion_hours": Number(shard, None, "h", ".3g", why="a model of measured parts"),
        "stable_of_few": Number(stable, 0, shown="d"),
        "energy_of_few": Number(energy, 1e-6),
    }
    said = {True: "the same to the byte", False: "not the same"}
    page.write(
        folder / "million.md",
        "Sweeps by the million",
        "OMP_NUM_THREADS=1 python -m tests.validation million",
        f"{count:,} cantilevers of {SEGMENTS} segments ({SIDES[0]} weights, {SIDES[1]} curls), two workers, parts of "
        f"{ROWS:,} rows.",
        page.table(
            ("what", "a case", "of all"),
            [
                ("workers (scene, solve, stability, row, starts)", f"{1e3 * worker:.2f} ms", f"{worker * count:.0f} s"),
                ("the process that hands out", f"{1e6 * master:.0f} us", f"{master * count:.1f} s"),
                ("writing parts, beside it", f"{1e6 * writing:.0f} us", f"{writing * count:.1f} s"),
                ("a case of another shard", f"{1e6 * walk:.2f} us", f"{walk * count:.2f} s"),
                ("table", f"{size / count:.0f} bytes", f"{size / 1e6:.1f} MB"),
            ],
        ),
        f"CPU times; the wall time is {one['wall']:.1f} s. Peak memory: {one['master_mb']:.0f} MB of the process that "
        f"hands out ({small['master_mb']:.0f} MB on {SMALL[0] * SMALL[1]:,} of them), {one['most_mb']:.0f} MB of the "
        "largest of the others.",
        f"The {count:,} killed {kills} times at random moments and gone on with (the last run made {left:,} cases): "
        f"{said[same['killed']]}. Of {SMALL[0] * SMALL[1]:,} cases {SHARDS} shards of "
        f"{', '.join(map(str, sizes))}, joined: {said[same['joined']]}. `mpiexec -n 3 python -m mpi4py.futures`: "
        f"{said[same['mpi']]}.",
        f"A query over the whole (mean energy of stable states by weight, one thread): {1e3 * query:.0f} ms; a million "
        f"at the same rate {query * 1e6 / count:.2f} s.",
        f"By these parts 64 cores in one run (63 workers) make {rate:,.0f} cases a second, held by "
        f"{'the workers' if rate < 1.0 / max(master, writing) else 'the process that hands out or writes'}; 64 shards "
        f"of 1e9 cases take {shard:.1f} h each, {1e9 * walk / 3600.0:.1f} h of them to walk over the cases of the "
        f"others, and {1e9 * size / count / 1e12:.2f} TB. Not measured: a file system that many share.",
    )
    return numbers
