"""Count which part of the objects' pixels each representation drew, so that no mesh is mistaken for depth images."""

from typing import NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.gpu.device import Device
from depthwalk.gpu.program import Program
from depthwalk.render.draw.draw_lists import FrameDrawLists
from depthwalk.render.targets import Targets
from depthwalk.scene.arrays import Representation
from depthwalk.types import Ints

POLYGON = 0x7FFFFFFF  # stands for every mesh; depth-image objects are numbered from 1
CAPTURED_VIEW = POLYGON - 1  # stands for every captured view
MOST_SAMPLES = 256  # along either axis of the picture; smaller pictures are counted pixel by pixel
KINDS = (
    "dpci",
    "dmesh",
    "mesh",
    "height_fields",
    "captured",
)  # what is counted, in the words of `FrameDrawLists.counts`


class _Sampled(NamedTuple):
    """Hold where the object numbers of a frame go: into a small picture, and from there into a buffer."""

    numbers: moderngl.Texture
    framebuffer: moderngl.Framebuffer
    copy: moderngl.Buffer


class PixelShares:
    """Sample which object some pixels of a frame show, and count later which representation drew them.

    `sample` starts a query and returns at once; `count` waits for the result, which is there a few frames later.

    Parameters
    ----------
    device : the GPU that draws and is read from.
    """

    def __init__(self, device: Device) -> None:
        self._gl = device.scope("pixel_shares")
        self._program = Program(self._gl, "common/fullscreen.vert", "pixel_shares/pixel_shares.frag")
        self._sampled: _Sampled | None = None
        self._drawn_as = np.zeros(0, np.uint8)  # of the frame that was sampled last, see `FrameDrawLists`

    def sample(self, targets: Targets, plan: FrameDrawLists) -> None:
        """Start a query of which object each sampled pixel of a frame shows.

        Parameters
        ----------
        targets : the textures that the passes have drawn the frame into.
        plan : the draw lists of the whole frame, which hold how each object was drawn.
        """
        width, height = targets.size
        columns, rows = min(width, MOST_SAMPLES), min(height, MOST_SAMPLES)
        sampled = self._sampled = self._of_size(columns, rows)
        targets.visibility_texture.use(0)
        targets.depth.use(1)
        self._program.set(visibility_texture=0, depth_texture=1, spacing=(width / columns, height / rows))
        with self._gl.state(into=sampled.framebuffer):
            self._program.fill()
        sampled.numbers.read_into(sampled.copy)
        self._drawn_as = plan.drawn_as

    def count(self) -> Ints:
        """Return how many of the sampled pixels each representation drew. Waits until the GPU has drawn that frame.

        Returns
        -------
        (5,) number of pixels for each of `KINDS`; zeros before the first call of `sample`.
        """
        if self._sampled is None:
            return np.zeros(len(KINDS), np.int64)
        return count_kinds(np.frombuffer(self._sampled.copy.read(), np.uint32), self._drawn_as)

    def release(self) -> None:
        """Free the textures and programs on the device."""
        self._gl.release()

    def _of_size(self, columns: int, rows: int) -> _Sampled:
        """Return textures for `columns` × `rows` samples, those of the last frame where they fit."""
        if self._sampled is not None:
            if self._sampled.numbers.size == (columns, rows):
                return self._sampled
            self._gl.free(self._sampled.framebuffer, self._sampled.numbers, self._sampled.copy)
        numbers = self._gl.texture((columns, rows), 1, "u4")
        return _Sampled(numbers, self._gl.framebuffer([numbers]), self._gl.buffer(reserve=4 * columns * rows))


def count_kinds(numbers: NDArray[np.uint32], drawn_as: NDArray[np.uint8]) -> Ints:
    """Count pixels by the representation that drew their objects.

    Parameters
    ----------
    numbers : (n,) what each pixel shows: a depth-image object, counted from 1; `POLYGON`; `CAPTURED_VIEW`; 0, nothing.
    drawn_as : (d,) the representation of each depth-image object, see `FrameDrawLists.drawn_as`.

    Returns
    -------
    (5,) number of pixels for each of `KINDS`.
    """
    images = numbers[(numbers > 0) & (numbers < CAPTURED_VIEW)].astype(np.int64) - 1
    shown = drawn_as[images]
    as_impostor, straight = (int((shown == kind).sum()) for kind in (Representation.DPCI, Representation.DMESH))
    rest = len(images) - as_impostor - straight
    polygons, captured = (int((numbers == kind).sum()) for kind in (POLYGON, CAPTURED_VIEW))
    return np.array([as_impostor, straight, polygons, rest, captured])


def shares(counted: Ints) -> dict[str, float]:
    """Return which part of the objects' pixels each representation drew.

    Parameters
    ----------
    counted : (5,) number of pixels for each of `KINDS`, of one frame or summed over several.

    Returns
    -------
    `share_dpci`, `share_dmesh`, `share_mesh`, `share_height_fields` and `share_captured`, 0 to 1; all 0 where no pixel
    shows an object.
    """
    total = max(int(counted.sum()), 1)
    return {f"share_{kind}": int(count) / total for kind, count in zip(KINDS, counted, strict=True)}
