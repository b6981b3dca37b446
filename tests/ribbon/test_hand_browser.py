"""The widget's script in Chromium, its model without a notebook: sliders ask, what comes back is drawn."""

from __future__ import annotations

import base64
import json

import pytest

from ribbon import Clamp, Gravity, Session, Strip
from ribbon.shown import hand
from tests.compare.report.browser import CHROMIUM, Browser

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium (Debian: chromium)")

#: A model as anywidget's: its values, who listens, and what was saved.
PAGE = """<!DOCTYPE html><meta charset=utf-8><div id="el"></div><script type="module">
const bytes = (text) => new DataView(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
const known = { ...GIVEN, places: bytes(GIVEN.places) }, listeners = {};
window.saved = [];
const model = {
  get: (name) => known[name],
  set: (name, value) => { known[name] = value; },
  save_changes: () => { window.saved.push(structuredClone(known.values)); },
  on: (event, action) => { (listeners[event] ||= []).push(action); },
};
window.tell = (name, value) => {
  known[name] = name === "places" ? bytes(value) : value;
  for (const action of listeners[`change:${name}`] || []) action();
};
const url = URL.createObjectURL(new Blob([SCRIPT], { type: "text/javascript" }));
const { default: widget } = await import(url);
widget.render({ model, el: document.getElementById("el") });
window.ready = true;
</script>"""


def test_a_slider_asks_and_the_answer_is_drawn(tmp_path):
    session = Session(Strip(1.0, 0.05, 0.3, gamma=5.0), Clamp(), Gravity((0.0, 1.0, 0.0)), segments=12)
    own = hand.sliders(session)
    values = {one.name: one.value for one in own}
    grid, places = hand.places(session)
    given = {
        "sliders": [one.to_dict() for one in own], "values": values, "reached": values, "grid": grid,
        "places": base64.b64encode(places).decode(), "text": hand.told(session),
    }  # fmt: skip
    page = tmp_path / "hand.html"
    page.write_text(
        PAGE.replace("GIVEN", json.dumps(given)).replace("SCRIPT", json.dumps(hand._SCRIPT).replace("<", "\\u003c"))
    )
    with Browser(tmp_path / "profile") as browser:
        browser.open(page)
        browser.until("window.ready === true")
        browser.until("document.querySelector('p').textContent.startsWith('converged')")
        drawn = "document.querySelector('canvas').toDataURL().length"
        first = browser.run(drawn)
        assert browser.run("document.querySelectorAll('input').length") == len(own)
        input_ = "document.querySelector('input')"
        browser.run(f"{input_}.value = 12; {input_}.dispatchEvent(new Event('input'))")
        assert browser.run("window.saved.at(-1)")["gamma"] == pytest.approx(12.0, abs=0.05)
        hand.move(session, {"gamma": 12.0})
        moved = base64.b64encode(hand.places(session)[1]).decode()
        browser.run(f"window.tell('text', {json.dumps(hand.told(session))})")
        browser.run(f"window.tell('places', {json.dumps(moved)})")
        assert browser.run("document.querySelector('p').textContent") == hand.told(session)
        assert browser.run(drawn) != first
        browser.run("window.tell('reached', { gamma: 3, 'natural curvature': 0 })")
        assert float(browser.run("document.querySelector('input').value")) == pytest.approx(3.0, abs=0.05)
        assert browser.complaints() == []
