"""The doctor: everything here is seen, and whatever is absent, broken, crashing or hanging is a row with its remedy."""

from __future__ import annotations

import io
import json
from pathlib import Path

import pytest
from rich.console import Console

from compare.commands.installed import doctor
from compare.commands.installed import probes as doctor_probes

PARTS = {
    "Python",
    "numpy",
    "scipy",
    "numba",
    "scikit-fem",
    "meshio",
    "matplotlib",
    "cyipopt",
    "Ipopt",
    "Ipopt's linear solver",
    "Ipopt's BLAS, LAPACK",
    "dolfinx",
    "PETSc",
    "PETSc's linear solver",
    "PETSc's BLAS, LAPACK",
    "SLEPc",
    "MPI",
    "pyvista, VTK",
    "off-screen pictures",
    "C compiler",
    "cores",
    "cache of compiled forms",
    "cache of compiled kernels",
    "store of finished shells",
}


@pytest.fixture(scope="module")
def here() -> doctor.Diagnosis:
    return doctor.diagnose()


def test_a_machine_after_make_setup_lacks_nothing(here):
    assert here.missing == ()
    assert here.exit_code == 0
    assert {row.name for row in here.rows} == PARTS


def test_both_linear_algebras_are_named(here):
    rows = {row.name: row.what for row in here.rows}
    assert "MUMPS (sequential: libdmumps_seq" in rows["Ipopt's linear solver"]
    assert "MUMPS (libdmumps" in rows["PETSc's linear solver"]
    for name in ("Ipopt's BLAS, LAPACK", "PETSc's BLAS, LAPACK"):
        assert "blas" in rows[name].lower()
        assert "none" not in rows[name]


@pytest.mark.parametrize(
    ("libraries", "expected"),
    [
        (["/usr/lib/x/blas/libblas.so.3.11.0", "/usr/lib/libc.so.6"], "reference libblas.so.3.11.0"),
        (["/usr/lib/x/openblas-pthread/libblas.so.3"], "OpenBLAS libblas.so.3"),
        (["/usr/lib/x/libopenblasp-r0.so"], "OpenBLAS libopenblasp-r0.so"),
        (["/v/site-packages/numpy.libs/libopenblas64_.so"], "none found among the loaded libraries"),
    ],
)
def test_linear_algebra_is_told_from_the_loaded_libraries(libraries, expected):
    assert doctor_probes.linear_algebra([Path(name) for name in libraries]) == expected


def _pretend(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, module: str, body: str) -> None:
    """Puts a module of this body before the real one of the same name, for the probes alone."""
    package = tmp_path / module
    package.mkdir()
    (package / "__init__.py").write_text(body)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))


def looked_at(probe: str) -> list[doctor.Row]:
    """The rows of one probe."""
    (rows,) = doctor._look([probe])
    return rows


ABSENT = "raise ModuleNotFoundError('No module named x')"


@pytest.mark.parametrize(
    ("probe", "module", "row", "remedy"),
    [
        ("dolfinx", "dolfinx", "dolfinx", "python3-dolfinx"),
        ("dolfinx", "slepc4py", "SLEPc", "python3-slepc4py"),
        ("ipopt", "cyipopt", "cyipopt", "coinor-libipopt-dev"),
        ("pictures", "pyvista", "pyvista, VTK", "make setup"),
        ("python", "skfem", "scikit-fem", "make setup"),
    ],
)
def test_what_is_absent_is_named_with_its_remedy(tmp_path, monkeypatch, probe, module, row, remedy):
    _pretend(tmp_path, monkeypatch, module, ABSENT)
    rows = {entry.name: entry for entry in looked_at(probe)}
    assert not rows[row].ok
    assert rows[row].what == "not installed"
    assert remedy in rows[row].remedy


def test_the_rest_of_a_probe_is_still_seen(tmp_path, monkeypatch):
    _pretend(tmp_path, monkeypatch, "dolfinx", ABSENT)
    rows = {entry.name: entry.ok for entry in looked_at("dolfinx")}
    assert rows["dolfinx"] is False
    assert rows["PETSc"] is True


def test_a_library_that_crashes_is_a_row(tmp_path, monkeypatch):
    _pretend(tmp_path, monkeypatch, "cyipopt", "import os, signal; os.kill(os.getpid(), signal.SIGKILL)")
    (row,) = looked_at("ipopt")
    assert not row.ok
    assert "crashes (signal 9)" in row.what
    assert "coinor-libipopt-dev" in row.remedy


def test_a_library_that_hangs_is_not_known_and_nothing_is_proposed(tmp_path, monkeypatch):
    """A busy machine looks the same: no remedy, and no exit code of something missing."""
    _pretend(tmp_path, monkeypatch, "cyipopt", "import time; time.sleep(600)")
    monkeypatch.setattr(doctor, "TIMEOUT", 0.2)
    (row,) = looked_at("ipopt")
    assert (row.ok, row.remedy) == (None, "")
    diagnosis = doctor.Diagnosis((doctor.Row("x", "1", True), row))
    assert (diagnosis.ok, diagnosis.missing, diagnosis.unknown) == (False, (), (row,))
    assert diagnosis.exit_code == 1


def test_what_is_known_missing_counts_beside_what_is_too_slow():
    rows = (doctor.Row("a", "not installed", False, "make setup"), doctor.Row("b", "no answer", None))
    assert doctor.Diagnosis(rows).exit_code == 3
    assert doctor.Diagnosis(rows).missing == rows[:1]


def test_a_slow_probe_is_named_while_it_works(tmp_path, monkeypatch):
    """Whoever waits sees for what; the probe ends when its rows are there, however long that takes."""
    gate = tmp_path / "gate"
    body = f"import os, time\nwhile not os.path.exists({str(gate)!r}): time.sleep(0.01)\n__version__ = '0'"
    _pretend(tmp_path, monkeypatch, "mpi4py", body)
    monkeypatch.setattr(doctor, "SLOW", 0.01)
    said = []

    def say(words):
        said.append(words)
        if len(said) == 3:
            gate.touch()

    (rows,) = doctor._look(["dolfinx"], say)
    assert len(said) >= 3
    assert all("dolfinx" in words for words in said)
    assert all(row.ok is not None for row in rows)


def lines_of(*rows: dict) -> str:
    """What a probe has printed when it has found these rows, the last line torn."""
    return "".join(f"\n{doctor_probes.MARK}{json.dumps([row])}\n" for row in rows) + doctor_probes.MARK + '[{"name": '


@pytest.mark.parametrize(
    ("trouble", "ok", "remedy"), [(None, None, ""), ("crashes (signal 11)", False, "apt-get install libegl1")]
)
def test_what_was_begun_is_slow_or_has_crashed(trouble, ok, remedy):
    there = doctor_probes.row("pyvista, VTK", "0.44, 9.4")
    begun = doctor_probes.begun("off-screen pictures", "apt-get install libegl1")
    rows = doctor._rows("pictures", lines_of(there, begun), trouble)
    assert [(row.name, row.ok) for row in rows] == [("pyvista, VTK", True), ("off-screen pictures", ok)]
    assert rows[1].remedy == remedy
    ended = doctor._rows("pictures", lines_of(there, begun, doctor_probes.row("off-screen pictures", "EGL")), "")
    assert [(row.name, row.ok) for row in ended] == [("pyvista, VTK", True), ("off-screen pictures", True)]


def test_rows_found_before_the_time_was_out_are_kept():
    there, absent = doctor_probes.row("numpy", "1.26"), doctor_probes.row("scipy", "not installed", False, "make setup")
    rows = {row.name: row for row in doctor._rows("python", lines_of(there, absent), None)}
    assert [row.ok for row in rows.values()] == [True, False, None]
    assert rows["scipy"].remedy == "make setup"
    assert rows["Python packages"].remedy == ""


def test_vtk_that_crashes_while_it_renders_is_a_row(tmp_path, monkeypatch):
    body = "import os, signal\n__version__ = '0'\ndef Plotter(**_): os.kill(os.getpid(), signal.SIGSEGV)\n"
    _pretend(tmp_path, monkeypatch, "pyvista", body)
    rows = {entry.name: entry for entry in looked_at("pictures")}
    assert not rows["off-screen pictures"].ok
    assert "libegl1" in rows["off-screen pictures"].remedy


def test_a_compiler_that_is_absent_or_fails(monkeypatch):
    for command in ("no-such-compiler", "false"):
        monkeypatch.setenv("CC", command)
        (row,) = looked_at("compiler")
        assert not row.ok
        assert "gcc" in row.remedy


def test_a_cache_that_cannot_be_written(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("RIBBONBENCH_CACHE", str(tmp_path / "file" / "cache"))
    rows = {row.name: row for row in doctor._caches()}
    assert not rows["cache of compiled forms"].ok
    assert "RIBBONBENCH_CACHE" in rows["cache of compiled forms"].remedy


ILL = doctor.Diagnosis((doctor.Row("a [b]", "1.0", True), doctor.Row("dolfinx", "not installed", False, "apt-get [x]")))


@pytest.mark.parametrize("markup", [True, False])
def test_the_report_and_its_exit_code(monkeypatch, markup):
    monkeypatch.setattr(doctor, "diagnose", lambda say: ILL)
    text = io.StringIO()
    assert doctor.main(Console(file=text, width=100, markup=markup)) == 3
    assert "a [b]" in text.getvalue()
    assert "dolfinx: not installed; mend it with:\n    apt-get [x]\n" in text.getvalue()
    assert "[green]" not in text.getvalue()


def test_json_is_the_same_in_machine_form(monkeypatch, capsys):
    monkeypatch.setattr(doctor, "diagnose", lambda say: ILL)
    assert doctor.main(Console(), as_json=True) == 3
    seen = json.loads(capsys.readouterr().out)
    assert seen["ok"] is False
    assert seen["rows"][1] == {
        "name": "dolfinx",
        "what": "not installed",
        "ok": False,
        "remedy": "apt-get [x]",
        "without": "",
    }


def test_slow_is_said_without_a_remedy(monkeypatch, capsys):
    slow = doctor.Diagnosis((doctor.Row("numpy", "1.26", True), doctor.Row("dolfinx", "no answer within 3 s", None)))
    monkeypatch.setattr(doctor, "diagnose", lambda say: slow)
    text = io.StringIO()
    assert doctor.main(Console(file=text, width=100)) == 1
    assert "dolfinx: no answer within 3 s" in text.getvalue()
    assert "mend" not in text.getvalue()
    assert doctor.main(Console(), as_json=True) == 1
    assert [row["ok"] for row in json.loads(capsys.readouterr().out)["rows"]] == [True, None]


def test_an_interrupted_look_leaves_no_process(tmp_path, monkeypatch):
    _pretend(tmp_path, monkeypatch, "cyipopt", "import time; time.sleep(600)")
    monkeypatch.setattr(doctor, "SLOW", 0.0)
    begun = []
    start = doctor.subprocess.Popen
    monkeypatch.setattr(doctor.subprocess, "Popen", lambda *a, **k: begun.append(start(*a, **k)) or begun[-1])

    def interrupt(words):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        doctor._look(["ipopt"], interrupt)
    assert [process.returncode for process in begun] == [-9]


def test_a_machine_without_the_shell_is_in_order(tmp_path, monkeypatch, capsys):
    """Exit code 0; what the shell would need is listed, once. A dolfinx that is there and broken is a fault."""
    _pretend(tmp_path, monkeypatch, "dolfinx", ABSENT)
    rows = tuple(looked_at("dolfinx"))
    diagnosis = doctor.Diagnosis((doctor.Row("numpy", "2", True), *rows))
    assert diagnosis.exit_code == 0
    assert [row.name for row in diagnosis.left_out["the shell"]] == ["dolfinx"]
    monkeypatch.setattr(doctor, "diagnose", lambda say: diagnosis)
    assert doctor.main(Console(width=200)) == 0
    said = capsys.readouterr().out
    assert said.count("python3-dolfinx") == 1
    assert "conda-forge" in said
    (tmp_path / "dolfinx" / "__init__.py").write_text("raise ImportError('half an installation')")
    assert doctor.Diagnosis(tuple(looked_at("dolfinx"))).exit_code == 3


def test_a_cyipopt_of_another_numpy_is_built_anew(tmp_path, monkeypatch):
    """What mends it is another build of that package, whatever else is installed."""
    for k, body in enumerate((
        "raise ImportError('numpy.core.multiarray failed to import')",
        "raise ValueError('numpy.dtype size changed, may indicate binary incompatibility')",
    )):  # fmt: skip
        (tmp_path / str(k)).mkdir()
        _pretend(tmp_path / str(k), monkeypatch, "cyipopt", body)
        (row,) = looked_at("ipopt")
        assert not row.ok
        assert row.remedy.startswith("pip install --force-reinstall --no-cache-dir --no-binary cyipopt cyipopt")


@pytest.mark.parametrize("variable", [None, "RIBBONBENCH_STORE", "RIBBONBENCH_CACHE"])
def test_the_store_that_is_counted_is_the_one_that_is_emptied(tmp_path, monkeypatch, variable):
    from compare.commands.doctor import _clean
    from compare.store.shared import shared_store

    for name in ("RIBBONBENCH_STORE", "RIBBONBENCH_CACHE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    if variable is not None:
        monkeypatch.setenv(variable, str(tmp_path / "own"))
    shared_store(tmp_path / "out").put("a" * 64, lambda folder: (folder / "x").write_text("1"))
    assert doctor._store().what.startswith("1 shells")
    console = Console(file=io.StringIO(), width=500)
    _clean(console)
    assert "Removed 1 finished shells" in console.file.getvalue()
    assert doctor._store().what.startswith("0 shells")
