"""branches.html: the diagram to click on beside the strip's shape there, one file that asks for no other."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from html import escape
from importlib.resources import files

from compare.page.table import Table
from compare.page.verdict import Verdict
from compare.pages.branches.sheets import page_data
from compare.pages.report.html import asset, head, script, table_html
from compare.studies.branches.diagram import Diagram

HTML = "branches.html"


def document(
    diagram: Diagram, verdict: Verdict, sentences: Sequence[str], tables: Sequence[Table], picture: bytes
) -> str:
    """The page; picture: the diagram as PNG, for who runs no scripts."""
    style = asset("report.css") + _own("diagram.css")
    running = script(_own("diagram.js"))
    data = json.dumps(page_data(diagram), allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    title = escape(f"{diagram.scene.title}: branches over {diagram.along.key}")
    still = base64.b64encode(picture).decode()
    said = "".join(f"<li>{escape(sentence)}</li>" for sentence in sentences)
    lines = [
        *head(title, style, running),
        '<body class="branches">',
        f"<header><h1>{title}</h1></header>",
        f'<p class="answer {verdict.grade}">{escape(verdict.line)}</p>',
        '<main><div class="both"><figure id="diagram"><div class="row">',
        '<label>upright <select id="upright"></select></label></div>',
        '<svg id="plot" role="img" aria-label="Bifurcation diagram; the slider beside the shape goes along it"></svg>',
        '<figcaption class="legend">Full: stable, dashed: not; square: fold, circle: branch point (open: not settled), '
        "diamond: fall by rulings, stroke: event; bars: errors. A click shows the strip there.</figcaption></figure>",
        '<figure id="view" class="view"><div class="stage"></div>'
        '<dl id="numbers" aria-live="polite"></dl></figure></div>',
        f'<noscript><p>Turning and choosing need JavaScript.</p><img alt="Bifurcation diagram" width="700" '
        f'src="data:image/png;base64,{still}"></noscript>',
        f'<ul class="verdict">{said}</ul>' if said else "",
        *(f"<h2>{escape(table.title)}</h2>\n{table_html(table)}" for table in tables if table.rows),
        "</main>",
        f'<script type="application/json" id="data">{data}</script>',
        f"<script>{running}</script>",
        "</body>",
        "</html>",
        "",
    ]
    return "\n".join(lines)


def _own(name: str) -> str:
    return files("compare.pages.branches").joinpath("viewer", name).read_text(encoding="utf-8")
