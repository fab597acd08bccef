"""When the compiled loops are loaded, and what serves where they cannot be."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from depthwalk.kernels import compiled_code
from depthwalk.render import kernels

FILES = Path(kernels.__file__).parent


def test_loaded_behind_frames(tmp_path: Path) -> None:
    """A first start compiles in another process, and the loops then come from the cache."""
    code = (
        "import gc; from depthwalk.render import kernels; kernels.load_behind().join();"
        "print(kernels.loaded() is not None and gc.isenabled())"
    )
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "True"
    assert kernels.load()
    assert (compiled_code.folder(FILES) / "complete").is_file()


def test_cache_that_cannot_be_written(tmp_path: Path) -> None:
    """NumPy then serves, and a warning names the folder."""
    (tmp_path / "file").touch()
    code = """
import logging
from depthwalk.render import kernels
logging.basicConfig()
kernels.load_behind().join()
print(kernels.load(), kernels.loaded())
"""
    home = {"PYTHONPATH": os.pathsep.join(sys.path), "XDG_CACHE_HOME": str(tmp_path / "file"), "HOME": str(tmp_path)}
    run = [sys.executable, "-c", code]
    done = subprocess.run(run, env=os.environ | home, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "None"]
    assert done.stderr.count("compiled") >= 1 and "Traceback" not in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_numpy_serves_without_numba(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernels, "available", lambda: False)
    assert not kernels.load()
    kernels._load_behind()
    assert kernels.loaded() is None
