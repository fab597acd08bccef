"""Open a window to walk through a scene."""

import time
from collections.abc import Callable
from pathlib import Path

from depthwalk.api.scene import PathLike, Scene, check_scene
from depthwalk.assets.background import BackgroundLibrary
from depthwalk.gpu.failures import GpuError
from depthwalk.scene.path import load_path


def view(
    scene: Scene,
    *,
    path: PathLike | None = None,
    size: tuple[int, int] | None = None,
    fullscreen: bool = False,
    before_frame: Callable[[float], None] | None = None,
) -> None:
    """Open a window on a scene; return when the user closes it.

    Parameters
    ----------
    scene
        What to walk through. Keys and mouse are listed in docs/walking.md.
    path
        A camera path file, played with the key P; None for no path.
    size
        Width and height of the window, pixels. None: 1024 × 768, more on a dense screen, less on a small one.
    fullscreen
        Whether the window covers the whole screen.
    before_frame
        Called before each frame with the seconds since the first one. It may move nodes and change settings; what it
        raises closes the window. While nothing moves, no frames are drawn, and it is called about twice a second. It is
        no longer called once the user loads another scene, or this one again. None calls nothing.

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
    >>> scene = dw.load_scene("scene.yaml")
    >>> dw.view(scene, before_frame=lambda seconds: scene.move("ball", yaw=seconds))
    """
    check_scene(scene)
    from depthwalk import walk  # the window's libraries take half a second

    loaded = scene.loaded
    camera_path = None if path is None else load_path(Path(path))
    try:
        walk.run(
            loaded,
            BackgroundLibrary(loaded.assets, processes=0),
            walk.WalkOptions(path=camera_path, change=None if before_frame is None else _Changes(scene, before_frame)),
            size=size,
            fullscreen=fullscreen,
        )
    except walk.NoDisplayError as error:
        raise GpuError(str(error)) from None


class _Changes:
    """Call `before_frame` before each frame, and collect the objects that it moves."""

    def __init__(self, scene: Scene, before_frame: Callable[[float], None]) -> None:
        self._before_frame = before_frame
        self._began: float | None = None
        self._moved: list[slice] = []
        scene.watch(self._note)

    def __call__(self) -> list[slice]:
        """Return the runs of objects that moved since the last call."""
        now = time.perf_counter()
        if self._began is None:
            self._began = now
        self._before_frame(now - self._began)
        moved, self._moved = self._moved, []
        return moved

    def _note(self, objects: slice) -> None:
        self._moved.append(objects)
