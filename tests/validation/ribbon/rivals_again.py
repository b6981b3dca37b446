"""The promise of the probe (`rivals`) on four hundred scenes more, drawn by the same generator behind those.

The probe's constants were chosen on the first two hundred and are frozen since; nothing here is fitted. Row by row is
kept, a run takes its share of the time, and the next goes on; the page says how many were run, in order.
"""

from __future__ import annotations

import json
import time
from functools import partial
from pathlib import Path
from typing import Any

from compare.battery.cases.seeds import BESIDE, SAME, answer, energy, random_clamps
from tests.validation import page
from tests.validation.kept_rows import KeptRows
from tests.validation.number import Number
from tests.validation.ribbon.rivals import FRESH, above, finer, interval, others, remains, said

#: Numbers of the scenes; seconds of the processor after which none is begun.
AGAIN, SECONDS = range(400, 800), 600.0
PROBED = (401, 440)
READS = ("data/rivals.json",)


def measured(number: int) -> dict[str, Any]:
    """A scene: what solve returns, and the lowest that four random starts end in."""
    own = answer(random_clamps(number))
    ended = [one for one in others(number) if one.ok]
    best = min(ended, key=energy, default=own)
    lost = own.ok and above(energy(own), energy(best))
    return {
        "number": number, "ok": own.ok, "energy": energy(own), "random": energy(best) if ended else None,
        "finer": [finer(own), finer(best)] if lost else None,
    }  # fmt: skip


def _energy(number: int) -> float:
    return energy(answer(random_clamps(number)))


PROBES = {f"energy_{number}": partial(_energy, number) for number in PROBED}


def rows_of(out: Path, most: int | None = None) -> list[dict[str, Any]]:
    """Rows in order, those that are kept and as many more as the time allows."""
    kept = KeptRows.of(
        out.parent / "out" / "validate" / "rivals_again", "compare.battery.cases.seeds", "compare.models"
    )
    began, rows = time.process_time(), []
    for number in AGAIN[:most]:
        if not kept.has(str(number)) and time.process_time() - began > SECONDS:
            break
        rows.append(kept.row(str(number), partial(measured, number)))
        if number % 20 == 19:
            print(f"  rivals again: {len(rows)} scenes", flush=True)
    return rows


def run(out: Path, most: int | None = None) -> dict[str, Number]:
    """Writes rivals_again.md; its numbers by name. most: scenes to run, all by default."""
    rows = rows_of(out, most)
    before = json.loads((out / READS[0]).read_text(encoding="utf-8"))["numbers"]
    lost = [row for row in rows if row["random"] is not None and row["ok"] and above(row["energy"], row["random"])]
    bad = [row["number"] for row in rows if not row["ok"]]
    old = int(before["fresh_above"]["value"]), int(before["fresh_scenes"]["value"])
    counts = {"again": (len(lost), len(rows)), "both": (len(lost) + old[0], len(rows) + old[1])}
    names = {"again": "these", "both": f"with scenes {FRESH[0]} to {FRESH[-1]}, not looked at before either"}
    lines, found = [], {}
    for key, (count, of) in counts.items():
        low, high = interval(count, of)
        lines.append(
            [names[key], str(of), str(count), f"{100 * count / of:.1f} %", f"{100 * low:.1f} to {100 * high:.1f} %"]
        )
        found |= {f"{key}_scenes": Number(of, 0, shown="d"), f"{key}_above": Number(count, 0, shown="d")}
        found |= {f"{key}_{end}": Number(100.0 * x, 0, "%", ".1f") for end, x in (("low", low), ("high", high))}
    page.write(
        out / "rivals_again.md", "A random start against solve, on scenes drawn again",
        "python -m tests.validation rivals_again",
        f"Scenes {AGAIN[0]} to {AGAIN[-1]} of `compare.battery.cases.seeds.random_clamps`, behind those of "
        f"[rivals](rivals.md), drawn and asked in the same way: `solve` without a seed, {BESIDE} random starts beside "
        f"it, counted where one of them is lower by more than {SAME:g} (relative, at least 1). The probe's constants "
        f"were frozen before any of them was looked at. Of {len(AGAIN)} {len(rows)} were run so far, in this order; "
        "none is left out, and a run ends by its time, not by what it found. Interval: Clopper and Pearson's, 95 %.",
        page.table(["scenes", "count", "above", "share", "interval"], lines),
        f"Of the {len(lost)} scenes where a random start is lower, {sum(map(remains, lost))} keep a difference above "
        "what the last halving of the elements changed: " + ("; ".join(map(said, lost)) or "none") + ".",
        f"Without an answer: {', '.join(map(str, bad)) or 'none'}. That a state is the lowest of those seen is no "
        "proof.",
    )  # fmt: skip
    by = {row["number"]: row["energy"] for row in rows}
    probed = {f"energy_{n}": Number(by[n], 1e-6 * abs(by[n]), "D w / l", ".6g") for n in PROBED if n in by}
    return found | {"remain": Number(sum(map(remains, lost)), 0, shown="d")} | probed
