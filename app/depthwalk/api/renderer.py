"""Render pictures of a scene without a window, as arrays."""

import logging
import math
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.api.scene import PathLike, Scene, check_scene
from depthwalk.assets.library import SceneLibrary
from depthwalk.errors import InputError
from depthwalk.files import check_folder, write_bytes
from depthwalk.limits import MAX_FOV, MIN_FOV
from depthwalk.pictures import jpeg_bytes, png_bytes
from depthwalk.render.frame import Pass
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.object_ids import object_ids
from depthwalk.render.passes import default_passes
from depthwalk.render.passes.object_id import ObjectIdPass
from depthwalk.render.view.view import View, view_distance
from depthwalk.scene.arrays import Camera, Representation
from depthwalk.scene.schema import RepresentationName
from depthwalk.types import Picture

log = logging.getLogger(__name__)


@dataclass(frozen=True, kw_only=True)
class Image:
    """Hold a picture of a scene with depth and object numbers; row 0 is at the top.

    Attributes
    ----------
    rgba
        (H, W, 4) uint8: sRGB colours and alpha, which is 0 only where the background was left out.
    depth
        (H, W) float32, metres along the view axis to the nearest surface in each pixel; +inf where there is none.
    object_id
        (H, W) int32, number of the scene's object in front; −1 where there is none. None unless `render` was asked for
        it by `object_id=True`.

    Examples
    --------
    >>> with dw.Renderer(dw.load_scene("scene.yaml"), size=(80, 60)) as renderer:
    ...     image = renderer.render(object_id=True)
    >>> int(image.object_id[30, 40]), int(image.object_id[0, 0])
    (0, -1)
    >>> float(image.depth[0, 0])
    inf
    >>> image.save("ball.png")
    """

    rgba: Picture
    depth: NDArray[np.float32]
    object_id: NDArray[np.int32] | None = None

    def save(self, path: PathLike) -> None:
        """Write the colours to a PNG file, or to a JPEG file without alpha.

        Parameters
        ----------
        path
            The file, whose name ends in .png, .jpg or .jpeg.

        Raises
        ------
        InputError
            If the name ends in none of these, or the folder does not exist.
        OSError
            If the file cannot be written.
        """
        file = Path(path)
        if file.suffix.lower() not in (".png", ".jpg", ".jpeg"):
            raise InputError(f"{file}: must end in .png, .jpg or .jpeg")
        check_folder(file)
        is_png = file.suffix.lower() == ".png"
        write_bytes(file, png_bytes(self.rgba) if is_png else jpeg_bytes(self.rgba[..., :3]))


class Renderer:
    """Render a scene into arrays. Use it in a `with` block, which frees its GPU memory at the end.

    Creating a renderer reads the scene's assets, and bakes depth images found neither beside their mesh nor in the
    user's cache. Nothing is printed: progress goes to the callback `progress`, or else to the log. Several renderers
    may exist at the same time.

    Parameters
    ----------
    scene
        What to render. Changes to the scene show in the next picture.
    size
        Width and height of the pictures, pixels.
    representation
        How to draw every object whose asset allows it, at any distance; "auto" uses its mesh or its depth images,
        whichever is quicker; None follows the scene file, or "auto" where the file does not say.
    passes
        The passes of a frame in order: `default_passes()`, with your own inserted. None uses the default ones.
    reuse
        Whether a picture may reuse impostors and visibility from the one before. This is faster while the camera moves
        little, but makes pictures depend on those before them.
    progress
        Called with the name of an asset and the stage it is in; None logs this.

    Raises
    ------
    GpuError
        If no OpenGL 3.3 context can be created.
    InputError
        For assets that cannot be used.
    TypeError
        If `scene` is not a `Scene` but, say, a file name.

    Examples
    --------
    >>> scene = dw.load_scene("scene.yaml")
    >>> with dw.Renderer(scene, size=(80, 60)) as renderer:
    ...     before = renderer.render()
    ...     scene.move("ball", position=(0.0, 1.0, 0.0))
    ...     after = renderer.render()
    >>> before.rgba.shape, before.rgba.dtype
    ((60, 80, 4), dtype('uint8'))
    >>> bool((before.rgba != after.rgba).any())
    True
    """

    def __init__(
        self,
        scene: Scene,
        size: tuple[int, int],
        *,
        representation: RepresentationName | None = None,
        passes: Sequence[Pass[Any]] | None = None,
        reuse: bool = False,
        progress: Callable[[str, str], None] | None = None,
    ) -> None:
        """Read the scene's assets, and create the context and the programs that draw them."""
        check_scene(scene)
        self.size = size = checked_size(size)
        self._scene = scene
        self._ids = ObjectIdPass()
        wanted = None if representation is None else _representation(representation)
        library = SceneLibrary(scene.loaded.assets, progress or _log_progress)
        all_passes = [*(default_passes() if passes is None else _checked_passes(passes)), self._ids]
        self._headless = HeadlessRenderer(scene.loaded, library, size, wanted, all_passes)
        self._headless.renderer.remembers = reuse
        self._closed = False
        self._moved: list[slice] = []  # runs of objects, since the last picture
        scene.watch(self._note_moved)

    def __enter__(self) -> "Renderer":
        """Return the renderer itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Free the renderer's GPU memory, as `close` does."""
        self.close()

    def close(self) -> None:
        """Free the renderer's GPU memory; leaving a `with` block does this too."""
        self._closed = True
        self._headless.release()

    def render(self, camera: Camera | None = None, *, object_id: bool = False, background: bool = True) -> Image:
        """Render a picture, with the anti-aliasing of the scene's settings: none, unless `scene.settings.aa` says so.

        Parameters
        ----------
        camera
            Where to look from; None uses the scene's camera, or `frame_all()` where it has none.
        object_id
            Whether to find the object seen at each pixel; this draws the meshes a second time.
        background
            Whether to show the sky or the background colour where there is no surface; otherwise alpha is 0 there.

        Returns
        -------
        Image
            The picture.

        Raises
        ------
        InputError
            For a camera that sees nothing: its target is its position, or its field of view is out of range.
        TypeError
            If `camera` is not a `Camera`.
        ValueError
            If the renderer is closed.
        """
        self._check_open()
        if camera is not None:
            _check_camera(camera)
        self._follow()
        self._ids.requested = object_id
        self._headless.draw(View(camera or self._scene.camera or self.frame_all(), self.size), not background)
        return self._read(object_id)

    def frame_all(self, direction: Sequence[float] | None = None) -> Camera:
        """Return a camera that shows every object of the scene in pictures of this renderer's size.

        Parameters
        ----------
        direction
            Direction in which it looks, three numbers, a vector of any length; None: from in front, from the
            right and a little downward.

        Returns
        -------
        Camera
            The camera.

        Raises
        ------
        InputError
            For a direction that is none.
        ValueError
            If the renderer is closed.
        """
        self._check_open()
        if direction is not None and not (len(direction) == 3 and 0 < math.hypot(*direction) < math.inf):
            raise InputError(f"direction {direction}: must be three numbers, not all of them 0")
        self._follow()
        return self._headless.frame_all(along=direction)

    def _check_open(self) -> None:
        """Raise ValueError if the renderer is closed."""
        if self._closed:
            raise ValueError("the renderer is closed; render within its `with` block")

    def _follow(self) -> None:
        """Heed what has been moved since the last picture."""
        with self._headless.device.context:
            for objects in self._moved:
                self._headless.renderer.world.moved(objects)
        self._moved.clear()

    def _note_moved(self, objects: slice) -> None:
        self._moved.append(objects)

    def _read(self, object_id: bool) -> Image:
        """Return the frame drawn last, taking the nearest of its samples in each pixel."""
        renderer, (width, height) = self._headless.renderer, self.size
        targets, view = renderer.targets, renderer.view
        assert targets is not None and view is not None  # the frame made them
        samples = targets.size[0] // width

        def by_pixel(values: NDArray[Any]) -> NDArray[Any]:
            """Reshape one of the targets' arrays to (H, W, samples per pixel), top row first."""
            blocks = values.reshape(height, samples, width, samples).swapaxes(1, 2)
            return blocks.reshape(height, width, samples * samples)[::-1]

        with self._headless.device.context:
            depth = by_pixel(np.frombuffer(targets.depth.read(alignment=1), np.float32))
            ids = by_pixel(object_ids(renderer, self._ids, self._scene.loaded.objects)) if object_id else None
        nearest = depth.argmin(-1)[..., None]
        return Image(
            rgba=self._headless.pixels().copy(),
            depth=view_distance(np.take_along_axis(depth, nearest, -1)[..., 0], *view.depth_range),
            object_id=None if ids is None else np.take_along_axis(ids, nearest, -1)[..., 0],
        )


def checked_size(size: Sequence[int]) -> tuple[int, int]:
    """Return the width and height of pictures, pixels. Raises InputError for anything else than two whole numbers."""
    try:
        width, height = map(operator.index, size)
    except (TypeError, ValueError):
        width = height = 0
    if min(width, height) < 1:
        raise InputError(f"size {size}: must be a width and a height, whole numbers of at least 1 pixel")
    return width, height


def _checked_passes(passes: Sequence[Pass[Any]]) -> Sequence[Pass[Any]]:
    """Return the passes of a frame. Raises TypeError if one is not a pass, but for example its class."""
    for each in passes:
        if not isinstance(each, Pass):
            raise TypeError(f"passes: must hold objects of classes of Pass, not {each!r}")
    return passes


def _check_camera(camera: Camera) -> None:
    """Raise TypeError if `camera` is no `Camera`, and InputError if it cannot show a picture."""
    if not isinstance(camera, Camera):
        raise TypeError(f"camera: must be a Camera, not {camera!r}")
    if not MIN_FOV <= math.degrees(camera.fov) <= MAX_FOV:
        bounds = f"{math.radians(MIN_FOV):.3g} to {math.radians(MAX_FOV):.3g} radians"
        raise InputError(f"camera: fov {camera.fov:g} must be {bounds}, that is {MIN_FOV:g} to {MAX_FOV:g} degrees")
    if len(camera.position) != 3 or len(camera.target) != 3 or not np.isfinite([camera.position, camera.target]).all():
        raise InputError("camera: position and target must be three finite numbers each")
    if tuple(camera.position) == tuple(camera.target):
        raise InputError("camera: target must be elsewhere than the camera's position")


def _representation(name: str) -> Representation:
    """Return the representation that scene files call `name`."""
    by_name = {representation.label: representation for representation in Representation}
    if name not in by_name:
        raise InputError(f"representation {name!r}: must be one of {', '.join(by_name)}")
    return by_name[name]


def _log_progress(asset: str, stage: str) -> None:
    log.info("%s: %s", asset, stage)
