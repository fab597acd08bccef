"""What the tests of GPU code share: a folder of shaders."""

from collections.abc import Callable
from pathlib import Path

import pytest

from depthwalk.gpu import shader_source


@pytest.fixture
def shaders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Path]:
    """Writes files below a folder that stands for `shaders/`."""
    root = tmp_path / "shaders"
    root.mkdir()
    monkeypatch.setattr(shader_source, "shader_root", lambda: root)

    def write(**texts: str) -> Path:
        for name, text in texts.items():
            (root / f"{name}.glsl").write_text(text)
        return root

    return write
