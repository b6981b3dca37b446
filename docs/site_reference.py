"""The reference of the public names, from signatures and docstrings; the sources are read, nothing is imported."""

from __future__ import annotations

import ast
from pathlib import Path

#: The modules whose `__all__` is public.
MODULES = ("ribbon", "shellref", "compare.check")

Node = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef


def _file(module: str, root: Path) -> Path:
    path = root.joinpath(*module.split("."))
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


def public(module: str, root: Path) -> list[str]:
    """The names in a module's `__all__`."""
    for node in ast.parse(_file(module, root).read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign) and any(isinstance(t, ast.Name) and t.id == "__all__" for t in node.targets):
            return [str(name) for name in ast.literal_eval(node.value)]
    raise ValueError(f"{module} has no __all__")


def found(module: str, name: str, root: Path) -> tuple[str, Node] | None:
    """Where a name is defined, and its definition; None: it is a value."""
    parsed = ast.parse(_file(module, root).read_text(encoding="utf-8"))
    for node in ast.walk(parsed):
        if isinstance(node, Node) and node.name == name:
            return module, node
    for node in ast.walk(parsed):
        if isinstance(node, ast.ImportFrom) and node.module and not node.level:
            for alias in node.names:
                if (alias.asname or alias.name) == name and _file(node.module, root).exists():
                    return found(node.module, alias.name, root)
    return None


def _signature(node: Node, name: str) -> str:
    if isinstance(node, ast.ClassDef):
        init = next((n for n in node.body if isinstance(n, ast.FunctionDef) and n.name == "__init__"), None)
        if init is None:
            fields = [ast.unparse(n) for n in node.body if isinstance(n, ast.AnnAssign) and not _private(n)]
            return f"class {name}({', '.join(fields)})"
        return f"class {name}({_arguments(init, True)})"
    returned = f" -> {ast.unparse(node.returns)}" if node.returns else ""
    return f"{name}({_arguments(node, False)}){returned}"


def _private(node: ast.AnnAssign) -> bool:
    return isinstance(node.target, ast.Name) and node.target.id.startswith("_")


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
        lines.append(f"## {name}\n")
        if at is None:
            lines.append("A value; see its module.\n")
            continue
        where, node = at
        lines.append(f"`{where}`\n\n```python\n{_signature(node, name)}\n```\n\n{_said(node)}")
        if isinstance(node, ast.ClassDef):
            for part in node.body:
                if isinstance(part, ast.FunctionDef) and not part.name.startswith("_"):
                    marks = {ast.unparse(mark) for mark in part.decorator_list}
                    kind = "property" if marks & {"property", "cached_property", "functools.cached_property"} else ""
                    shown = part.name if kind else f"{part.name}({_arguments(part, True)})"
                    lines.append(f"### {name}.{part.name}\n\n```python\n{shown}\n```\n\n{_said(part)}")
    return "\n".join(lines)
