"""Walk through a scene in a window: `run` opens the window, or raises `NoDisplayError` if that is impossible.

`depthwalk view` and the function `depthwalk.view` use it. It builds on `render`, and on `assets`, which prepares depth
images in the background.
"""

from concurrent.futures import ThreadPoolExecutor
from importlib import import_module

from depthwalk.assets.library import SceneLibrary
from depthwalk.scene.scene import Scene
from depthwalk.walk.walk_options import WalkOptions
from depthwalk.walk.window import NoDisplayError, open_window, title_of

__all__ = ["NoDisplayError", "WalkOptions", "run"]

_USUAL_SIZE = 1024, 768  # of a window, on a desktop that does not enlarge what it shows
_USUAL_OPTIONS = WalkOptions()


def run(
    scene: Scene,
    library: SceneLibrary,
    options: WalkOptions = _USUAL_OPTIONS,
    *,
    fullscreen: bool = False,
    size: tuple[int, int] | None = None,
) -> None:
    """Open a window on a scene; return when the user closes it.

    Parameters
    ----------
    scene
        The scene to show.
    library
        The scene's assets, which are loaded here while the window shows the progress.
    options
        How the walk begins, and what the program does during it.
    fullscreen
        Whether to use the whole screen.
    size
        (width, height) of the window, in coordinates of the desktop. None: 1024 × 768, times what the desktop enlarges
        by, as far as the screen has room; less on a smaller screen.

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
    walk_in(window, scene, library, options)
