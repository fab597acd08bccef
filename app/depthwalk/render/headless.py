"""Draw a scene into memory, without a window, in a GL context of its own."""

import math
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from functools import partial
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyglm import glm

from depthwalk.gpu.headless_device import headless_device
from depthwalk.pictures import LinearImage
from depthwalk.render.frame import Pass
from depthwalk.render.image import read_pixels
from depthwalk.render.renderer import Renderer
from depthwalk.render.resources.library import Library
from depthwalk.render.view.view import View, view_distance
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.scene import Scene
from depthwalk.types import Ints


class HeadlessRenderer:
    """Draw one scene into memory.

    Use it in a `with` block, which frees the GL context and all in it.

    Several may exist at a time: every call makes its own context current and restores the previous one. A picture does
    not depend on earlier ones; to draw a walk as the window does, set `renderer.remembers`.

    Parameters
    ----------
    scene : what is drawn.
    library : reads, bakes and caches the scene's assets. All assets that are drawn are loaded at once.
    size : width and height of the pictures, pixels.
    representation : draw every object whose asset allows it by this one, without fallback; None: as the scene says,
        with meshes in place of depth images near by and, by `auto`, where they are quicker.
    passes : the passes of a frame; see `Renderer`.

    Attributes
    ----------
    renderer : the renderer, for its settings, counts and timers.
    size : width and height of the pictures, pixels.
    screen : the framebuffer that holds the picture drawn last.

    Raises
    ------
    GpuError
        Where no OpenGL 3.3 context can be created.
    InputError
        For assets that cannot be used.
    """

    def __init__(
        self,
        scene: Scene,
        library: Library,
        size: tuple[int, int],
        representation: Representation | None = None,
        passes: Sequence[Pass[Any]] | None = None,
    ) -> None:
        self.size = size
        self._open = partial(self._make, scene, library, passes)
        self._open(representation)

    def _make(
        self,
        scene: Scene,
        library: Library,
        passes: Sequence[Pass[Any]] | None,
        representation: Representation | None,
    ) -> None:
        """Make a context and a renderer in it; see the class."""
        self.device = headless_device()
        self._released = False
        with ExitStack() as made:  # frees the context, with all in it, if a step fails
            made.callback(self.device.context.release)
            with self.device.context, ExitStack() as objects:
                scope = self.device.scope("headless")
                objects.callback(scope.release)
                self.screen = scope.framebuffer([scope.texture(self.size, 4)])
                self.renderer = Renderer(self.device, scene, library, passes)
                objects.callback(self.renderer.release)
                self.renderer.world.representation = representation
                self.renderer.world.table()
                self._objects = objects.pop_all()
            made.pop_all()

    def __enter__(self) -> "HeadlessRenderer":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()

    def release(self) -> None:
        """Free the renderer and its context; a second call does nothing."""
        if self._released:
            return
        self._released = True
        try:
            with self.device.context:
                self._objects.close()
        finally:
            self.device.context.release()

    def recreate(self) -> None:
        """Replace context and renderer after any of `GPU_FAILURES`; the next picture is as if nothing had happened.

        Raises what the constructor raises, and may then be called again.
        """
        representation, remembers = self.renderer.world.representation, self.renderer.remembers
        with suppress(Exception):  # a lost context refuses anything, and takes its objects along
            self.release()
        self._open(representation)
        self.renderer.remembers = remembers

    def draw(self, view: View, transparent: bool = False, linear: bool = False) -> None:
        """Draw a frame of a view.

        Parameters
        ----------
        view : the camera, with the size of this renderer.
        transparent : whether pixels where nothing is drawn get alpha 0; otherwise they show the sky or the background.
        linear : whether `linear_image` shall return the frame.
        """
        self.renderer.keeps = frozenset(("lit",) if linear else ())
        with self.device.context:
            self.renderer.render(view, self.screen, transparent)

    def finish(self) -> None:
        """Wait until all frames are drawn: `draw` only submits one. Whoever times frames calls it after each."""
        self.device.finish()

    def pixels(self) -> NDArray[np.uint8]:
        """Return the frame drawn last, (H, W, 4) uint8, sRGB and alpha, top row first.

        Raises ContextLostError where the picture is lost, see `recreate`.
        """
        with self.device.context:
            pixels = read_pixels(self.screen)
            self.device.check()
            return pixels

    def pixel_counts(self) -> Ints:
        """Return how many pixels of the frame drawn last each representation drew.

        Returns
        -------
        (5,) numbers of pixels that show impostors (`dpci`), samples drawn straight to the screen (`dmesh`), meshes,
        height fields and captured views. Of large pictures only some pixels are counted, see `PixelShares`.
        """
        with self.device.context:
            return self.renderer.sample_shares().count()

    def frame_all(
        self, fov: float = math.pi / 3, along: Sequence[float] | None = None, *, turns: bool = False
    ) -> Camera:
        """Return a camera that sees every object in pictures of this size.

        Parameters
        ----------
        fov
            Vertical field of view, radians.
        along
            Direction of view, a vector (3,), world; None looks from in front, from the right and a little
            downward; at a flat model, at its broad side.
        turns
            Whether the camera shall see them all also while it goes around its target.

        Returns
        -------
        Camera
            The camera.
        """
        width, height = self.size
        away = None if along is None else -glm.dvec3(*along)
        with self.device.context:
            return self.renderer.frame_all(width / height, fov, away, turns)

    def linear_image(self) -> LinearImage:
        """Return the frame drawn last, in linear colours as they are before `output` encodes them for the screen.

        Returns
        -------
        (H, W, 4) float32 linear colours and (H, W) float32 distances, metres along the view axis, row 0 at the top.
        Each pixel has the mean colour and the least distance of its samples.

        Raises
        ------
        ValueError
            Where that frame was drawn without `linear`.
        ContextLostError
            Where the picture is lost, see `recreate`.
        """
        targets = self.renderer.targets
        if targets is None or "lit" not in self.renderer.keeps:
            raise ValueError("no frame was drawn with linear=True")
        with self.device.context:
            lit = targets.lit_texture.read(alignment=1)
        width, height = self.size
        samples = targets.size[0] // width
        colour = np.frombuffer(lit, np.float16).astype(np.float32).reshape(height, samples, width, samples, 4)
        return LinearImage(colour.mean((1, 3))[::-1], self.distances())

    def distances(self) -> NDArray[np.float32]:
        """Return the distance of the surface at each pixel of the frame drawn last.

        Returns
        -------
        (H, W) float32 metres along the view axis, row 0 at the top; +inf where nothing is. Each pixel has the least
        distance of its samples.

        Raises
        ------
        ContextLostError
            Where the picture is lost, see `recreate`.
        """
        targets, fitted = self.renderer.targets, self.renderer.view
        assert targets is not None and fitted is not None  # `draw` made them
        with self.device.context:
            depth_bytes = targets.depth.read(alignment=1)
            self.device.check()
        width, height = self.size
        samples = targets.size[0] // width
        depth = np.frombuffer(depth_bytes, np.float32).reshape(height, samples, width, samples)
        return view_distance(depth.min((1, 3))[::-1], *fitted.depth_range)
