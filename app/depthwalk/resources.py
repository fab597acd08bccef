"""Find the files that travel with the program: inside the wheel, or beside `app/` in a checkout."""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def data_root() -> Path:
    """Return the folder that holds `shaders`, `scenes` and `assets`.

    Raises FileNotFoundError where the installation is incomplete.
    """
    for root in (_PACKAGE / "_data", _PACKAGE.parent.parent):
        if (root / "shaders").is_dir():
            return root
    raise FileNotFoundError(f"depthwalk: no shaders beside {_PACKAGE}; the installation is incomplete")


def shader_root() -> Path:
    """Return the folder of the shaders, which has a folder per pass. Raises FileNotFoundError as `data_root` does."""
    return data_root() / "shaders"


def scene_root() -> Path:
    """Return the folder of the shipped scenes, which also holds a folder `paths` of camera paths through them.

    Raises FileNotFoundError as `data_root` does.
    """
    return data_root() / "scenes"


def asset_root() -> Path:
    """Return the folder of meshes and textures of the shipped scenes; every scene may name files in it.

    Raises FileNotFoundError as `data_root` does.
    """
    return data_root() / "assets"
