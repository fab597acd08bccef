"""Where the files that travel with the program are: inside the wheel, or beside `app/` in a checkout."""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def data_root() -> Path:
    """The folder that holds `shaders`, `scenes` and `assets`.

    Raises FileNotFoundError where the installation is incomplete.
    """
    for root in (_PACKAGE / "_data", _PACKAGE.parent.parent):
        if (root / "shaders").is_dir():
            return root
    raise FileNotFoundError(f"depthwalk: no shaders beside {_PACKAGE}; the installation is incomplete")


def shader_root() -> Path:
    """The shaders, a folder per pass. Raises FileNotFoundError."""
    return data_root() / "shaders"


def scene_root() -> Path:
    """The shipped scenes, with `paths` through them. Raises FileNotFoundError."""
    return data_root() / "scenes"


def asset_root() -> Path:
    """Meshes and textures of the shipped scenes; every scene may name them. Raises FileNotFoundError."""
    return data_root() / "assets"
