"""Follow one pixel from a file of depth images to the screen: `python -m tools.one_pixel MODEL X Y`.

Draws the model alone, reads back the output of each pass at the pixel, X from the left and Y from the top, and computes
from the impostor's tile, as described in `docs/one-pixel.md`, which point of the surface the pixel shows. It is checked
that this point is at the distance in the depth buffer, and appears in this pixel.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.assets.library import SceneLibrary
from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.images import BakedObject, Face
from depthwalk.cook.cook import CookOptions
from depthwalk.cook.lod_geometry import FACE_SHIFT, IMAGE_BITS
from depthwalk.errors import InputError
from depthwalk.geometry.quaternions import rotate
from depthwalk.gpu.device import Scope
from depthwalk.gpu.failures import GpuError
from depthwalk.params import Params
from depthwalk.reference.gbuffer import unpacked_surfaces
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.passes import default_passes
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Representation
from depthwalk.scene.loader import load_scene

_ALONG = 0.0, -0.25, -1.0  # direction of view, world: from in front, as docs/one-pixel.md shows it
_MOST_OFF = 1e-3  # of the distance, and pixels from the pixel's centre: the precision of 24-bit depth


@dataclass(frozen=True, kw_only=True)
class Read:
    """Hold what was read back at a pixel.

    Attributes
    ----------
    record : the impostor's `tile_records.COMPOSITE_RECORD`.
    texel : (2,) column and row in the atlas of the texel that the pixel shows.
    stored : the value in the tile's depth there, 1 − nearest·λ/w.
    owner : the number of the image that owns the texel, with its flags.
    distance : the distance in the visibility buffer, metres along the view axis.
    albedo : (3,) linear colour in the G-buffer.
    lit : (3,) linear light.
    """

    record: np.void
    texel: NDArray[np.int64]
    stored: float
    owner: int
    distance: float
    albedo: NDArray[np.float64]
    lit: NDArray[np.float64]


class ReadPass(Pass[Params]):
    """Read the output of the earlier passes at one pixel; draws nothing."""

    name = "read"
    reads = ("atlas", "visibility", "surface", "lit")
    writes = ()

    def __init__(self, x: int, y: int) -> None:
        super().__init__()
        self._x, self._y = x, y
        self.found: Read | None = None

    def setup(self, gl: Scope) -> None:
        """Create nothing through `gl`: this pass only reads."""

    def draw(self, frame: Frame, params: Params) -> None:
        """Keep the contents of the targets of `frame` at the pixel; nothing if no impostor is visible there."""
        targets, quads = frame.targets, frame.plan.composite
        column, row = self._x, frame.view.size[1] - 1 - self._y  # targets begin at the bottom
        visible = _texels(targets.visibility_texture, np.uint32, 2)[row, column]
        if not visible[0] >> IMAGE_BITS or not quads.aligned:
            return
        record = quads.records[0]
        texel = np.array([column, row]) + (record["tile"][:2] - record["pixel"]).astype(int)
        self.found = Read(
            record=record,
            texel=texel,
            stored=float(_texels(targets.atlas_depth, np.float32, 1)[texel[1], texel[0], 0]),
            owner=int(visible[0]) & ((1 << IMAGE_BITS) - 1),
            distance=float(1 / visible[1:].view(np.float32)[0]),
            albedo=unpacked_surfaces(_texels(targets.surface, np.uint32, 2)[row, column][None]).albedo[0],
            lit=_texels(targets.lit_texture, np.float16, 4)[row, column, :3].astype(float),
        )


def _texels(texture: moderngl.Texture, kind: type[np.generic], components: int) -> NDArray[Any]:
    """Return the texels (H, W, components) of a GL texture, row 0 at the bottom."""
    width, height = texture.size
    return np.frombuffer(texture.read(alignment=1), kind).reshape(height, width, components)


@dataclass(frozen=True, kw_only=True)
class Trace:
    """Hold the way back from a texel of an impostor to the surface; object frame, metres.

    Attributes
    ----------
    place : (2,) X − e, where the texel is on the warp plane, from the epipole.
    lam : λ = D_t / (D_t + depth).
    depth : of the surface behind the plane.
    sample : (2,) S − e = (X − e) / λ, where the surface lies behind the plane before the warp.
    point : (3,) P = C + (X − C) / λ.
    """

    place: NDArray[np.float64]
    lam: float
    depth: float
    sample: NDArray[np.float64]
    point: NDArray[np.float64]


def trace(read: Read) -> Trace:
    """Undo the warp of what was read (Liu, Liu and Wu 2007, §2.2), as composite.frag and `reference.warp` do."""
    record = read.record
    homography = np.array([record["to_x"], record["to_y"], record["to_w"]], float)
    within = read.texel + 0.5 - record["tile"][:2]
    *position, inverse = np.linalg.solve(homography, [*within, 1.0])  # (X − e, 1) / w
    place = np.array(position) / inverse
    lam = (1 - read.stored) / inverse / float(record["origin"][3])
    distance = float(record["normal"][3])  # D_t
    right, up, normal = (record[name][:3].astype(float) for name in ("right", "up", "normal"))
    ray = place[0] * right + place[1] * up - distance * normal  # X − C
    return Trace(
        place=place,
        lam=lam,
        depth=distance * (1 / lam - 1),
        sample=place / lam,
        point=record["origin"][:3] + ray / lam,
    )


def lines(read: Read, found: Trace, baked: BakedObject, shown: NDArray[np.uint8]) -> list[str]:
    """Return lines that describe the way of the pixel, whose sRGB colour is `shown` (3,), from the file on."""
    face, layer = Face(read.owner >> FACE_SHIFT & 7), read.owner & 7
    image = next(image for image in baked.images if (image.face, image.layer) == (face, layer))
    grid = FaceGrid.of(baked.cylinder, image)
    projection = grid.project(found.point[None])
    row, column = grid.texel_at(projection.u, projection.v)
    return [
        f"baked     image {image.name}, {grid.width} × {grid.height} texels: column {column[0]}, row {row[0]}, "
        f"{projection.depth[0]:.4f} m inward",
        f"sample    P = {_numbers(found.point)} m, object frame",
        f"plane     normal {_numbers(read.record['normal'][:3])}, D_t = {read.record['normal'][3]:.4f} m; "
        f"P is {found.depth:.4f} m behind it",
        f"warp      λ = {found.lam:.4f}; S − e = {_numbers(found.sample)} moves to X − e = {_numbers(found.place)} m",
        f"atlas     texel {read.texel[0]}, {read.texel[1]}: stored 1 − nearest·λ/w = {read.stored:.6f}",
        f"composite {read.distance:.4f} m along the view axis",
        f"resolve   albedo {_numbers(read.albedo)}, linear",
        f"light     {_numbers(read.lit)}, linear",
        f"output    {shown.tolist()}, sRGB",
    ]


def _numbers(values: NDArray[Any]) -> str:
    return np.array2string(values, precision=4, suppress_small=True, floatmode="fixed")


def check(found: Trace, read: Read, view: View, pixel: tuple[int, int], distance: float) -> None:
    """Raise RuntimeError if the point of `found` does not appear in `pixel`, `distance` metres away."""
    scale = float(read.record["viewer"][3])
    from_viewer = scale * rotate(read.record["rotation"].astype(float), found.point - read.record["viewer"][:3])
    across, up, ahead = view.axes @ from_viewer
    width, height = view.size
    place = np.array([width / 2 + view.focal_pixels * across / ahead, height / 2 - view.focal_pixels * up / ahead])
    off = np.abs(place - pixel - 0.5).max()
    if off > _MOST_OFF or max(abs(ahead - distance), abs(ahead - read.distance)) > _MOST_OFF * distance:
        raise RuntimeError(f"the point is {ahead} m away, not {distance} m, and {off} pixels off")


def follow(model: Path, pixel: tuple[int, int], size: tuple[int, int]) -> list[str]:
    """Draw `model` in a picture of `size` (width, height) and return the findings at `pixel`, a line for each pass.

    Raises InputError if the model or the pixel cannot be used, GpuError if nothing can be drawn.
    """
    if not all(0 <= at < side for at, side in zip(pixel, size, strict=True)):
        raise InputError(f"{pixel[0]} {pixel[1]}: is outside the picture of {size[0]} × {size[1]} pixels")
    scene = load_scene(model, overrides={"render.aa": "none"})
    library = SceneLibrary(scene.assets)
    if len(scene.objects) != 1 or not library.has_baked(0):
        raise InputError(f"{model}: must be one mesh, or the depth images of one")
    (cooked, *others) = library.cooked(0, CookOptions())
    if others:
        raise InputError(f"{model}: has several parts; give one that is baked as one")
    *passes, output = default_passes()
    reading = ReadPass(*pixel)
    with HeadlessRenderer(scene, library, size, Representation.DPCI, [*passes, reading, output]) as headless:
        view = View(headless.frame_all(along=_ALONG), size)
        headless.draw(view)
        if reading.found is None:
            raise InputError(f"{pixel[0]} {pixel[1]}: shows no impostor; the model covers the middle of the picture")
        found = trace(reading.found)
        check(found, reading.found, view, pixel, float(headless.distances()[pixel[1], pixel[0]]))
        return lines(reading.found, found, cooked.outline, headless.pixels()[pixel[1], pixel[0], :3])


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the result of `follow`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("model", type=Path)
    parser.add_argument("pixel", type=int, nargs=2, metavar=("X", "Y"))
    parser.add_argument("--size", type=int, nargs=2, default=(640, 480), help="of the picture, pixels")
    args = parser.parse_args(arguments)
    try:
        print("\n".join(follow(args.model, tuple(args.pixel), tuple(args.size))))
    except InputError as error:
        parser.error(str(error))
    except GpuError as error:
        sys.exit(f"one_pixel: {error}")


if __name__ == "__main__":
    main()
