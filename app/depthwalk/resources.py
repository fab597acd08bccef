"""Find the files that ship with the program: inside the wheel, or beside `app/` in a checkout."""

import os
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def data_root() -> Path:
    """Return the folder that holds `shaders`, `scenes` and `assets`.

    Raises FileNotFoundError if the installation is incomplete.
    """
    for root in (_PACKAGE / "_data", _PACKAGE.parent.parent):
        if (root / "shaders").is_dir():
            return root
    raise FileNotFoundError(f"depthwalk: no shaders beside {_PACKAGE}; the installation is incomplete")


def shader_root() -> Path:
    """Return the folder of the shaders, with one folder per pass. Raises FileNotFoundError like `data_root`."""
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


def given_or_shipped(path: Path) -> Path:
    """Return the file that a user means: the one at `path`, or else the shipped one of that name.

    So names in the README work in every folder, with or without their folder: `assets/teapot.ply`, `teapot.ply`.

    Parameters
    ----------
    path
        The given path, relative to the working directory.

    Returns
    -------
    Path
        The file; `path` itself if it exists, or if no shipped file has this name.
    """
    if os.path.exists(path):  # False for names that the system rejects
        return path
    return next((file for file in shipped_places(path) if os.path.isfile(file)), path)


def shipped_places(path: Path) -> tuple[Path, ...]:
    """Return the possible locations of a shipped file that a user means by `path`; none for a path outside."""
    if path.is_absolute() or ".." in path.parts:
        return ()
    return tuple(folder / path for folder in (data_root(), asset_root(), scene_root()))
