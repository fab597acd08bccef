"""Open a window to walk through a scene."""

from pathlib import Path

from depthwalk.api.scene import PathLike, Scene, check_scene
from depthwalk.assets.background import BackgroundLibrary
from depthwalk.gpu.failures import GpuError
from depthwalk.scene.path import load_path


def view(
    scene: Scene, *, path: PathLike | None = None, size: tuple[int, int] = (1280, 720), fullscreen: bool = False
) -> None:
    """Open a window on a scene; return when the user closes it.

    Parameters
    ----------
    scene
        What to walk through. Keys and mouse are listed in docs/walking.md.
    path
        A camera path file, played with the key P; None for no path.
    size
        Width and height of the window, pixels.
    fullscreen
        Whether the window covers the whole screen.

    Raises
    ------
    GpuError
        If no window can be opened, for example without a display.
    InputError
        For assets and paths that cannot be used.
    TypeError
        If `scene` is not a `Scene`.

    Examples
    --------
    >>> dw.view(dw.load_scene("scene.yaml"))
    """
    check_scene(scene)
    from depthwalk import walk  # the window's libraries take half a second

    loaded = scene.loaded
    camera_path = None if path is None else load_path(Path(path))
    try:
        walk.run(
            loaded, BackgroundLibrary(loaded.assets, processes=0), path=camera_path, size=size, fullscreen=fullscreen
        )
    except walk.NoDisplayError as error:
        raise GpuError(str(error)) from None
