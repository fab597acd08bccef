"""Walk through a scene in a window: `run` opens the window, or raises `NoDisplayError` if that is impossible.

`depthwalk view` and the function `depthwalk.view` use it. It builds on `render`, and on `assets`, which prepares depth
images in the background.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path

from depthwalk.assets.library import SceneLibrary
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.camera import FrameAll
from depthwalk.scene.models import load_files
from depthwalk.scene.path import CameraPath
from depthwalk.scene.scene import Scene
from depthwalk.walk.window import NoDisplayError, open_window, title_of

__all__ = ["NoDisplayError", "run"]

_USUAL_SIZE = 1024, 768  # of a window, on a desktop that does not enlarge what it shows


def run(
    scene: Scene,
    library: SceneLibrary,
    *,
    path: CameraPath | None = None,
    fullscreen: bool = False,
    size: tuple[int, int] | None = None,
    representation: Representation | None = None,
    first_camera: Callable[[Camera, FrameAll], Camera] = lambda camera, frame_all: camera,
    read: Callable[[Sequence[Path]], Scene] = load_files,
    before_frame: Callable[[], None] = lambda: None,
    change: Callable[[], Sequence[slice]] | None = None,
    watched: Callable[[Scene], Sequence[Path]] | None = None,
) -> None:
    """Open a window on a scene; return when the user closes it.

    Parameters
    ----------
    scene
        The scene to show.
    library
        The scene's assets, which are loaded here while the window shows the progress.
    path
        A camera path for the key P to play; None for none.
    fullscreen
        Whether to use the whole screen.
    size
        (width, height) of the window, in coordinates of the desktop. None: 1024 × 768, times what the desktop enlarges
        by, as far as the screen has room; less on a smaller screen.
    representation
        How to draw every object; None follows the scene.
    first_camera
        Called with the scene's own camera or, if it has none, with one that sees every object, and with a function that
        returns a camera that sees them for a field of view and a direction. Returns the camera to begin with.
    read
        Called with the files of the scene to read it again, and with a scene file or models that are dropped on the
        window. It may raise InputError.
    before_frame
        Called before each frame; what it raises ends the walk. A signal may raise while the window handles a key, where
        Python drops the exception; this is the place to raise it again.
    change
        Called before each frame, while none is being drawn: it may change the scene, and returns the runs of objects
        that it moved; what it raises ends the walk. None changes nothing.
    watched
        Returns the files of a scene, which is read again when one of them is saved; None watches none.

    Raises
    ------
    NoDisplayError
        If no window can be opened.
    InputError
        If an asset cannot be used.
    """
    with ThreadPoolExecutor(1) as threads:  # starting the driver takes as long as half of the imports
        app = threads.submit(import_module, "depthwalk.walk.app")
        window = open_window(title_of(scene), size or _USUAL_SIZE, fullscreen, fitted=size is None)
    try:
        walk_in = app.result().walk_in
    except BaseException:
        window.destroy()
        raise
    walk_in(window, scene, library, path, representation, first_camera, read, before_frame, change, watched)
