"""The page of a strip in the hand: one document with its own style and script, and a policy that allows no other."""

from __future__ import annotations

import base64
import hashlib
from html import escape
from importlib.resources import files

from compare.scene.scene import Scene

#: The viewer of the reports in order, and what is this page's own.
_VIEWER = ("maths.js", "paint.js", "view.js", "controls.js")


def document(scene: Scene) -> tuple[bytes, dict[str, str]]:
    """The page of a scene, and the headers to send with it."""
    style = _report("report.css") + _own("live.css")
    parts = "".join(map(_report, _VIEWER)) + _own("live.js")
    script = f'(function () {{\n"use strict";\n{parts}}})();\n'
    title = escape(scene.title)
    lines = [
        "<!DOCTYPE html>",
        '<html lang="en">',
        "<head>",
        '<meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        '<link rel="icon" href="data:,">',
        f"<title>{title}: live</title>",
        f"<style>{style}</style>",
        "</head>",
        '<body class="live">',
        f"<header><h1>{title}</h1></header>",
        '<p class="answer" id="verdict" role="status">The strip is solved for the first time.</p>',
        '<p class="said" id="said" role="alert" hidden></p>',
        '<main class="hand"><div id="left"><figure id="view"><div class="stage"></div></figure>',
        '<figure id="curve"><div class="row"><label>against it <select id="against"></select></label>',
        '<button type="button" id="clear">clear</button></div>',
        '<canvas id="plot" role="img" aria-label="A number of the strip against the slider that moves"></canvas>',
        "</figure></div>",
        '<div id="right"><div id="sliders" role="group" aria-label="numbers of the scene"></div>',
        '<div class="row" id="buttons"><button type="button" id="undo" disabled>undo</button>',
        '<button type="button" id="reset">as the scene</button><button type="button" id="keep">keep</button>',
        '<button type="button" id="shell">shell</button><button type="button" id="film">film</button></div>',
        '<p id="beside" class="told"></p>',
        '<p id="estimate" class="told"></p><p id="doubt" class="told"></p><dl id="rows"></dl>',
        '<p id="time" class="note"></p><div id="kept"></div><ul id="notes" class="note"></ul></div></main>',
        "<noscript>This page needs JavaScript.</noscript>",
        f"<script>{script}</script>",
        "</body>",
        "</html>",
        "",
    ]
    policy = (
        f"default-src 'none'; script-src {_digest(script)}; style-src {_digest(style)}; img-src data:; "
        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
    return "\n".join(lines).encode(), {"Content-Security-Policy": policy}


def _digest(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def _report(name: str) -> str:
    return files("compare.pages.report").joinpath("viewer", name).read_text(encoding="utf-8")


def _own(name: str) -> str:
    return files("compare.pages.live").joinpath("viewer", name).read_text(encoding="utf-8")
