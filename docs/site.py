"""Makes the site from the Markdown pages, with Sphinx: python -m docs.site OUT [--bare] (`make docs`).

The pages stay as they are, readable in the repository: a source folder is made of copies, in the same places, so that
their links hold. What they link to and what is no page of the site (a source file) is named without a link. Formulas
become MathML, which browsers show by themselves; nothing is loaded from elsewhere, and the search works from the disk.
Notebooks become Jupyter's files and are executed while the site is built; an error in one fails it (--bare: not).
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from datetime import date
from pathlib import Path

from docs.site_notebooks import notebook, notebooks
from docs.site_reference import MODULES, reference

ROOT = Path(__file__).resolve().parents[1]
#: Caption -> the pages below it, in their order; patterns take what is left.
TREE: Mapping[str, Sequence[str]] = {
    "Learn": (
        "docs/tutorials/first_scene", "docs/tutorials/*", "docs/notebooks/first_strip", "docs/notebooks/*",
        "docs/which_model", "docs/gallery",
    ),
    "Look up": (
        "docs/install", "docs/glossary", "docs/scenes", "docs/tables", "docs/api", "reference/*", "docs/verdicts",
        "docs/stability", "docs/references",
    ),
    "Commands": ("docs/commands/*",),
    "Theory": ("docs/theory", "docs/shell"),
    "Measured": ("results/README", "results/*", "results/**/*"),
    "Project": ("docs/README", "docs/*", "CONTRIBUTING", "CHANGELOG"),
}  # fmt: skip
#: Where pages and their pictures stand.
PLACES = ("docs", "results")
ALONE = ("CONTRIBUTING.md", "CHANGELOG.md")
#: Files beside the pages that come along.
COPIED = (".png", ".svg", ".csv", ".json")
#: matplotlib's backend that shows figures in a notebook; a kernel takes it by itself only where none is named.
INLINE = "module://matplotlib_inline.backend_inline"
_LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\[\]]*\])*)\]\(([^()\s]+)\)")
_FENCE = re.compile(r"^(```|~~~)", re.MULTILINE)
_MATH = re.compile(r"^```math\n(.*?)^```", re.MULTILINE | re.DOTALL)

CONF = """
import sys
sys.path.insert(0, {root!r})
from docs.site_math import setup_math
project, author, release, version = "ribbonbench", "ribbonbench", {version!r}, {version!r}
html_title = "ribbonbench {version}, {day}"
extensions = ["myst_nb"]
exclude_patterns = ["notebooks"]  # those that are to be had as files
nb_execution_mode = {execute!r}
nb_execution_timeout = 1800
nb_execution_show_tb = nb_execution_in_temp = nb_merge_streams = True
myst_enable_extensions = ["dollarmath", "amsmath"]
myst_heading_anchors = 6
myst_dmath_double_inline = True
suppress_warnings = ["misc.highlighting_failure", "myst.header", "toc.not_readable"]
html_theme = "furo"
html_last_updated_fmt = "{day}"
html_static_path = ["_site"]
html_css_files = ["site.css"]
html_copy_source = html_show_sourcelink = False
html_show_search_summary = False  # it is fetched from the pages found, which a browser forbids from the disk
html_math_renderer = "mathml"
html_baseurl = ""
def setup(app):
    setup_math(app)
"""

#: What is wider than a phone is moved in its own box.
CSS = """
div.math, .cell_output { overflow-x: auto; overflow-y: hidden; }
article p, article li { overflow-wrap: anywhere; }
"""


def pages(root: Path = ROOT) -> list[str]:
    """Every Markdown page of the project that belongs to the site, without its ending."""
    found = [*(root / name for name in ALONE)]
    for place in PLACES:
        found += sorted((root / place).rglob("*.md"))
    return [path.relative_to(root).with_suffix("").as_posix() for path in found]


def tree(names: Sequence[str]) -> dict[str, list[str]]:
    """The pages below each caption, each once."""
    from fnmatch import fnmatch

    left = list(names)
    placed: dict[str, list[str]] = {caption: [] for caption in TREE}
    exact = {name for listed in TREE.values() for name in listed}
    for caption, patterns in TREE.items():
        for pattern in patterns:
            deep = "**" in pattern
            fits = [
                name
                for name in left
                if name == pattern
                or (fnmatch(name, pattern) and name not in exact and (deep or name.count("/") == pattern.count("/")))
            ]
            placed[caption] += fits
            left = [name for name in left if name not in fits]
    if left:
        raise ValueError(f"pages without a place in the site: {', '.join(left)}")
    return placed


def _outside_code(text: str) -> Iterator[tuple[bool, str]]:
    """Pieces of a page; True: no code."""
    inside, piece = False, ""
    for line in text.splitlines(keepends=True):
        if _FENCE.match(line):
            if not inside:
                yield True, piece
                piece = line
            else:
                yield False, piece + line
                piece = ""
            inside = not inside
        else:
            piece += line
    yield not inside, piece


def adapted(text: str, page: str, known: Sequence[str], root: Path = ROOT) -> str:
    """A page as the site has it: a heading, and what `linked` does."""
    heading = "" if text.lstrip().startswith("# ") else f"# {page}\n\n"
    return heading + linked(text, page, known, root)


def linked(text: str, page: str, known: Sequence[str], root: Path = ROOT) -> str:
    """Text of a page as the site has it: formulas as MyST writes them; links to what is not there without a link."""
    here = (root / page).parent

    def link(found: re.Match[str]) -> str:
        mark, words, target = found.groups()
        path, hash_, anchor = target.partition("#")
        if re.match(r"[a-z]+:", target) or not path:
            return found[0]
        there = Path(os.path.normpath(here / path))
        name = there.relative_to(root).as_posix() if there.is_relative_to(root) else ""
        if name in ("README.md", "."):
            above = "../" * page.count("/")
            return f"{mark}[{words}]({above}index.md{hash_}{anchor})"
        if name.removesuffix(".md") in known and name.endswith(".md"):
            return found[0]
        if name.removesuffix(".py") in known and name.endswith(".py"):
            return f"[{words}]({path.removesuffix('.py')}.ipynb{hash_}{anchor})"
        if there.is_dir() and f"{name}/README" in known:
            return f"[{words}]({path.rstrip('/')}/README.md)"
        copied = name.startswith(tuple(f"{place}/" for place in PLACES)) and there.suffix in COPIED and there.is_file()
        return found[0] if copied else words

    pieces = []
    for prose, piece in _outside_code(text):
        pieces.append(_LINK.sub(link, piece) if prose else _MATH.sub(lambda m: f"$$\n{m[1]}$$", piece))
    return "".join(pieces)


def source(out: Path, root: Path = ROOT, execute: bool = True) -> None:
    """The folder that Sphinx reads; execute: whether it will run the notebooks."""
    from ribbonbench import __version__

    shutil.rmtree(out, ignore_errors=True)
    for place in PLACES:
        for path in (root / place).rglob("*"):
            if path.suffix in COPIED and path.is_file():
                (out / path.relative_to(root)).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(path, out / path.relative_to(root))
    named, run = pages(root), notebooks(root)
    known = [*named, *run]
    for name in named:
        text = (root / f"{name}.md").read_text(encoding="utf-8")
        (out / f"{name}.md").parent.mkdir(parents=True, exist_ok=True)
        (out / f"{name}.md").write_text(adapted(text, name, known, root), encoding="utf-8")
    for name in run:
        _write_notebook(out, root, name, known)
    (out / "reference").mkdir()
    for module in MODULES:
        (out / "reference" / f"{module}.md").write_text(reference(module, root), encoding="utf-8")
    below = tree([*known, *(f"reference/{module}" for module in MODULES)])
    trees = "".join(
        f"\n```{{toctree}}\n:caption: {caption}\n:maxdepth: 1\n:hidden:\n\n" + "\n".join(names) + "\n```\n"
        for caption, names in below.items()
    )
    first = adapted((root / "README.md").read_text(encoding="utf-8"), "README", known, root)
    (out / "index.md").write_text(first + trees, encoding="utf-8")
    day = date.today().isoformat()
    (out / "_site").mkdir()
    (out / "_site" / "site.css").write_text(CSS, encoding="utf-8")
    conf = CONF.format(root=str(root), version=__version__, day=day, execute="force" if execute else "off")
    (out / "conf.py").write_text(conf, encoding="utf-8")


def _write_notebook(out: Path, root: Path, name: str, known: Sequence[str]) -> None:
    """A notebook as Jupyter's file, with a line that offers it, and itself, below its heading."""
    text = (root / f"{name}.py").read_text(encoding="utf-8")
    stem, below = Path(name).name, out / "notebooks"
    below.mkdir(exist_ok=True)
    place = "../" * name.count("/") + f"notebooks/{stem}"
    (below / f"{stem}.ipynb").write_text(json.dumps(notebook(text), indent=1), encoding="utf-8")
    (below / f"{stem}.py").write_text(text, encoding="utf-8")
    offer = (
        f"Executed while this site was built. To run it: {{download}}`{stem}.ipynb <{place}.ipynb>` (Jupyter) or "
        f"{{download}}`{stem}.py <{place}.py>` (Python)."
    )

    def page(cell: str) -> str:
        heading, line, rest = cell.partition("\n")
        offered = f"{heading}{line}\n{offer}\n{rest}" if heading.startswith("# ") else cell
        return linked(offered, name, known, root)

    (out / f"{name}.ipynb").parent.mkdir(parents=True, exist_ok=True)
    (out / f"{name}.ipynb").write_text(json.dumps(notebook(text, page), indent=1), encoding="utf-8")


def broken(out: Path) -> list[str]:
    """Links of the built site that lead nowhere in it, "page: target"."""
    anchors: dict[Path, set[str]] = {}
    texts = {path.resolve(): path.read_text(encoding="utf-8") for path in out.rglob("*.html")}
    for path, text in texts.items():
        anchors[path] = set(re.findall(r'\bid="([^"]+)"', text))
    found = []
    for path, text in texts.items():
        for target in re.findall(r'(?:href|src)="([^"]+)"', text):
            place, _, anchor = target.partition("#")
            place = place.partition("?")[0]
            if re.match(r"[a-z]+:|//", target):
                continue
            there = (path.parent / place).resolve() if place else path
            if not there.exists() or (anchor and there in anchors and anchor not in anchors[there]):
                found.append(f"{path.relative_to(out.resolve())}: {target}")
    return found


def foreign(out: Path) -> list[str]:
    """What the built pages would load from elsewhere: scripts, styles, pictures with a host in their address."""
    loads = re.compile(
        r'<(?:script|img|iframe)[^>]*\ssrc="((?:https?:)?//[^"]+)"|<link[^>]*rel="stylesheet"[^>]*"(https?://[^"]+)"'
    )
    return [
        f"{path.relative_to(out)}: {a or b}"
        for path in out.rglob("*.html")
        for a, b in loads.findall(path.read_text(encoding="utf-8"))
    ]


def main(out: Path, execute: bool = True) -> int:
    """Builds the site into OUT/html without a warning; 1 where there was one, a notebook failed, or a link leads
    nowhere. execute: False leaves the notebooks without their outputs."""
    source(out / "source", execute=execute)
    for old in ("html", "doctrees"):  # no page, no link of a build before
        shutil.rmtree(out / old, ignore_errors=True)
    # Of this project and of nobody's home: what Jupyter keeps, its settings and its kernels.
    own = {name: str(out.resolve() / "jupyter") for name in ("JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR", "IPYTHONDIR")}
    own |= {"JUPYTER_PLATFORM_DIRS": "1", "PYDEVD_DISABLE_FILE_VALIDATION": "1", "MPLBACKEND": INLINE}
    code = subprocess.call(
        [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", "-d", str(out / "doctrees"),
         str(out / "source"), str(out / "html")],
        env={**os.environ, **own},
    )  # fmt: skip
    faults = [*broken(out / "html"), *foreign(out / "html")]
    for fault in faults:
        print(f"docs: {fault}", file=sys.stderr)
    print(f"docs: {len(list((out / 'html').rglob('*.html')))} pages in {out / 'html'}/index.html")
    return 1 if code or faults else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), execute="--bare" not in sys.argv[2:]))
