"""The sources that a result depends on: what an entry module imports, and what its imports import in turn.

The key of a result that is kept holds `digest` of the modules that made it, so that nothing kept outlives the code.
This is ground that `ribbon`, `shellref` and `compare` share: no mechanics and no numerics. It imports the standard
library alone, runs no module that it reads, and is as good in an installed wheel as in a tree.

Which modules belong to a module:

- what it imports by name, wherever in it, inside functions too: `import a.b`, `from a import b` (a.b where that is a
  module; where b is what the package a has imported from elsewhere, that elsewhere; else a), relative ones;
- what `import_module`, `__import__` and `run_module` load: a name that is written out, all of a package for
  ``f"package.{name}"``, and for a name that is computed every name of a module that stands in the file as a text;
- what is started as a process of its own: every module that a list with "-m" names, by text or by a name likewise;
- data: a file beside the module whose name stands in it as a text.

What stands under ``if TYPE_CHECKING`` is not run, and does not belong. The ``__init__`` of a package is run with every
module of it: its text belongs to them, but what it imports only where it is imported itself.
"""

from __future__ import annotations

import ast
import contextlib
import functools
import hashlib
import importlib.util
import json
import os
import platform
import re
import stat
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

#: Our own top-level packages.
PACKAGES = ("ribbonbench", "ribbon", "shellref", "compare")
#: The folder that holds them.
ROOT = Path(__file__).resolve().parents[1]

_LOADERS = ("import_module", "__import__", "run_module")
_MODULE = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*")
_DATA = re.compile(r"[\w-]+\.(?!py$)\w{1,8}")
_INIT = "__init__.py"


@dataclass(frozen=True)
class Module:
    """A module's text as far as it matters: code, the SHA-256 of its syntax tree without docstrings; imports, in a
    short writing: ``a.b`` a module, ``a.b:c`` a name of a module, leading dots where they are relative (import
    statements), after a ``~`` for types only; ``!a.b`` a module that is loaded or started, ``*a`` all modules of a
    package, ``=x.toml`` a file beside it."""

    code: str
    imports: tuple[str, ...]


def read(text: bytes) -> Module:
    """The `Module` of a source text; one that cannot be parsed imports nothing, and its code is its text."""
    try:
        tree = ast.parse(text)
    except (SyntaxError, ValueError):
        return Module(hashlib.sha256(text).hexdigest(), ())
    imports = tuple(sorted(set(_imports(tree))))
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and node.body:
            first = node.body[0]
            if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
                first.value.value = ""
    return Module(hashlib.sha256(ast.dump(tree).encode()).hexdigest(), imports)


def _imports(tree: ast.Module) -> Iterator[str]:
    """What a syntax tree imports, in the writing of `Module`."""
    texts: set[str] = set()
    computed = False
    for node in _run(tree):
        yield from _stated(node)
        if isinstance(node, ast.If) and _for_types(node):
            yield from (f"~{one}" for part in node.body for inner in ast.walk(part) for one in _stated(inner))
        elif isinstance(node, ast.Call) and node.args and _name(node.func) in _LOADERS:
            name = node.args[0]
            if isinstance(name, ast.Constant):
                yield f"!{name.value!s}"
            elif isinstance(name, ast.JoinedStr) and (head := _head(name)).endswith("."):
                yield f"*{head[:-1]}"
            else:
                computed = True
        elif isinstance(node, ast.List | ast.Tuple):
            named = [one.value for one in node.elts if isinstance(one, ast.Constant) and isinstance(one.value, str)]
            if "-m" in named:
                computed = computed or any(isinstance(one, ast.Name | ast.Starred) for one in node.elts)
                yield from (f"!{text}" for text in named if _MODULE.fullmatch(text))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            texts.add(node.value)
    yield from (f"={text}" for text in texts if _DATA.fullmatch(text))
    if computed:
        yield from (f"!{text}" for text in texts if "." in text and _MODULE.fullmatch(text))


def _stated(node: ast.AST) -> Iterator[str]:
    """What an import statement imports; nothing of any other node."""
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        base = "." * node.level + (node.module or "")
        yield from (f"{base}:{alias.name}" for alias in node.names)


def _run(tree: ast.Module) -> Iterator[ast.AST]:
    """All nodes of a tree that are run: not what stands under ``if TYPE_CHECKING``."""
    wanted: list[ast.AST] = [tree]
    while wanted:
        node = wanted.pop()
        yield node
        wanted += node.orelse if isinstance(node, ast.If) and _for_types(node) else ast.iter_child_nodes(node)


def _for_types(node: ast.If) -> bool:
    return _name(node.test) == "TYPE_CHECKING"


def _name(node: ast.AST) -> str:
    """The last part of a name: ``b`` of ``b`` and of ``a.b``; "" for what is none."""
    return node.attr if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else ""


def _head(name: ast.JoinedStr) -> str:
    """What an f-string begins with."""
    first = name.values[0] if name.values else None
    return str(first.value) if isinstance(first, ast.Constant) else ""


class Sources:
    """The modules under a folder `root` (None: of our packages where Python finds them), each file read once; those of
    a model from outside where Python finds them. packages: the top-level names that count as ours."""

    def __init__(self, root: Path | None = None, packages: Sequence[str] = PACKAGES) -> None:
        self._memo = _Memo()
        self._texts: dict[str, Module] = {}
        self._closures: dict[tuple[bool, tuple[str, ...], tuple[str, ...]], dict[str, Path]] = {}
        self._edges: dict[tuple[str, bool], tuple[set[str], dict[str, Path]]] = {}
        self._folders: dict[Path, frozenset[str]] = {}
        self._tops = {name: (_folder(name) or ROOT) if root is None else root for name in packages}

    def closure(self, *entries: str, statements: bool = False, without: Sequence[str] = ()) -> dict[str, Path]:
        """Dotted name -> file of the entry modules and of all that belongs to them; data by its path ("a/b.toml").

        statements: what stands in import statements only, which is all that a compiled kernel is made from. without:
        modules that do not belong, nor what only they import. Raises ModuleNotFoundError for an entry that is not
        there.
        """
        key = statements, tuple(sorted(set(entries))), tuple(sorted(set(without)))
        if key not in self._closures:
            for entry in entries:
                self._admit(entry)
                if self.file(entry) is None:
                    raise ModuleNotFoundError(f"No module named {entry!r}", name=entry)
            self._closures[key] = self._closure(entries, statements, frozenset(without))
            self._memo.keep()
        return dict(self._closures[key])

    def _closure(self, entries: Sequence[str], statements: bool, without: frozenset[str]) -> dict[str, Path]:
        found: dict[str, Path] = {}
        wanted = list(entries)
        while wanted:
            name = wanted.pop()
            path = self.file(name)
            if name in found or name in without or path is None:
                continue
            found[name] = path
            if (name, statements) not in self._edges:
                modules = self._stated(name, path)
                more = (set(), {}) if statements else (self._loaded(path), self._data(name, path))
                self._edges[name, statements] = modules | more[0], more[1]
            modules, data = self._edges[name, statements]
            wanted += modules
            found.update(data)
        if not statements:
            names = [name.split(".") for name, path in found.items() if path.suffix == ".py"]
            around = {".".join(parts[:count]) for parts in names for count in range(1, len(parts))}
            found.update({name: path for name in around if (path := self.file(name)) is not None})
        return found

    def digest(self, *entries: str) -> str:
        """SHA-256 over names and code of `closure`: comments, docstrings and line breaks do not count."""
        return self.sum(self.closure(*entries))

    def sum(self, modules: Mapping[str, Path]) -> str:
        """SHA-256 over the names and the code of `modules`."""
        found = hashlib.sha256()
        for name, path in sorted(modules.items()):
            found.update(name.encode() + b"\0" + self.module(path).code.encode())
        self._memo.keep()
        return found.hexdigest()

    def every(self, *packages: str) -> dict[str, Path]:
        """Dotted name -> file of all modules of ours, or of the `packages` named."""
        found = {}
        for package in packages or self._tops:
            root = self._tops[package]
            for folder, _, names in os.walk(root / package):
                stem = ".".join(Path(folder).relative_to(root).parts)
                for name in names:
                    if name.endswith(".py"):
                        found[stem if name == _INIT else f"{stem}.{name[:-3]}"] = Path(folder, name)
        return found

    def file(self, name: str) -> Path | None:
        """The file of a module of ours, or of a model from outside; None for any other."""
        parts = name.split(".")
        folder = self._tops.get(parts[0])
        if folder is None:
            return None
        for part in parts[:-1]:
            folder = folder / part
        if f"{parts[-1]}.py" in self._names(folder):
            return folder / f"{parts[-1]}.py"
        return folder / parts[-1] / _INIT if _INIT in self._names(folder / parts[-1]) else None

    def module(self, path: Path) -> Module:
        """What is in a file."""
        key = str(path)
        found = self._texts.get(key)
        if found is None:
            text = path.read_bytes()
            is_code = path.suffix == ".py"
            found = self._memo.module(text) if is_code else Module(hashlib.sha256(text).hexdigest(), ())
            self._texts[key] = found
        return found

    def imports(self, name: str) -> set[str]:
        """The modules of ours that a module names in its import statements, those for types included: the arrows that
        the house's rules are about."""
        path = self.file(name)
        return set() if path is None else self._stated(name, path, types=True) - {name}

    def _stated(self, name: str, path: Path, types: bool = False) -> set[str]:
        """The modules that a module's import statements name, with or without those for types."""
        found, package = set(), _package(name, path)
        for one in self.module(path).imports:
            if one[0] in "=!*" or (one[0] == "~" and not types):
                continue
            base, _, attribute = absolute(one.lstrip("~"), package).partition(":")
            found.add(self._home(base, attribute, below=types) if attribute else base)
        return {one for one in found if self.file(one) is not None}

    def _loaded(self, path: Path) -> set[str]:
        """The modules that a module loads by name, or starts."""
        found = set()
        for one in self.module(path).imports:
            if one[0] == "!":
                found.add(one[1:])
            elif one[0] == "*":
                found |= self._below(one[1:])
        return {one for one in found if self.file(one) is not None}

    def _data(self, name: str, path: Path) -> dict[str, Path]:
        """The files of data that a module names."""
        names = [one[1:] for one in self.module(path).imports if one[0] == "=" and one[1:] in self._names(path.parent)]
        return {"/".join((*_package(name, path), one)): path.parent / one for one in names}

    def others(self, modules: Mapping[str, Path]) -> set[str]:
        """The top-level names of what `modules` import beside modules of ours and the standard library."""
        names = {
            one.partition(":")[0].partition(".")[0] for path in modules.values() for one in self.module(path).imports
        }
        return {name for name in names if name.isidentifier()} - self._tops.keys() - sys.stdlib_module_names

    def _home(self, base: str, attribute: str, below: bool) -> str:
        """The module that ``from base import attribute`` is about. below: what a package hands on from elsewhere counts
        as its own, as it does for the house's rules; what it has from modules of its own never does."""
        seen = set()
        while (base, attribute) not in seen:
            seen.add((base, attribute))
            if self.file(f"{base}.{attribute}") is not None:
                return f"{base}.{attribute}"
            path = self.file(base)
            if path is None or path.name != _INIT:
                return base
            for one in self.module(path).imports:
                if one[0] in "~=!*":
                    continue
                there, _, same = absolute(one, base.split(".")).partition(":")
                near = there.startswith(f"{base}.") or not below
                if same == attribute and near and self.file(there) is not None:
                    base = there
                    break
        return base

    def _below(self, package: str) -> set[str]:
        """All modules directly in a package."""
        path = self.file(package)
        if path is None or path.name != _INIT:
            return set()
        return {f"{package}.{name[:-3]}" for name in self._names(path.parent) if name.endswith(".py")} - {
            f"{package}.__init__"
        }

    def _names(self, folder: Path) -> frozenset[str]:
        """The files of a folder; none where there is no folder."""
        if folder not in self._folders:
            try:
                with os.scandir(folder) as entries:
                    self._folders[folder] = frozenset(entry.name for entry in entries if entry.is_file())
            except OSError:
                self._folders[folder] = frozenset()
        return self._folders[folder]

    def _admit(self, entry: str) -> None:
        """An entry module from outside: what stands beside its top-level module is its own too; of what is installed
        among others, what belongs to the same distribution."""
        top = entry.split(".")[0]
        if top in self._tops:
            return
        folder = _folder(top)
        if folder is not None:
            for name in _fellows(top) | {top} if _shared(folder) else _names_in(folder):
                self._tops.setdefault(name, folder)


def _package(name: str, path: Path) -> list[str]:
    """The package that a module is in, or is."""
    parts = name.split(".")
    return parts if path.name == _INIT else parts[:-1]


def absolute(one: str, package: Sequence[str]) -> str:
    """An import as a module of `package` writes it, without leading dots."""
    level = len(one) - len(one.lstrip("."))
    if not level:
        return one
    base, _, attribute = one[level:].partition(":")
    return ".".join([*package[: len(package) - level + 1], *([base] if base else [])]) + f":{attribute}"


def _folder(top: str) -> Path | None:
    """The folder that holds a top-level module; None for one that is not there, or not in files."""
    with contextlib.suppress(ValueError, ImportError):
        spec = importlib.util.find_spec(top)
        if spec is None:
            return None
        if spec.submodule_search_locations:
            return Path(next(iter(spec.submodule_search_locations))).parent
        return None if spec.origin is None or not spec.has_location else Path(spec.origin).parent
    file = getattr(sys.modules.get(top), "__file__", None)
    return None if file is None else Path(file).parent


def _names_in(folder: Path) -> set[str]:
    """The top-level modules and packages that stand in a folder."""
    with os.scandir(folder) as entries:
        names = {one.name if one.is_dir() else one.name.removesuffix(".py") for one in entries}
    return {name for name in names if name.isidentifier()}


def _fellows(top: str) -> set[str]:
    """The top-level names of the distribution that `top` belongs to."""
    from importlib.metadata import packages_distributions

    known = packages_distributions()
    return {name for name, made_by in known.items() if set(made_by) & set(known.get(top, ()))}


def _shared(folder: Path) -> bool:
    """Whether Python keeps what is installed, or its own library, in a folder."""
    import site
    import sysconfig

    paths = [*site.getsitepackages(), site.getusersitepackages(), *sysconfig.get_paths().values()]
    return folder.name in ("site-packages", "dist-packages") or any(Path(path) == folder for path in paths)


class _Memo:
    """What `read` finds in a text, by the SHA-256 of the text, kept between processes: syntax trees take seconds.

    A file that another user owns or can write is not read; one that cannot be written is no fault.
    """

    MOST = 3000  # modules

    def __init__(self) -> None:
        self._known: dict[str, tuple[str, str]] | None = None
        self._new: dict[str, tuple[str, str]] = {}

    def module(self, text: bytes) -> Module:
        """`read(text)`."""
        if self._known is None:
            self._known = self._read()
        key = hashlib.sha256(text).hexdigest()
        found = self._known.get(key) or self._new.get(key)
        if found is None:
            fresh = read(text)
            found = self._new[key] = (fresh.code, " ".join(fresh.imports))
        return Module(found[0], tuple(found[1].split()))

    def keep(self) -> None:
        """Keeps what is new, whole or not at all."""
        if not self._new:
            return
        latest = {**self._read(), **self._new}
        if self._known is not None:
            self._known.update(self._new)
        self._new = {}
        from ribbonbench.replacing import replacing

        with contextlib.suppress(OSError), replacing(_place(), lasting=False, own=True) as stream:
            stream.write(json.dumps(dict(list(latest.items())[-self.MOST :])).encode())

    @staticmethod
    def _read() -> dict[str, tuple[str, str]]:
        with contextlib.suppress(OSError, ValueError, AttributeError, TypeError), _place().open() as stream:
            status = os.fstat(stream.fileno())
            if status.st_uid not in (os.geteuid(), 0) or status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
                return {}
            found = {text: (str(code), str(imports)) for text, (code, imports) in json.load(stream).items()}
            return {
                text: one for text, one in found.items() if len(bytes.fromhex(text)) == len(bytes.fromhex(one[0])) == 32
            }
        return {}


def _place() -> Path:
    """The file of the `_Memo`."""
    own = os.environ.get("RIBBONBENCH_CACHE")
    home = Path(own).expanduser() if own else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    name = f"sources-{platform.python_version()}.json"
    return home / name if own else home / "ribbonbench" / name


@functools.cache
def ours() -> Sources:
    """The modules of this process, read when they are first asked for."""
    return Sources()


def closure(*entries: str) -> dict[str, Path]:
    """`Sources.closure` of this process's modules."""
    return ours().closure(*entries)


@functools.cache
def digest(*entries: str) -> str:
    """`Sources.digest` of this process's modules, of all that are ours where none is named; once per process."""
    return ours().digest(*entries) if entries else ours().sum(ours().every())
