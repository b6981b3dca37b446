"""The reference of the public names, from signatures and docstrings; the sources are read, nothing is imported.

Below a signature stand the types that it names, with links: to their own place here, and into NumPy's and SciPy's
reference by the addresses that those have for a name (an inventory would have to be fetched when the site is built).
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

#: The modules whose `__all__` is public.
MODULES = ("ribbon", "shellref", "compare.check")

#: Other people's reference: the address of a name, by its first word; `_SHARED`: of what stands on a page with others.
ELSEWHERE: Mapping[str, str] = {
    "numpy": "https://numpy.org/doc/stable/reference/generated/{name}.html",
    "scipy": "https://docs.scipy.org/doc/scipy/reference/generated/{name}.html",
}
_SHARED: Mapping[str, str] = {
    "numpy.typing.": "https://numpy.org/doc/stable/reference/typing.html#{name}",
    **dict.fromkeys(
        ("numpy.float64", "numpy.int64", "numpy.bool_"),
        "https://numpy.org/doc/stable/reference/arrays.scalars.html#{name}",
    ),
}

Node = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef


def _file(module: str, root: Path) -> Path:
    path = root.joinpath(*module.split("."))
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


@cache
def _parsed(module: str, root: Path) -> ast.Module:
    return ast.parse(_file(module, root).read_text(encoding="utf-8"))


def public(module: str, root: Path) -> list[str]:
    """The names in a module's `__all__`."""
    for node in _parsed(module, root).body:
        if isinstance(node, ast.Assign) and any(isinstance(t, ast.Name) and t.id == "__all__" for t in node.targets):
            return [str(name) for name in ast.literal_eval(node.value)]
    raise ValueError(f"{module} has no __all__")


@cache
def found(module: str, name: str, root: Path) -> tuple[str, Node] | None:
    """Where a name is defined, and its definition; None: it is a value."""
    parsed = _parsed(module, root)
    for node in ast.walk(parsed):
        if isinstance(node, Node) and node.name == name:
            return module, node
    for node in ast.walk(parsed):
        if isinstance(node, ast.ImportFrom) and node.module and not node.level:
            for alias in node.names:
                if (alias.asname or alias.name) == name and _file(node.module, root).exists():
                    return found(node.module, alias.name, root)
    return None


def address(name: str) -> str | None:
    """Where the reference of NumPy or SciPy has a name ("numpy.ndarray"); None: it is not theirs."""
    for start, pattern in (*_SHARED.items(), *((f"{word}.", pattern) for word, pattern in ELSEWHERE.items())):
        if name == start or (start.endswith(".") and name.startswith(start)):
            return pattern.format(name=name)
    return None


def label(module: str, name: str, node: Node | None) -> str:
    """The target of a name in the site: without capitals, which targets do not know; classes and functions apart."""
    return f"{module}.{name}".lower() + (".class" if isinstance(node, ast.ClassDef) else "")


@cache
def _places(root: Path) -> dict[str, str]:
    """Targets of the public names, by the module where each is defined and its name."""
    places: dict[str, str] = {}
    for module in MODULES:
        for name in public(module, root):
            at = found(module, name, root)
            if at is not None:
                places[f"{at[0]}.{at[1].name}"] = label(module, name, at[1])
    return places


@cache
def _known(module: str, root: Path) -> tuple[dict[str, str], dict[str, ast.expr]]:
    """What names of a module's text stand for: the full names of what it imports and defines; values of aliases."""
    imported: dict[str, str] = {}
    aliases: dict[str, ast.expr] = {}
    parsed = _parsed(module, root)
    for node in ast.walk(parsed):
        if isinstance(node, ast.Import):
            imported |= {alias.asname or alias.name: alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            imported |= {alias.asname or alias.name: f"{node.module}.{alias.name}" for alias in node.names}
    for node in parsed.body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            aliases[node.targets[0].id] = node.value
        elif isinstance(node, Node):
            imported[node.name] = f"{module}.{node.name}"
    return imported, aliases


def _annotations(node: ast.AST) -> Iterator[ast.expr]:
    """The annotations of a definition and of what is public in it."""
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
        every = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs, node.args.vararg, node.args.kwarg]
        yield from (one.annotation for one in every if one is not None and one.annotation is not None)
        if node.returns is not None:
            yield node.returns
    elif isinstance(node, ast.ClassDef):
        for part in node.body:
            if isinstance(part, ast.AnnAssign) and not _private(part):
                yield part.annotation
            elif isinstance(part, ast.FunctionDef) and (part.name == "__init__" or not part.name.startswith("_")):
                yield from _annotations(part)


def _named(expression: ast.expr, module: str, root: Path) -> Iterator[str]:
    """Full names in an annotation, those of an alias in its place."""
    imported, aliases = _known(module, root)
    if isinstance(expression, ast.Attribute | ast.Name):
        first, _, rest = ast.unparse(expression).partition(".")
        if first in imported:
            yield imported[first] + (f".{rest}" if rest else "")
        elif first in aliases:
            yield from _named(aliases[first], module, root)
        return
    for child in ast.iter_child_nodes(expression):
        if isinstance(child, ast.expr):
            yield from _named(child, module, root)


def types(module: str, node: Node, root: Path) -> dict[str, str]:
    """The types that a definition names -> where their reference stands, in the order in which they come."""
    links: dict[str, str] = {}
    for annotation in _annotations(node):
        for name in _named(annotation, module, root):
            where, _, word = name.rpartition(".")
            if name in links:
                continue
            there = address(name)
            if there is None and where and _file(where, root).exists():
                at = found(where, word, root)
                itself = at is not None and (at[0], at[1].name) == (module, node.name)
                target = None if at is None or itself else _places(root).get(f"{at[0]}.{at[1].name}")
                there = f"#{target}" if target else None
            if there is not None:
                links[name] = there
    return links


def _linked(links: Mapping[str, str]) -> str:
    """A line with the types of a signature."""
    shown = (
        f"[`{name if there.startswith('http') else name.rpartition('.')[2]}`]({there})" for name, there in links.items()
    )
    return f"Types: {', '.join(shown)}\n\n" if links else ""


def _signature(node: Node, name: str) -> str:
    if isinstance(node, ast.ClassDef):
        init = next((n for n in node.body if isinstance(n, ast.FunctionDef) and n.name == "__init__"), None)
        if init is None:
            fields = [
                ast.unparse(n) for n in node.body if isinstance(n, ast.AnnAssign) and not _private(n) and _given(n)
            ]
            return f"class {name}({', '.join(fields)})"
        return f"class {name}({_arguments(init, True)})"
    returned = f" -> {ast.unparse(node.returns)}" if node.returns else ""
    return f"{name}({_arguments(node, False)}){returned}"


def _private(node: ast.AnnAssign) -> bool:
    return isinstance(node.target, ast.Name) and node.target.id.startswith("_")


def _given(node: ast.AnnAssign) -> bool:
    """Whether a dataclass's field is an argument of its __init__."""
    words = node.value.keywords if isinstance(node.value, ast.Call) else []
    return not any(word.arg == "init" and ast.unparse(word.value) == "False" for word in words)


def _arguments(node: ast.FunctionDef | ast.AsyncFunctionDef, method: bool) -> str:
    text = ast.unparse(node.args)
    return (
        text.partition(", ")[2] if method and text.partition(",")[0] in ("self", "cls") else text.removeprefix("self")
    )


def _said(node: ast.AST) -> str:
    """A docstring as Markdown: its lines as they are, what is indented as code."""
    text = ast.get_docstring(node) if isinstance(node, Node | ast.Module) else None
    if not text:
        return ""
    return f"```text\n{text}\n```\n"


def reference(module: str, root: Path) -> str:
    """A page with every public name of a module."""
    lines = [f"# Reference: {module}\n"]
    for name in sorted(public(module, root), key=str.lower):
        at = found(module, name, root)
        lines.append(f"({label(module, name, at and at[1])})=\n## {name}\n")
        if at is None:
            lines.append("A value; see its module.\n")
            continue
        where, node = at
        lines.append(
            f"`{where}`\n\n```python\n{_signature(node, name)}\n```\n\n{_linked(types(where, node, root))}{_said(node)}"
        )
        if isinstance(node, ast.ClassDef):
            for part in node.body:
                if isinstance(part, ast.FunctionDef) and not part.name.startswith("_"):
                    marks = {ast.unparse(mark) for mark in part.decorator_list}
                    kind = "property" if marks & {"property", "cached_property", "functools.cached_property"} else ""
                    shown = part.name if kind else f"{part.name}({_arguments(part, True)})"
                    lines.append(f"### {name}.{part.name}\n\n```python\n{shown}\n```\n\n{_said(part)}")
    return "\n".join(lines)
