"""`ribbonbench live` without a browser: who is answered, what nonsense does, which value is solved, what is kept."""

from __future__ import annotations

import base64
import json
import shlex
import socket
import threading
import time

import numpy as np
import pytest

from compare.models import solve
from compare.pages.live.server import Job, Queue, read_json
from compare.scene.scene import load
from tests.compare.live.served import Served
from tests.patience import PATIENCE

TITLE = '</title><script>window.evil = 1</script>"&'
SCENE = f"""
title = {json.dumps(TITLE)}
[strip]
length = 1.0
width = 0.05
poisson = 0.3
gamma = 5.0
[gravity]
up = [0.0, 0.0, 1.0]
[clamp.start]
position = [0.0, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[clamp.end]
position = [0.85, 0.0, 0.0]
tangent = [1.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[seed]
curvature = [5.0, -5.0, 5.0]
[model]
elements = 16
[shell]
width_to_thickness = 100.0
elements = [16, 2]
"""


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    folder = tmp_path_factory.mktemp("live")
    (folder / "arch.toml").write_text(SCENE)
    with Served("arch.toml", folder) as found:
        yield found
    assert found.code == 0
    assert "Traceback" not in (folder / "stderr").read_text()


@pytest.fixture
def tab(served):
    return served.ask("begin")["tab"]


def test_only_the_token_opens_the_page(served):
    status, headers, content = served.request("GET", f"/{served.token}/")
    assert status == 200
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert headers["Referrer-Policy"] == "no-referrer"
    assert headers["Cache-Control"] == "no-store"
    assert len(served.token) >= 32
    for path in ("/", f"/{served.token}", f"/{served.token}x/", f"/{served.token[:-1]}/", "/x/", f"/{served.token}/a"):
        refused = served.request("GET", path)
        assert refused[0] == 404, path
        assert served.token.encode() not in refused[2]
    assert served.request("POST", "/x/begin", b"{}")[0] == 404
    assert served.request("POST", f"/{served.token}/other", b"{}")[0] == 404
    assert served.request("PUT", f"/{served.token}/begin", b"{}")[0] == 501
    assert content.count(b"<script>") == 1
    assert b"&lt;/title&gt;&lt;script&gt;" in content


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1", "localhost:1", "", None])
def test_no_other_name_of_this_machine_is_answered(served, host):
    """A name that somebody points to 127.0.0.1 (DNS rebinding) is no way in, be the token known."""
    assert served.request("GET", f"/{served.token}/", Host=host)[0] == 403
    assert served.request("POST", f"/{served.token}/begin", b"{}", Host=host)[0] == 403


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "https://127.0.0.1", None])
def test_no_other_page_is_answered(served, origin):
    assert served.request("POST", f"/{served.token}/begin", b"{}", Origin=origin)[0] == 403


def test_localhost_is_this_machine_too(served):
    host = f"localhost:{served.port}"
    assert served.request("GET", f"/{served.token}/", Host=host)[0] == 200
    assert served.request("POST", f"/{served.token}/begin", b"{}", Host=host, Origin=f"http://{host}")[0] == 200


@pytest.mark.parametrize(
    ("body", "headers", "status"),
    [
        (b"{", {}, 400), (b"[]", {}, 400), (b"\xff", {}, 400), (b'{"tab": 3}', {}, 400), (b"", {}, 400),
        (b'{"values": {"strip.gamma": NaN}}', {}, 400), (b"[" * 60_000, {}, 400),
        (b"{}", {"Content-Type": "text/plain"}, 415), (b"{}", {"Content-Length": "-1"}, 411),
        (b"{}", {"Content-Length": None}, 411), (b"{}", {"Content-Length": "99999999"}, 413),
    ],
)  # fmt: skip
def test_bodies_that_are_none(served, body, headers, status):
    assert served.request("POST", f"/{served.token}/move", body, **headers)[0] == status


def test_it_listens_on_this_machine_alone(served):
    """Addresses of the loopback net beside 127.0.0.1 are other addresses of this machine."""
    with pytest.raises(OSError), socket.create_connection(("127.0.0.2", served.port), timeout=5):
        pass


def test_the_first_state_is_that_of_solve(served):
    begun = served.ask("begin")
    found = solve(load(served.folder / "arch.toml").replace({"model.formulation": "mixed"}))
    assert begun["numbers"]["energy.total"] == pytest.approx(found.energy.total, rel=1e-9)
    assert begun["ok"]
    names = [one["name"] for one in begun["sliders"]]
    assert {"strip.gamma", "strip.width", "strip.natural_curvature", "clamp.end.position.0"} <= set(names)
    assert {"clamp.end.turn.2", "shell.width_to_thickness"} <= set(names)
    assert all(one["low"] <= one["value"] <= one["high"] for one in begun["sliders"])


def test_a_move_is_the_solve_of_the_scene_and_is_taken_back(served, tab):
    before = served.ask("begin", tab)
    values = {"strip.gamma": 8.0, "strip.width": 0.06, "strip.natural_curvature": 0.5, "clamp.end.position.0": 0.82}
    moved = served.ask("move", tab, values=values, gesture=1)
    scene = load(served.folder / "arch.toml").replace(
        {
            "strip.gamma": 8.0, "strip.width": 0.06, "strip.natural_curvature": 0.5,
            "clamp.end.position": [0.82, 0.0, 0.0], "model.formulation": "mixed",
        }
    )  # fmt: skip
    found = solve(scene)
    assert moved["reached"] == 1.0
    assert moved["numbers"]["energy.total"] == pytest.approx(found.energy.total, rel=1e-8)
    assert moved["numbers"]["force.end.x"] == pytest.approx(found.supports.end.force[0], rel=1e-6)
    served.ask("move", tab, values={**values, "strip.gamma": 9.0}, gesture=1)  # the same gesture
    back = served.ask("back", tab)
    assert back["numbers"] == before["numbers"]
    assert back["values"] == before["values"]
    assert "nothing to take back" in served.ask("back", tab)["refused"]


@pytest.mark.parametrize(
    ("values", "key"),
    [
        ({"strip.gamma": None}, "strip.gamma"), ({"strip.gamma": "7"}, "strip.gamma"),
        ({"strip.gamma": True}, "strip.gamma"), ({"strip.gamma": -1.0}, "strip.gamma"),
        ({"strip.gamma": 1e300}, "strip.gamma"), ({"strip.width": 2.0}, "strip.width"),
        ({"strip.poisson": 0.7}, "strip.poisson"), ({"clamp.end.position.0": 1.5}, "clamp.end.position"),
        ({"title": 1.0}, "title"), ({"model.elements": 5}, "model.elements"), ([1.0], "values"), (None, "values"),
    ],
)  # fmt: skip
def test_nonsense_is_refused_by_name_and_nothing_moves(served, tab, values, key):
    before = served.ask("begin", tab)
    assert served.ask("move", tab, values=values, gesture=1)["refused"].startswith(key)
    after = served.ask("begin", tab)
    assert (after["numbers"], after["values"], after["undo"]) == (before["numbers"], before["values"], 0)


def test_where_a_way_ends_is_said_and_the_strip_stands_there(served, tab):
    """The clamps all but as far apart as the strip is long, the end at a right angle to that: no strip does it."""
    values = {"clamp.end.position.0": 0.9999, "clamp.end.turn.2": 90.0}
    moved = served.ask("move", tab, values=values, gesture=1)
    assert 0.0 <= moved["reached"] < 1.0
    assert moved["why"]
    assert moved["ok"]
    r = moved["reached"]
    assert moved["values"]["clamp.end.position.0"] == pytest.approx(0.85 + r * 0.1499)
    assert moved["values"]["clamp.end.turn.2"] == pytest.approx(90.0 * r)
    calm = served.ask("move", tab, values={}, gesture=2)
    assert calm["reached"] == 1.0


def test_what_takes_longer_is_told_when_the_hand_rests(served, tab):
    served.ask("move", tab, values={"strip.gamma": 6.0}, gesture=1)
    told = served.ask("judge", tab)
    assert told["grade"] in ("good", "fair", "poor", "unknown")
    assert "equilibrium" in told["verdict"]
    assert told["ratio"] == 100.0
    assert "w/h = 100" in told["estimate"]
    assert told["doubt"] == ""


def test_a_jump_is_told_another_state_is_a_doubt_and_what_is_kept_leads_back(served, tab):
    """The end of an arch is turned until the arch snaps to the other side, and back: the scene is the first one, its
    seed leads to the first state."""
    first = served.ask("begin", tab)["numbers"]
    moves = [
        served.ask("move", tab, values={"clamp.end.turn.1": turn}, gesture=gesture)
        for gesture, turn in enumerate((20.0, 40.0, 55.0, 40.0, 20.0, 0.0), start=1)
    ]
    here = moves[-1]["numbers"]
    assert [bool(moved["jumps"]) for moved in moves] == [False, False, True, False, False, False]
    assert first["middle.z"] < -0.2 < 0.2 < here["middle.z"]
    assert "Another state is near" in served.ask("judge", tab)["doubt"]
    kept = served.ask("keep", tab)
    scene = load(served.folder / kept["file"])
    again = solve(scene)
    assert kept["same"]
    assert again.energy.total == pytest.approx(here["energy.total"], rel=1e-8)
    assert again.middle.position[2] == pytest.approx(here["middle.z"], abs=1e-6)
    assert scene.title == TITLE
    words = shlex.split(kept["command"])
    assert words == ["ribbonbench", "solve", kept["file"]]
    assert served.ask("keep", tab)["file"] != kept["file"]
    for _ in range(4):
        back = served.ask("back", tab)
    assert back["numbers"] == moves[1]["numbers"]


def test_a_shell_is_solved_beside_it_while_the_hand_goes_on(served, tab):
    served.ask("move", tab, values={"clamp.end.position.0": 0.8}, gesture=1)
    begun = served.ask("lay", tab)
    assert (begun["running"], begun["ratio"]) == (True, 100.0)
    assert "already" in served.ask("lay", tab)["refused"]
    moved = served.ask("move", tab, values={"clamp.end.position.0": 0.79}, gesture=2)
    assert moved["reached"] == 1.0
    end = time.monotonic() + PATIENCE
    while (found := served.ask("laid", tab)).get("running"):
        assert time.monotonic() < end
        time.sleep(0.2)
    assert "w/h = 100" in found["text"]
    assert [one["ratio"] for one in found["view"]["surfaces"]] == [None, 100.0]
    kept = json.loads((served.folder / found["folder"] / "result.json").read_text())
    there = solve(load(served.folder / "arch.toml").replace({"clamp.end.position": [0.8, 0.0, 0.0]}))
    assert kept["energy"]["total"] == pytest.approx(there.energy.total, rel=1e-6)
    assert 0.0 < kept["rows"][0]["hausdorff"] < 0.1
    assert served.ask("laid", tab) == {"running": False}


def test_what_was_seen_is_a_film(served, tab):
    assert "nothing has moved" in served.ask("film", tab)["refused"]
    for k in range(4):
        served.ask("move", tab, values={"strip.gamma": 6.0 + k}, gesture=k)
    film = served.ask("film", tab)
    content = (served.folder / film["file"]).read_bytes()
    length = int.from_bytes(content[12:16], "little")
    document = json.loads(content[20 : 20 + length])
    assert film["surfaces"] == 5
    assert len(document["meshes"][0]["primitives"][0]["targets"]) == 4
    times = document["accessors"][document["animations"][0]["samplers"][0]["input"]]
    assert times["min"] == [0.0]
    assert 4 / 60 - 1e-6 <= times["max"][0] <= 4 * 0.4 + 1e-6  # single precision
    assert document["nodes"][0]["name"] == TITLE


def test_tabs_do_not_meddle_and_come_back(served):
    one, other = served.ask("begin")["tab"], served.ask("begin")["tab"]
    assert one != other
    moved = served.ask("move", one, values={"strip.gamma": 7.0}, gesture=1)
    assert served.ask("begin", other)["values"]["strip.gamma"] == 5.0
    assert served.ask("begin", one)["numbers"] == moved["numbers"]
    assert "unknown" in served.ask("move", "nobody", values={}, gesture=1)
    begun = served.ask("begin", "nobody", values={"strip.gamma": 7.0})
    assert begun["numbers"]["energy.total"] == pytest.approx(moved["numbers"]["energy.total"], rel=1e-8)
    assert begun["tab"] not in ("nobody", one, other)


def test_many_values_at_once_end_at_the_newest(served, tab):
    """Values that come while one is solved: all are answered, and the strip stands at the last."""
    answers = {}

    def ask(k):
        answers[k] = served.ask("move", tab, values={"strip.gamma": 5.0 + 0.01 * k}, gesture=1)

    threads = [threading.Thread(target=ask, args=(k,)) for k in range(12)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    solved = [a for a in answers.values() if "dropped" not in a]
    assert len(answers) == 12
    assert len(solved) >= 1
    end = served.ask("move", tab, values={"strip.gamma": 6.0}, gesture=1)
    assert served.ask("begin", tab)["values"]["strip.gamma"] == 6.0
    assert end["undo"] == 1


def test_the_newest_value_of_a_tab_is_taken_and_the_older_ones_are_dropped():
    queue = Queue()
    jobs = [Job("move", "a", {"k": k}) for k in range(5)]
    other, judge, later, keep = Job("move", "b", {}), Job("judge", "a", {}), Job("judge", "a", {}), Job("keep", "a", {})
    for job in (judge, *jobs[:3], other, *jobs[3:], keep, later):
        queue.put(job)
    assert [job.answer for job in jobs[:4]] == [{"dropped": True}] * 4
    assert judge.answer == {"dropped": True}
    assert queue.hurried
    assert [queue.take(0.0) for _ in range(5)] == [jobs[4], other, keep, later, None]
    assert not queue.hurried
    left = Job("move", "a", {})
    queue.put(left)
    queue.close()
    assert "gone" in left.answer
    late = Job("move", "a", {})
    queue.put(late)
    assert "gone" in late.answer


@pytest.mark.parametrize("text", [b"NaN", b"Infinity", b'{"a": -Infinity}', b"3", b"", b"\x80"])
def test_what_is_no_json_object(text):
    with pytest.raises(ValueError):
        read_json(text)


def test_a_scene_without_an_equilibrium_says_so_in_the_page(tmp_path):
    (tmp_path / "arch.toml").write_text(SCENE)
    with Served("arch.toml", tmp_path, "--set", "model.budget=1e-9") as served:
        assert "no equilibrium to begin with" in served.ask("begin")["refused"]
        assert served.request("GET", f"/{served.token}/")[0] == 200
    assert served.code == 0


def test_walls_are_drawn_and_go_with_their_sliders(tmp_path):
    from compare.pages.live.desk import Beginning, Desk

    scene = load("roman_plate")
    begun = Beginning.of(scene, scene.units)
    desk = Desk(begun, tmp_path, str)
    once, told = desk.once(), desk.told()
    assert [one["kind"] for one in once["view"]["surfaces"]] == ["ribbon", "wall", "wall"]
    assert len(told["walls"]) == 2
    own = {one.name: one.value for one in begun.sliders}
    moved = desk.moved({**own, "wall.1.offset": 0.002}, 1)
    assert moved["walls"][1] != told["walls"][1]
    roof = np.frombuffer(base64.b64decode(moved["walls"][1]), "<f4").reshape(-1, 3)
    apart = (roof - np.array(begun.scene.walls[1].point)) @ np.array(begun.scene.wall_normals[1])
    assert apart == pytest.approx(0.002 + desk.now.state.native.walls[1].height, abs=1e-6)


def test_an_energy_that_is_chosen_stays(tmp_path):
    from compare.pages.live.desk import Beginning
    from compare.scene.scene import loads

    scene = loads(SCENE.replace("poisson = 0.3", "poisson = 0.3\nthickness = 1e-3"))
    assert scene.model.accuracy is not None
    begun = Beginning.of(scene, scene.units)
    assert begun.scene.model.accuracy is None
    assert begun.scene.model.energy in ("sadowsky", "wunderlich", "finite")
    assert begun.state.native.problem.energy == begun.scene.model.energy
    assert any("is chosen, and stays" in note for note in begun.notes)
