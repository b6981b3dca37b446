"""docs/tutorials/researchers.md: the files of the page, in a copy of the package, pass the tests of the page.

The other tutorials are blocks that run as they stand (`tests/test_docs.py`).
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys

from tests.docs_blocks import DOCS, ROOT, blocks
from tests.patience import PATIENCE
from tests.test_docs_extend import hunks, patched

PAGE = (DOCS / "tutorials" / "researchers.md").read_text()


def test_the_energy_of_the_page_passes_the_tests_of_the_page(tmp_path):
    """numba's compiler off: few segments, no compilation."""
    root = tmp_path / "copy"
    for package in ("ribbonbench", "ribbon", "compare", "shellref"):
        shutil.copytree(ROOT / package, root / package, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", root)
    written, changed = [], []
    for block in blocks(PAGE):
        if block.file:
            path = root / block.file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(block.text)
            written.append(block.file)
        elif block.info == "diff":
            name, changes = hunks(block.text)
            for hunk in changes:
                (root / name).write_text(patched((root / name).read_text(), hunk, name))
            changed.append(name)
    (test,) = (name for name in written if name.startswith("tests/"))
    assert len(written) == 2
    assert changed
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "OMP_NUM_THREADS": "1", "PYTHONPATH": str(root)}
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-v", "-p", "no:cacheprovider", "-p", "no:randomly", test],
        cwd=root, env=environment, capture_output=True, text=True, timeout=PATIENCE,
    )  # fmt: skip
    assert done.returncode == 0, (done.stdout + done.stderr)[-3000:]
    found = re.search(r"(\d+) passed", done.stdout)
    assert found, done.stdout
    assert int(found[1]) == PAGE.count("\ndef test_")
