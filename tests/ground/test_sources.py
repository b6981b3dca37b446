"""What belongs to a module (`ribbonbench.sources`), on small trees where every way of importing is written out."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from ribbonbench import sources
from ribbonbench.sources import Sources


def tree(place, texts):
    """A tree of these modules, by their paths; packages get an empty __init__ where none is given."""
    for name, text in texts.items():
        path = place / name
        path.parent.mkdir(parents=True, exist_ok=True)
        for folder in path.parents:
            if folder == place:
                break
            (folder / "__init__.py").touch()
        path.write_text(text)
    return Sources(place)


@pytest.fixture(autouse=True)
def own_memo(tmp_path_factory, monkeypatch):
    """What is read is kept in a folder of this test."""
    monkeypatch.setenv("RIBBONBENCH_CACHE", str(tmp_path_factory.mktemp("cache")))


MODULES = dict.fromkeys(("ribbon/a.py", "ribbon/b.py", "ribbon/deep/c.py", "ribbon/deep/d.py"), "")


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("import ribbon.a", {"ribbon.a"}),
        ("import numpy, ribbon.a as x", {"ribbon.a"}),
        ("from ribbon import a, b", {"ribbon.a", "ribbon.b"}),
        ("from ribbon.deep.c import number", {"ribbon.deep.c"}),
        ("from .a import number", {"ribbon.a"}),
        ("from . import a", {"ribbon.a"}),
        ("from .deep import c", {"ribbon.deep.c"}),
        ("def f():\n    from ribbon import a", {"ribbon.a"}),
        ("class A:\n    def f(self):\n        if 1: import ribbon.a", {"ribbon.a"}),
        ("try:\n    import ribbon.a\nexcept ImportError:\n    import ribbon.b", {"ribbon.a", "ribbon.b"}),
        ("import importlib\nimportlib.import_module('ribbon.a')", {"ribbon.a"}),
        (
            "from importlib import import_module as i, import_module\nimport_module(name='x', package=0) if 0 else 1",
            set(),
        ),
        ("import_module(f'ribbon.deep.{name}')", {"ribbon.deep.c", "ribbon.deep.d"}),
        ("LATER = {'x': 'ribbon.a'}\ndef f(n):\n    return import_module(LATER[n])", {"ribbon.a"}),
        ("PAGE = 'ribbon.a'", set()),
        ("Popen([sys.executable, '-m', 'ribbon.a'])", {"ribbon.a"}),
        ("WORKER = 'ribbon.a'\nPopen([sys.executable, '-m', WORKER, path])", {"ribbon.a"}),
        ("if TYPE_CHECKING:\n    import ribbon.a\nelse:\n    import ribbon.b", {"ribbon.b"}),
        ("if typing.TYPE_CHECKING:\n    import ribbon.a", set()),
        ("'''>>> import ribbon.a'''\n# import ribbon.b", set()),
        ("from ribbon.deep import Name", {"ribbon.deep.c"}),
        ("from ribbon.deep import Other", {"ribbon.deep.c", "ribbon.deep.d"}),
        ("def (", set()),
    ],
)
def test_what_a_module_imports(tmp_path, text, found):
    texts = {
        **MODULES, "ribbon/entry.py": text,
        "ribbon/deep/__init__.py": "from ribbon.deep.c import Name\nfrom ribbon.deep.d import x as Other",
    }  # fmt: skip
    closure = tree(tmp_path, texts).closure("ribbon.entry")
    around = {"ribbon", "ribbon.deep"}
    assert set(closure) - around == {"ribbon.entry"} | found
    assert "ribbon" in closure  # its __init__ is run
    assert ("ribbon.deep" in closure) == any("deep" in name for name in found)


def test_imports_are_followed_and_circles_end(tmp_path):
    texts = {
        "ribbon/a.py": "import ribbon.b", "ribbon/b.py": "import shellref.c", "shellref/c.py": "import ribbon.a",
        "ribbon/d.py": "import ribbon.a",
    }  # fmt: skip
    found = tree(tmp_path, texts).closure("ribbon.a")
    assert set(found) == {"ribbon.a", "ribbon.b", "shellref.c", "ribbon", "shellref"}


def test_what_an_init_imports_belongs_to_it_alone(tmp_path):
    """Its text belongs to all modules of the package; what it imports only to who imports the package itself."""
    texts = {"ribbon/__init__.py": "from ribbon.a import x", "ribbon/a.py": "", "ribbon/b.py": ""}
    known = tree(tmp_path, {**texts, "compare/c.py": "import ribbon", "compare/d.py": "from ribbon import unknown"})
    assert set(known.closure("ribbon.b")) == {"ribbon", "ribbon.b"}
    for name in ("compare.c", "compare.d"):
        assert set(known.closure(name)) == {"compare", name, "ribbon", "ribbon.a"}
    before = known.digest("ribbon.b")
    (tmp_path / "ribbon/__init__.py").write_text("import os; os.environ['X'] = '1'")
    assert Sources(tmp_path).digest("ribbon.b") != before


def test_what_a_package_hands_on_from_elsewhere(tmp_path):
    """A name that a package hands on brings the module that it is from, not what the package imports beside; the
    house's arrows go to the package, which is what is named."""
    texts = {
        "compare/deep/__init__.py": "from compare.names import x\ndef run():\n    from compare.heavy import y",
        "compare/names.py": "x = 1",
        "compare/heavy.py": "y = 1",
        "compare/user.py": "from compare.deep import x",
    }
    found = tree(tmp_path, texts)
    assert {"compare.names"} <= found.closure("compare.user").keys()
    assert "compare.heavy" not in found.closure("compare.user")
    assert found.imports("compare.user") == {"compare.deep"}


def test_data_beside_a_module_belongs_to_it(tmp_path):
    texts = {"ribbon/a.py": "TABLE = Path(__file__).parent / 'table.toml'\nOTHER = 'absent.toml'", "ribbon/b.py": ""}
    known = tree(tmp_path, texts)
    digests = []
    for content in ("x = 1", "x = 2"):
        (tmp_path / "ribbon/table.toml").write_text(content)
        known = Sources(tmp_path)
        assert set(known.closure("ribbon.a")) == {"ribbon", "ribbon.a", "ribbon/table.toml"}
        digests.append((known.digest("ribbon.a"), known.digest("ribbon.b")))
    assert digests[0][0] != digests[1][0]
    assert digests[0][1] == digests[1][1]


def test_a_digest_is_of_the_code(tmp_path):
    """Comments, the words of docstrings and line breaks do not count; all else does, the module's name too."""

    def digest(text, name="ribbon.a"):
        (tmp_path / "ribbon" / f"{name.partition('.')[2]}.py").write_text(text)
        return Sources(tmp_path).digest(name)

    tree(tmp_path, {"ribbon/a.py": ""})
    plain = digest('"""What."""\nx = 1\n')
    assert digest('"""That is it."""\n\nx = (  # one\n    1\n)\n') == plain
    others = [digest(text) for text in ("x = 1\n", '"""What."""\nx = 2\n', "x = (\n", "x = '1'\n")]
    assert len({plain, *others, digest('"""What."""\nx = 1\n', "ribbon.b")}) == 6
    assert digest('"""What."""\nx = 1\n') == plain


def test_an_entry_that_is_not_there_is_said(tmp_path):
    with pytest.raises(ModuleNotFoundError, match=r"ribbon\.nothing"):
        tree(tmp_path, MODULES).digest("ribbon.nothing")
    with pytest.raises(ModuleNotFoundError, match="no_such_module_anywhere"):
        sources.digest("no_such_module_anywhere")


@pytest.mark.parametrize("damage", [b"", b"[1]", b'{"a": ["b"]}', b'{"zz": ["", ""]}', b"\xff"])
def test_a_damaged_memo_is_made_anew(tmp_path, damage):
    known = tree(tmp_path, {"ribbon/a.py": "import ribbon.b", "ribbon/b.py": ""})
    expected = known.digest("ribbon.a")
    (memo,) = Path(os.environ["RIBBONBENCH_CACHE"]).glob("sources-*.json")
    memo.write_bytes(damage)
    assert Sources(tmp_path).digest("ribbon.a") == expected
    assert len(json.loads(memo.read_text())) == 2


def test_a_memo_that_others_can_write_is_not_believed(tmp_path):
    known = tree(tmp_path, {"ribbon/a.py": "import ribbon.b", "ribbon/b.py": ""})
    expected = known.digest("ribbon.a")
    (memo,) = Path(os.environ["RIBBONBENCH_CACHE"]).glob("sources-*.json")
    lies = {key: ["0" * 64, ""] for key in json.loads(memo.read_text())}
    memo.write_text(json.dumps(lies))
    memo.chmod(0o600)
    assert Sources(tmp_path).digest("ribbon.a") != expected  # the lies are what is read
    memo.chmod(0o666)
    assert Sources(tmp_path).digest("ribbon.a") == expected


def test_a_process_digests_once_and_imports_no_solver():
    code = (
        "import sys\n"
        "from ribbonbench import sources\n"
        "assert sources.digest('compare.models.shell') == sources.digest('compare.models.shell')\n"
        "assert {'shellref.worker', 'shellref.kernels.fronts'} <= set(sources.closure('compare.models.shell'))\n"
        "print([name for name in ('ribbon', 'shellref', 'compare', 'numpy', 'numba') if name in sys.modules])\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_the_sources_are_those_that_python_runs(tmp_path):
    """Where a package of ours is taken from elsewhere (a copy put before it), its own files are digested."""
    tree(tmp_path, {"compare/only_here.py": "x = 1"})
    code = "from ribbonbench import sources; print(sources.closure('compare.only_here')['compare.only_here'])"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), str(sources.ROOT)])}
    done = subprocess.run(
        [sys.executable, "-P", "-c", code], capture_output=True, text=True, check=True, env=environment, cwd=tmp_path
    )
    assert done.stdout.strip() == str(tmp_path / "compare" / "only_here.py")


def test_a_model_from_outside_with_modules_of_its_own(tmp_path, monkeypatch):
    """Its own package and what stands beside it, in a folder of its own; where others are installed too, only what is
    of the same distribution."""
    texts = {
        "thread_model/model.py": "from thread_model import law\nimport thread_helper, ribbon.a, thread_stranger",
        "thread_model/law.py": "", "thread_helper.py": "", "thread_stranger.py": "",
    }  # fmt: skip
    tree(tmp_path / "tree", MODULES)
    own = {"thread_model", "thread_model.model", "thread_model.law", "thread_helper"}
    for name in ("folder", "site-packages"):
        place = tmp_path / name
        tree(place, texts)
        (place / "thread_helper.py").write_text("")
        about = place / "thread_for_tests-1.0.dist-info"
        about.mkdir()
        (about / "METADATA").write_text("Metadata-Version: 2.1\nName: thread-for-tests\nVersion: 1.0\n")
        (about / "top_level.txt").write_text("thread_model\nthread_helper\n")
        with monkeypatch.context() as patch:
            patch.syspath_prepend(str(place))
            found = Sources(tmp_path / "tree")
            closure = found.closure("thread_model.model")
            more = {"thread_stranger"} if name == "folder" else set()
            assert set(closure) == own | more | {"ribbon", "ribbon.a"}
            assert found.others(closure) == {"thread_stranger"} - more
            before = found.digest("thread_model.model")
            (place / "thread_helper.py").write_text("x = 1")
            assert Sources(tmp_path / "tree").digest("thread_model.model") != before
