"""Load scenes and what their frames need, while the window shows the progress."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from depthwalk.assets.background import BackgroundLibrary
from depthwalk.assets.library import SceneLibrary
from depthwalk.errors import InputError
from depthwalk.gpu.device import Device
from depthwalk.render.antialiasing.modes import hardware_samples
from depthwalk.render.passes import default_passes
from depthwalk.render.passes.object_id import ObjectIdPass
from depthwalk.render.renderer import Renderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Representation
from depthwalk.scene.scene import Scene
from depthwalk.walk.clock import WalkClock
from depthwalk.walk.framing import home_in
from depthwalk.walk.loading import LoadingScreen, StoppedError
from depthwalk.walk.window import Window

_PATIENCE = 0.7  # seconds that a scene whose camera is known may take before its first frame
_POLL_SECONDS = 0.004


class SceneLoader:
    """Create a renderer for a scene, and load what the frames of a walk turn out to need.

    Parameters
    ----------
    device
        The GPU that draws.
    window
        The window, which may be closed during loading.
    screen
        Shows the progress.
    clock
        The walk's clock, which is stopped during loading.
    """

    def __init__(self, device: Device, window: Window, screen: LoadingScreen, clock: WalkClock) -> None:
        self._device, self._window, self._screen, self._clock = device, window, screen, clock
        self._usable: Representation | None = None  # the last representation whose assets could be loaded

    @contextmanager
    def clock_stopped(self) -> Iterator[None]:
        """Stop the walk's clock during the `with` block, and clear the loading screen afterwards."""
        with self._clock.stopped():
            try:
                yield
            finally:
                self._screen.end()

    def open(self, scene: Scene, library: SceneLibrary, representation: Representation | None) -> Renderer:
        """Return a renderer with the assets that the first frame needs.

        Parameters
        ----------
        scene
            The scene to draw.
        library
            The scene's assets, which report their progress to the loading screen from now on. A `BackgroundLibrary`
            prepares them in the background.
        representation
            How to draw every object; None follows the scene.

        Returns
        -------
        Renderer
            The renderer.

        Raises
        ------
        InputError
            If an asset cannot be used.
        StoppedError
            If the user stopped the loading.
        """
        self._screen.begin(scene.title)
        library.report = self._screen.report
        renderer = Renderer(self._device, scene, library, [*default_passes(), ObjectIdPass()])
        try:
            renderer.world.representation = representation
            renderer.remembers = True
            if isinstance(library, BackgroundLibrary):
                renderer.assets.background = library
                library.baking_waits = True  # until the walk has drawn its first picture
                self._wait(renderer, library, scene)
            renderer.world.table()
        except BaseException:
            renderer.release()
            raise
        self._usable = representation
        return renderer

    def _wait(self, renderer: Renderer, library: BackgroundLibrary, scene: Scene) -> None:
        """Wait until all objects can be shown in some way, but not long if the scene has a camera to begin with.

        The rest is loaded in the background. Baking starts only when there is nothing else to wait for. Raises
        InputError for files that cannot be used, and StoppedError.
        """
        camera = scene.camera
        viewer = np.zeros(3) if camera is None else np.array(camera.position)
        end = time.perf_counter() + _PATIENCE
        rehearsed = False
        while not renderer.world.is_whole and (camera is None or time.perf_counter() < end):
            renderer.world.take_arrivals(viewer)
            if complaints := [*library.failures, *renderer.assets.meshes.reader.failures]:
                raise InputError(*dict.fromkeys(complaints))
            if renderer.world.is_whole:
                break
            if not rehearsed and not len(renderer.world.objects()):
                self._rehearse(renderer, scene)
            rehearsed = True
            if not (library.is_searching or renderer.assets.meshes.reader.is_reading):
                library.baking_waits = False
            self._screen.wait("reading \u2026")
            time.sleep(_POLL_SECONDS)

    def _rehearse(self, renderer: Renderer, scene: Scene) -> None:
        """Draw the scene without objects, invisibly, so that the driver compiles shaders while objects are read.

        Settings that the machine does not support are reported before the first picture, see `load_missing`.
        """
        size = self._window.buffer_size
        try:
            hardware_samples(renderer.settings, self._device)
        except InputError:
            return
        if min(size) > 0:
            renderer.rehearse(View(home_in(scene, renderer, size[0] / size[1]), size), self._window.fbo)

    def load_missing(self, renderer: Renderer, tell: Callable[[str], None]) -> bool:
        """Load whatever the next frame needs that is not loaded yet; call this before every frame.

        Something is missing after the user has chosen another representation. If loading fails or is stopped, the
        previous representation is used again.

        Parameters
        ----------
        renderer
            The renderer, with the chosen representation and settings.
        tell
            Called with the reason if something cannot be used.

        Returns
        -------
        bool
            Whether the machine has the anti-aliasing that the settings ask for.

        Raises
        ------
        InputError
            If not even the previous representation can be loaded.
        StoppedError
            If the user closes the window.
        """
        with self.clock_stopped():
            try:
                renderer.world.table()
            except (InputError, StoppedError) as error:
                if self._window.is_closing:
                    raise
                tell(str(error) or "Stopped loading")
                renderer.world.representation = self._usable
                self._load_anyway(renderer)
            self._usable = renderer.world.representation
            try:
                hardware_samples(renderer.settings, self._device)
            except InputError as error:
                tell(str(error))
                return False
        return True

    def _load_anyway(self, renderer: Renderer) -> None:
        """Load what no frame can do without; only closing the window stops this."""
        while True:
            self._screen.end()
            try:
                renderer.world.table()
                return
            except StoppedError:
                if self._window.is_closing:
                    raise
