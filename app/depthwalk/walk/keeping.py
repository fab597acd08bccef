"""Keep what the user has changed in the panel: copy it, save it into the scene's file or a new one, or undo it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

from platformdirs import user_documents_path

from depthwalk.errors import InputError
from depthwalk.files import write_bytes
from depthwalk.scene.loader import load_scene
from depthwalk.scene.saved_values import bytes_with_values, count_text, save_values
from depthwalk.scene.scene import Scene
from depthwalk.scene.yaml_text import block_lines
from depthwalk.walk.file_watch import OwnChange, state_of
from depthwalk.walk.files import is_shipped, save_new
from depthwalk.walk.state import Keeping, State
from depthwalk.walk.window import Window, copy_text


class Walk(Protocol):
    """Describe the walk whose values are kept; `app.Walk` explains each part."""

    window: Window
    state: State

    def note_own_change(self, change: OwnChange) -> None:
        """Take a change of a file for the walk's own, after which the scene need not be read again."""
        ...


def keep(walk: Walk, keeping: Keeping) -> None:
    """Do what the user has asked with the values that differ from the file's, and tell what came of it."""
    state = walk.state
    name, changed = state.scene.path.name, state.changed
    if not changed:
        state.tell(f"Nothing differs from {name}")
        return
    match keeping:
        case Keeping.COPY:
            copy_text(walk.window, "\n".join(block_lines(changed)))
            state.tell(f"Copied {count_text(changed)}, as lines for a scene file")
        case Keeping.UNDO:
            state.undo_changes()
            state.tell(f"Undone: {count_text(changed)} as in {name} again")
        case Keeping.SAVE:
            try:
                state.tell(_save(walk, changed))
            except (InputError, OSError) as error:
                state.tell(f"Nothing was saved. {error}\nCopy, in the panel, puts the values into the clipboard")


def _save(walk: Walk, changed: Mapping[str, Any]) -> str:
    """Save values where `State.saved_to` says; return what to tell the user. Raises InputError and OSError."""
    state, path = walk.state, walk.state.scene.path
    match state.saved_to:
        case "new file":
            return (
                f"Saved {save_as_new(state.scene, changed)}, a copy of {path.name} with {count_text(changed)} changed"
            )
        case "nowhere":
            raise InputError(f"{path.name} was opened by itself, without a scene file")
    before = state_of(path)
    save_values(path, changed)
    walk.note_own_change(OwnChange(path, before, state_of(path)))
    state.accept_changes()
    return f"Saved {count_text(changed)} in {path.name}"


def save_as_new(scene: Scene, values: Mapping[str, Any]) -> Path:
    """Save a copy of a scene file, with changed values, under a new name.

    Parameters
    ----------
    scene
        The scene as it was loaded.
    values
        The values, as for `save_values`.

    Returns
    -------
    Path
        The new file, in the working directory or, if that cannot be written to, in the user's documents; of a scene
        that does not ship with the program rather in its own folder, so that it finds its models.

    Raises
    ------
    InputError
        If the values cannot be saved, or the copy would not find the scene's models.
    OSError
        If no folder can be written to.
    """
    data = bytes_with_values(scene.path, values)
    folders = [Path.cwd(), user_documents_path()] if is_shipped(scene.path) else [scene.path.parent, Path.cwd()]

    def write(file: Path) -> None:
        write_bytes(file, data)
        folder = file.parent.parent  # the file is in a folder of its own until it has its name
        copy = load_scene(file, [folder])
        if _files_of(copy) != _files_of(scene):
            raise InputError(f"a copy of {scene.path.name} in {folder} would show other models")

    return save_new(".yaml", write, folders)


def _files_of(scene: Scene) -> tuple[object, ...]:
    """Return the models and pictures of a scene, as far as its copy must have the same ones."""
    ground, sky = scene.environment.ground, scene.environment.sky
    return scene.assets, ground and ground.texture, sky and sky.image
