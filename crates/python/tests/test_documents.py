"""What the documents show runs."""

import re
from pathlib import Path

import numpy as np
import pytest

import radwalk
from conftest import CONFIGS, FACES, VERTICES

ROOT = CONFIGS.parent


@pytest.mark.filterwarnings("ignore::radwalk.Doubt")
@pytest.mark.parametrize("page", ["crates/python/README.md", "docs/guide/python.md"])
def test_python_blocks_run(page, tmp_path, monkeypatch):
    """The blocks of a page, one after the other, in a folder that has `configs`."""
    trimesh = pytest.importorskip("trimesh")
    pytest.importorskip("pyvista")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "configs").symlink_to(CONFIGS)
    given = {
        "vertices": VERTICES,
        "faces": FACES,
        "names": ["lamp"] * 2 + ["wall"] * 10,
        "mesh": trimesh.Trimesh(VERTICES, FACES, process=False),
        "per_face": np.where(np.arange(12) < 2, 100.0, 0.0),
    }
    blocks = re.findall(r"^```python\n(.*?)^```$", (ROOT / page).read_text(), flags=re.MULTILINE | re.DOTALL)
    assert blocks
    for block in blocks:
        exec(block, given)
    assert isinstance(given["result"], radwalk.Result)
