"""Every Python, console and TOML block of the documentation runs; every link, picture, command and page exists."""

from __future__ import annotations

import importlib.util
import os
import re
import shlex
import sys
import types
from collections.abc import Callable
from pathlib import Path

import pytest

from compare import __version__, cli
from compare import commands as known
from compare.commands.parser import whole
from compare.scene.scene import loads
from ribbonbench.errors import BadInput
from tests.docs_blocks import DOCS, ROOT, Block, anchors, blocks, commands, links, name_of, pages, prose

PAGES = pages()
RUN = ("python", "console", "toml scene", "toml sweep")
#: What only a machine with dolfinx can run.
SHELL = re.compile(
    r"ribbonbench (shell|compare|limits|converge|check)\b(?!.*--quick)|shellref\.solve\b|assert_agreement"
)

#: A module of the page about additions that others of it import.
MODULE = re.compile(r"# compare/(studies|pages|commands)/\w+\.py\n")


def _runs(page: Path) -> bool:
    return any(block.info in RUN for block in blocks(page.read_text()))


def _python(block: Block, page: Path, names: dict[str, object], at: int) -> None:
    file = Path(f"block_{at}_line_{block.line}.py").resolve()
    file.write_text(block.text)
    exec(compile(block.text, str(file), "exec", dont_inherit=True), names)


#: A number that stands alone.
_SHOWN = re.compile(r"(?<![\w.])\d+\.?\d*(?:e[-+]?\d+)?(?![\w])")


def _numbers(text: str) -> list[float]:
    return [float(number.rstrip(".")) for number in _SHOWN.findall(text)]


def _unseen(shown: str, said: str) -> list[float]:
    """Numbers shown on a page that the command did not say, within half a percent."""
    there = _numbers(said)
    return [x for x in _numbers(shown) if not any(abs(x - y) <= 0.005 * abs(x) for y in there)]


def _console(block: Block, has_shell: bool, heard: Callable[[], str] = str) -> None:
    """Runs the commands of a block; every number shown below one is in what it said, which `heard` gives."""
    for command in commands(block):
        words = shlex.split(command.line)
        assert words[0] == "ribbonbench", f"only ribbonbench runs in a console block: {command.line}"
        if not has_shell and SHELL.search(command.line):
            continue
        try:
            code = cli.main(words[1:])
        except SystemExit as stop:  # argparse
            code = stop.code if isinstance(stop.code, int) else 2
        assert code == command.code, f"exit code {code}: {command.line}"
        text = heard()
        assert not text or not _unseen(command.shown, text), f"{_unseen(command.shown, text)}: {command.line}"


def _marked(page: Path) -> object:
    """A command's page without Python runs in `make validate`: its lines parse, and the commands have their tests."""
    lines_alone = page.parent == DOCS / "commands" and "```python" not in page.read_text()
    return pytest.param(page, marks=[pytest.mark.validate] if lines_alone else [], id=name_of(page))


@pytest.mark.parametrize("page", [_marked(page) for page in PAGES if _runs(page)])
def test_blocks_run(page, tmp_path, monkeypatch, capsys, kept_shells):
    """In order, in one folder and one namespace per page; the README and the tutorials show what was answered."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "180")
    has_shell = importlib.util.find_spec("dolfinx") is not None
    module = types.ModuleType("page")  # a dataclass looks for its module
    monkeypatch.setitem(sys.modules, "page", module)
    names: dict[str, object] = vars(module)
    names["PAGE"] = page

    def heard() -> str:
        said = capsys.readouterr()
        return said.out + said.err

    real = page.parent in (ROOT, DOCS / "tutorials")
    for at, block in enumerate(blocks(page.read_text())):
        if MODULE.match(block.text):
            continue  # a module of the command that tests/test_docs_extend.py adds to a copy of the tree
        if block.info == "python" and not block.file and (has_shell or not SHELL.search(block.text)):
            _python(block, page, names, at)
        elif block.info == "console":
            _console(block, has_shell, heard if real else str)
        elif block.info == "toml scene":
            assert loads(block.text, "page").title
            if block.file:
                Path(block.file).write_text(block.text)
        elif block.info == "toml sweep":
            from compare.sweep.file import load_sweep

            name = block.file or "page_sweep.toml"
            Path(name).write_text(block.text)
            assert load_sweep(name, {}, ()).axes


def test_the_page_of_explain_shows_what_is_said(tmp_path, monkeypatch, capsys):
    """Its example as the command gives it now, times apart: effects, how far the shape moves, what they hold, the
    first line and the last."""
    monkeypatch.setenv("COLUMNS", "100")
    (block,) = [b for b in blocks((DOCS / "commands" / "explain.md").read_text()) if "explain cantilever" in b.text]
    assert cli.main(["explain", "cantilever", "--out", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    rows = [[cell.strip() for cell in line.strip("│").split("│")] for line in said.splitlines() if line[:1] == "│"]
    shown = [
        [cell.strip() for cell in line.strip("│").split("│")] for line in block.text.splitlines() if line[:1] == "│"
    ]
    assert len(shown) >= 8
    for row in shown:
        assert len(row) == 6
        assert row[:5] in [one[:5] for one in rows], row[0]
    flat, text = " ".join(said.split()), " ".join(block.text.split())
    first = text[text.index(" of 17 effects") : text.index(": good.")]
    assert first in flat
    assert text[text.index("- Third opinion") :] in flat


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_blocks_are_of_a_known_kind(page):
    kinds = {block.info for block in blocks(page.read_text())}
    assert kinds <= {*RUN, "", "text", "toml", "diff", "json", "csv", "sh", "math"}, kinds


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_links_lead_somewhere(page):
    text = page.read_text()
    for target in links(text):
        name, _, anchor = target.partition("#")
        there = page if not name else page.parent / name
        assert there.exists(), target
        assert ROOT in there.resolve().parents, f"{target} leads out of the project"
        if anchor and there.suffix == ".md":
            assert anchor in anchors(there.read_text()), target


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_pictures_have_a_text_alternative(page):
    for alternative, target in re.findall(r"!\[([^\]]*)\]\(([^)\s]+)\)", prose(page.read_text())):
        assert len(alternative) > 5, target


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_pages_of_results_named_are_there(page):
    for name in re.findall(r"\bresults/[\w./-]*\w", page.read_text()):
        there = ROOT / name
        assert there.exists() or there.with_suffix(".md").exists(), name


def _parses(words: list[str]) -> bool:
    try:
        whole().parse_args(words)
    except SystemExit as stop:
        return stop.code == 0
    return True


def _shown(text: str) -> set[str]:
    """Commands in code, "ribbonbench NAME ..." with no placeholder in capitals behind it."""
    spans = re.findall(r"`([^`\n]+)`", prose(text))
    lines = [
        line.lstrip("$ ")
        for block in blocks(text)
        if block.info in ("", "sh", "text")
        for line in block.text.split("\n")
    ]
    return {span for span in (*spans, *lines) if re.match(r"(mpirun \S+ \d+ )?ribbonbench [a-z]", span)}


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_commands_shown_exist(page):
    """In prose: the name exists; without placeholders the whole line parses."""
    for shown in _shown(page.read_text()):
        line = re.split(r" [|<>] ", re.sub(r"^mpirun \S+ \d+ ", "", shown))[0]
        words = shlex.split(line, comments=True)[1:]
        assert _parses([words[0], "--help"]), shown
        if len(words) > 1 and not re.search(r"\b[A-Z]{2,}\b|\.\.\.", line):
            assert _parses(words), shown


@pytest.mark.parametrize("page", [page for page in PAGES if _runs(page)], ids=name_of)
def test_commands_that_run_parse(page):
    """The lines of console blocks that `test_blocks_run` runs, for pages that `make test` does not run too; a line
    that ends with 2 may be refused by the parser already."""
    for block in blocks(page.read_text()):
        if block.info == "console":
            for command in commands(block):
                words = shlex.split(command.line)
                assert words[0] == "ribbonbench", command.line
                assert command.code == 2 or _parses(words[1:]), command.line


def test_the_index_shows_every_command_and_the_readme_five():
    index = (DOCS / "README.md").read_text()
    assert set(known.NAMES) <= set(re.findall(r"`ribbonbench ([a-z]+)\b", index))
    readme = (ROOT / "README.md").read_text()
    assert len(set(re.findall(r"`ribbonbench ([a-z]+)\b", readme)) & set(known.NAMES)) >= 5


def test_the_readme_is_short_and_begins_with_the_two_commands_of_make():
    text = (ROOT / "README.md").read_text()
    assert len(text.splitlines()) <= 90
    assert re.findall(r"^make (demo|test)\b", text, re.M) == ["demo", "test"]


def test_validation_commands_shown_exist():
    from tests.validation.__main__ import NAMES

    text = "\n".join(page.read_text() for page in [*PAGES, *(ROOT / "results").rglob("*.md")])
    shown = set(re.findall(r"python -m tests\.validation ([a-z_0-9]+)", text))
    assert shown
    assert shown <= set(NAMES)


@pytest.mark.parametrize("name", known.NAMES)
def test_every_command_has_its_page(name):
    assert (DOCS / "commands" / f"{name}.md").exists()


def _linked(page: Path) -> set[Path]:
    return {(page.parent / target.partition("#")[0]).resolve() for target in links(page.read_text())}


def test_every_page_is_in_the_index():
    index = DOCS / "README.md"
    named = _linked(index)
    for page in DOCS.rglob("*.md"):
        if page != index:
            assert page.resolve() in named, name_of(page)


def test_index_and_results_are_one_step_from_the_readme():
    named = _linked(ROOT / "README.md")
    assert {(DOCS / "README.md").resolve(), (ROOT / "results" / "README.md").resolve()} <= named
    assert len([page for page in named if page.parent == (DOCS / "tutorials").resolve()]) >= 4


def test_the_citation_is_of_this_version_and_of_works_that_are_linked():
    """CITATION.cff: its keys, version and licence; every DOI of it is on the page of references."""
    yaml = pytest.importorskip("yaml")
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert {"cff-version", "message", "title", "authors", "abstract", "keywords", "license", "references"} <= set(cited)
    assert (cited["version"], cited["license"]) == (__version__, "BSD-3-Clause")
    linked = (DOCS / "references.md").read_text()
    dois = [work["doi"] for work in cited["references"] if "doi" in work]
    assert len(dois) >= 3
    for doi in dois:
        assert f"(https://doi.org/{doi})" in linked, doi
    for work in cited["references"]:
        assert all({"family-names", "given-names"} <= set(author) for author in work["authors"]), work["title"]


def test_no_page_names_a_machine():
    for page in PAGES:
        text = page.read_text()
        for home in {str(ROOT), os.path.expanduser("~"), "/home/", "/root/"} - {"/"}:
            assert home not in text, (name_of(page), home)


def test_a_broken_page_is_seen(tmp_path, monkeypatch):
    """The checks themselves: an open fence, a failing command, a failing block, a scene that is none."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError, match="not closed"):
        blocks("```python\nx = 1\n")
    with pytest.raises(AssertionError, match="exit code 2"):
        _console(Block("console", "$ ribbonbench solve no_such_scene\n", 1), False)
    with pytest.raises(AssertionError, match="only ribbonbench"):
        _console(Block("console", "$ rm -r out\n", 1), False)
    _console(Block("console", "$ ribbonbench solve no_such_scene\n# exit code 2\n", 1), False)
    with pytest.raises(AssertionError, match=r"6\.25"):
        _console(Block("console", "$ ribbonbench solve x\nx 6.25 mm\n# exit code 2\n", 1), False, lambda: "6.75 mm")
    with pytest.raises(ZeroDivisionError):
        _python(Block("python", "1 / 0\n", 1), Path("x.md"), {}, 0)
    with pytest.raises(BadInput):
        loads('title = "x"\n[stripp]\nlength = 1.0\n', "page")
    assert [(c.line, c.shown) for c in commands(Block("console", "$ a \\\n  b\nout\n$ c\n", 1))] == [
        ("a b", "out"),
        ("c", ""),
    ]
    assert [(b.info, b.file) for b in blocks("```toml scene a.toml\n```\n```toml scene\n```\n")] == [
        ("toml scene", "a.toml"),
        ("toml scene", ""),
    ]
    assert anchors("# A `b` (c): d\n") == {"a-b-c-d"}
