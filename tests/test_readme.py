"""Every Python block of the README and of docs/api.md runs, and every command they show exists."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from compare.cli import _parser

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", ROOT / "docs" / "api.md"]


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_python_blocks_run(page, tmp_path, monkeypatch):
    blocks = re.findall(r"```python\n(.*?)```", page.read_text(), re.S)
    assert blocks
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, str(page), "exec"), names)


def test_commands_shown_exist():
    text = "\n".join(page.read_text() for page in PAGES)
    shown = set(re.findall(r"ribbonbench ([a-z]+)\b", text)) - {"is"}
    known = {"solve", "compare", "explain", "scenes", "doctor"}
    assert known <= shown
    parser = _parser()
    for name in shown:
        with pytest.raises(SystemExit) as caught:
            parser.parse_args([name, "--help"])
        assert caught.value.code == 0, name


def test_validation_commands_shown_exist():
    from tests.validation.__main__ import NAMES

    text = "\n".join(page.read_text() for page in [*PAGES, *(ROOT / "results").glob("*.md")])
    shown = set(re.findall(r"python -m tests\.validation ([a-z_]+)", text))
    assert shown
    assert shown <= set(NAMES)


def test_pictures_and_pages_named_in_the_readme_are_there():
    for target in re.findall(r"\]\(([^)#:]+)\)", (ROOT / "README.md").read_text()):
        assert (ROOT / target).exists(), target
