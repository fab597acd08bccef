"""Decide which files a walk opens and where it saves what the user keeps, and save files under new names."""

import os
from collections.abc import Callable, Sequence
from datetime import datetime
from itertools import count
from pathlib import Path
from typing import Literal

from depthwalk.files import staging_folder
from depthwalk.ingest.formats import MESH_PART_SUFFIXES, MESH_SUFFIXES, SCENE_SUFFIXES, is_model_file
from depthwalk.resources import scene_root
from depthwalk.scene.saved_values import is_writable

SavedTo = Literal["file", "new file", "nowhere"]


def save_new(suffix: str, write: Callable[[Path], object], folders: Sequence[Path]) -> Path:
    """Save a new file, named by date and time, in the first folder that can be written to.

    Parameters
    ----------
    suffix
        The suffix of the file's name, such as ".png".
    write
        Called with the path of a temporary file, which it must write. Exceptions other than OSError are not caught.
    folders
        The folders to try, in this order.

    Returns
    -------
    Path
        The new file.

    Raises
    ------
    OSError
        If none of the folders can be written to; the message says why, for each of them.
    """
    reasons = []
    for folder in folders:
        try:
            return _write_new(folder, suffix, write)
        except OSError as error:
            reasons.append(f"{folder}: {error.strerror or error}")  # without the name of the temporary file
    raise OSError("; ".join(reasons) or "no folder to write to")


def _write_new(folder: Path, suffix: str, write: Callable[[Path], object]) -> Path:
    """Write a complete file under an unused name in `folder` and return its path."""
    stem = f"depthwalk-{datetime.now():%Y%m%d-%H%M%S}"
    with staging_folder(folder) as temporary:
        whole = Path(temporary) / f"whole{suffix}"
        write(whole)
        for number in count(1):
            path = folder / (f"{stem}{suffix}" if number == 1 else f"{stem}-{number}{suffix}")
            if _moved(whole, path):
                return path
    raise AssertionError("numbers do not end")


def _moved(whole: Path, path: Path) -> bool:
    """Give a file the name `path` unless that is taken; return whether it was free.

    Creating a hard link to the file fails atomically if the name is taken. On disks without links (FAT), an empty file
    first reserves the name for a moment.
    """
    try:
        os.link(whole, path)
        return True
    except FileExistsError:
        return False
    except OSError:
        pass
    try:
        path.open("xb").close()
    except FileExistsError:
        return False
    try:
        whole.replace(path)
    except BaseException:
        path.unlink()
        raise
    return True


def opened_of(dropped: Sequence[Path]) -> tuple[tuple[Path, ...], str]:
    """Return which of the files that the user drops at once are opened, and what to tell of the others, "" if nothing.

    A scene or camera path that comes first is opened by itself, otherwise all meshes together; without meshes a scene
    or path, or else the first file. What meshes name, such as their pictures, is not told of: it is read with them.
    """
    first, *_ = dropped
    meshes, scenes = (
        tuple(file for file in dropped if file.suffix.lower() in suffixes)
        for suffixes in (MESH_SUFFIXES, SCENE_SUFFIXES)
    )
    opened = scenes[:1] if first in scenes else meshes or scenes[:1] or (first,)
    read_along = MESH_PART_SUFFIXES if opened == meshes else ()
    left_out = [file for file in dropped if file not in opened and file.suffix.lower() not in read_along]
    if not left_out:
        return opened, ""
    more = f" and {len(left_out) - 1} more" if len(left_out) > 1 else ""
    return opened, f"Not opened: {left_out[0].name}{more}. A window shows one scene, or several meshes"


def saved_to(path: Path) -> SavedTo:
    """Return where changed values of a scene are saved.

    Parameters
    ----------
    path
        The file of the scene: a scene file, mesh or depth images.

    Returns
    -------
    str
        "file": into the scene file; "new file": into a copy, since the file ships with the program or is read-only;
        "nowhere": there is no scene file.
    """
    if is_model_file(path):
        return "nowhere"
    return "new file" if is_shipped(path) or not is_writable(path) else "file"


def is_shipped(path: Path) -> bool:
    """Return whether a scene file is one of those that ship with the program, which stay as they are."""
    return path.resolve().is_relative_to(scene_root().resolve())
