"""Measure the gain from anti-aliasing, for `depthwalk quality` and docs/anti-aliasing.md.

Every kind of `render.aa` is compared with pictures of many samples per pixel, in the pixels that edges run through.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, uniform_filter

from depthwalk.assets.library import SceneLibrary
from depthwalk.assets.mesh_library import Report
from depthwalk.colour import srgb8_from_linear
from depthwalk.gpu.timers import frame_clock
from depthwalk.pictures import LinearImage
from depthwalk.quality.metrics import mean_flip, psnr
from depthwalk.quality.rows import Row, side_by_side
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Representation
from depthwalk.scene.effect_settings import GpaaParams
from depthwalk.scene.render_settings import PictureParams
from depthwalk.scene.scene import Scene
from depthwalk.types import Picture

REFERENCE_SAMPLES = 8  # per pixel, along either axis
JUMP = 0.02  # of the distance: an edge runs where the next sample is farther by more than this
REPRESENTATIONS = {"depth images": Representation.DPCI, "mesh": Representation.MESH}
OURS = "gpaa-edge"
GAINS = {"fxaa": 3.0, "smaa": 1.5, "msaa": 0.0}  # dB by which it must be better than others, for the same geometry
SILHOUETTE_GAIN = 2.0  # dB that depth images must gain by it, against their mesh
SHOWN = 4  # fraction of the picture's width and height that the page shows: a quarter


@dataclass(frozen=True)
class Kind:
    """Define a way to smooth edges.

    Attributes
    ----------
    title
        Its name in tables.
    aa
        Value of the setting `render.aa`.
    samples
        Value of `render.gpaa.samples`, which only `gpaa` and `gpaa-edge` use.
    """

    title: str
    aa: Any
    samples: int = GpaaParams().samples

    def apply(self, settings: Any) -> None:
        """Set the render `settings` to this kind, in place."""
        settings.aa, settings.gpaa.samples = self.aa, self.samples


KINDS = (
    *(Kind(aa, aa) for aa in get_args(PictureParams.model_fields["aa"].annotation)),
    Kind(f"{OURS}, one sample", OURS, samples=1),
)


@dataclass(frozen=True)
class Truth:
    """Hold a reference picture with `REFERENCE_SAMPLES`² samples per pixel.

    Attributes
    ----------
    pixels
        (H, W, 3) uint8, sRGB.
    edge
        (H, W) bool, the pixels that an edge runs through, and their neighbours.
    """

    pixels: NDArray[np.uint8]
    edge: NDArray[np.bool_]


def examine(scenes: Sequence[Scene], size: tuple[int, int], report: Report) -> Iterator[Row]:
    """Compare each kind of anti-aliasing with the reference, in each scene; an `Examine`.

    Rows also state by how much the anti-aliasing `OURS` is better than others.
    """
    for scene in scenes:
        scene.render.output.dither = False  # the reference has no noise either
        truths = {name: _truth(scene, size, representation, report) for name, representation in REPRESENTATIONS.items()}
        for name, representation in REPRESENTATIONS.items():
            with HeadlessRenderer(scene, SceneLibrary(scene.assets, report), size, representation) as headless:
                pictures, milliseconds = _draw_all(headless, scene, report)
            subject = f"{scene.path.stem}, {name}"
            yield from _kinds(subject, pictures, milliseconds, truths[name], truths["mesh"])
            yield from _gains(subject, pictures, truths[name])
            if representation is Representation.DPCI:
                yield _silhouettes(subject, pictures, truths["mesh"])


def truth(image: LinearImage) -> Truth:
    """Make a reference picture from a large one, by averaging its pixels in linear light, and find its edges.

    Parameters
    ----------
    image
        A picture without anti-aliasing, `REFERENCE_SAMPLES` times as wide and as high as the reference.

    Returns
    -------
    Truth
        The reference picture; edges are where the distance of the surface jumps.
    """
    samples = REFERENCE_SAMPLES
    height, width = (side // samples for side in image.distance.shape)
    near = 1 / image.distance  # 0 for the background
    jumps = np.zeros(near.shape, bool)
    for axis in (0, 1):
        low, high = (np.take(near, range(first, near.shape[axis] - 1 + first), axis) for first in (0, 1))
        jump = np.abs(high - low) > JUMP * np.maximum(low, high)
        jumps[: jump.shape[0], : jump.shape[1]] |= jump
    edge = binary_dilation(jumps.reshape(height, samples, width, samples).any((1, 3)), np.ones((3, 3)))
    colour = np.clip(image.colour[..., :3], 0, 1)  # overexposed samples count as white, not as glare
    return Truth(srgb8_from_linear(colour.reshape(height, samples, width, samples, 3).mean((1, 3))), edge)


def _truth(scene: Scene, size: tuple[int, int], representation: Representation, report: Report) -> Truth:
    scene.render.aa = "none"
    fine = size[0] * REFERENCE_SAMPLES, size[1] * REFERENCE_SAMPLES
    with HeadlessRenderer(scene, SceneLibrary(scene.assets, report), fine, representation) as headless:
        report(scene.path.stem, f"{REFERENCE_SAMPLES**2} samples per pixel")
        headless.draw(View(scene.camera or headless.frame_all(), fine), linear=True)
        return truth(headless.linear_image())


def _draw_all(headless: HeadlessRenderer, scene: Scene, report: Report) -> tuple[list[Picture], list[float]]:
    """Draw the scene with each of `KINDS`.

    Returns
    -------
    The picture (H, W, 3) of each kind, and the milliseconds of its second frame: processor time of all cores with
    software OpenGL, otherwise wall-clock time.
    """
    view = View(scene.camera or headless.frame_all(), headless.size)
    clock = frame_clock(headless.device)
    pictures, milliseconds = [], []
    for kind in KINDS:
        report(scene.path.stem, f"anti-aliasing: {kind.title}")
        kind.apply(scene.render)
        headless.draw(view)  # creates what the kind needs
        headless.finish()
        start = clock()
        headless.draw(view)
        headless.finish()
        milliseconds.append((clock() - start) * 1e3)
        pictures.append(np.ascontiguousarray(headless.pixels()[..., :3]))
    return pictures, milliseconds


def _kinds(
    subject: str, pictures: Sequence[Picture], milliseconds: Sequence[float], own: Truth, mesh: Truth
) -> Iterator[Row]:
    window = _busiest(own.edge)
    for kind, picture, spent in zip(KINDS, pictures, milliseconds, strict=True):
        details = {
            "against the mesh, dB": psnr(mesh.pixels, picture, mesh.edge),
            "FLIP": mean_flip(mesh.pixels, picture, mesh.edge),
            "ms": spent,
            "× none": spent / milliseconds[0],
        }
        panels = side_by_side(kind.title, picture[window], own.pixels[window])
        yield Row(
            subject=subject,
            name=f"{kind.title}, dB",
            measured=psnr(own.pixels, picture, own.edge),
            details=details,
            pictures=panels,
        )


def _gains(subject: str, pictures: Sequence[Picture], own: Truth) -> Iterator[Row]:
    """Yield the gain of `OURS` over each of `GAINS` that was drawn."""
    reached = {kind.title: psnr(own.pixels, shown, own.edge) for kind, shown in zip(KINDS, pictures, strict=True)}
    for peer, goal in GAINS.items():
        if peer in reached:
            yield Row(
                subject=subject, name=f"{OURS} over {peer}, dB", measured=reached[OURS] - reached[peer], goal=goal
            )


def _silhouettes(subject: str, pictures: Sequence[Picture], mesh: Truth) -> Row:
    """Return the gain from anti-aliasing for depth images, compared with the mesh that they show."""
    reached = {kind.title: psnr(mesh.pixels, shown, mesh.edge) for kind, shown in zip(KINDS, pictures, strict=True)}
    gain = reached[OURS] - reached["none"]
    return Row(
        subject=subject,
        name=f"silhouettes: {OURS} over none, against the mesh, dB",
        measured=gain,
        goal=SILHOUETTE_GAIN,
    )


def _busiest(edge: NDArray[np.bool_]) -> tuple[slice, slice]:
    """Return rows and columns of the part of the picture, 1/`SHOWN` as high and wide, that has most edges."""
    height, width = (max(1, side // SHOWN) for side in edge.shape)
    count = uniform_filter(edge.astype(np.float64), (height, width), mode="constant")
    row, column = np.unravel_index(count.argmax(), count.shape)
    top, left = (
        int(np.clip(middle - part // 2, 0, side - part))
        for middle, part, side in zip((row, column), (height, width), edge.shape, strict=True)
    )
    return slice(top, top + height), slice(left, left + width)
