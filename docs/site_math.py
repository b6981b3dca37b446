"""Formulas as MathML in the built pages: browsers show it by themselves, without a script."""

from __future__ import annotations

import html
import re
from typing import Any

_TAG = re.compile(r"\\tag\{([^}]*)\}")


def mathml(tex: str, block: bool) -> str:
    """A formula; where it cannot be converted, its source."""
    from latex2mathml.converter import convert

    try:
        return str(convert(tex, display="block" if block else "inline"))
    except Exception:  # the converter raises many kinds
        return f"<code>{html.escape(tex)}</code>"


def _inline(writer: Any, node: Any) -> None:
    from docutils import nodes

    writer.body.append(mathml(node.astext(), False))
    raise nodes.SkipNode


def _block(writer: Any, node: Any) -> None:
    from docutils import nodes

    tex = node.astext()
    tags = _TAG.findall(tex)
    label = f'<span class="eqno">({html.escape(tags[0])})</span>' if tags else ""
    writer.body.append(f'<div class="math">{label}{mathml(_TAG.sub("", tex), True)}</div>\n')
    raise nodes.SkipNode


def setup_math(app: Any) -> None:
    """Registers the renderer "mathml" with Sphinx."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
