"""Upload planar depth images as height fields, in which the rivals of the warp look surfaces up.

A height field has its own coordinates: u and v from 0 to 1 over the picture, as in its depth image, and the depth
behind the picture's plane, from 0 at the plane to 1 at the back of the object. u × v points inward.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import BakedObject
from depthwalk.gpu.device import Scope
from depthwalk.render.resources.bars import Bars, upload_bars
from depthwalk.render.resources.relative_depth import relative_depth
from depthwalk.types import Array


@dataclass(kw_only=True)
class HeightField:
    """Hold a height field on the GPU, whose GL objects belong to the asset store.

    Attributes
    ----------
    depth
        The depths, filtered linearly, 0 to 1, `relative_depth.EMPTY` where there is no surface.
    uniforms
        The uniforms of shaders/common/height_field.vert and .glsl and of field_frame.glsl, by name.
    distances
        The volume of distances to the surface, metres; None until it is needed.
    triangles
        The indices of the triangles between all texels, numbered row by row; None until they are needed.
    bars
        The bars of its texels; None until they are needed.
    relative
        The depths, (H, W) float32, in main memory; None until they are needed.
    """

    depth: moderngl.Texture
    uniforms: dict[str, Any]
    distances: moderngl.Texture3D | None = None
    triangles: moderngl.Buffer | None = None
    bars: Bars | None = None
    relative: NDArray[np.float32] | None = None

    @property
    def owned(self) -> tuple[moderngl.Texture | moderngl.Texture3D | moderngl.Buffer, ...]:
        """Return all GL objects of the field, to be freed with its asset."""
        bars = () if self.bars is None else (self.bars.ends, self.bars.triangles)
        return self.depth, *(made for made in (self.distances, self.triangles, *bars) if made is not None)

    @property
    def bytes(self) -> int:
        """Return how many bytes of GPU memory the field takes."""
        volume = 0 if self.distances is None else 2 * int(np.prod(self.distances.size))
        triangles = 0 if self.triangles is None else self.triangles.size
        bars = 0 if self.bars is None else self.bars.bytes
        return 4 * self.depth.width * self.depth.height + volume + triangles + bars

    def from_object(self, points: Array) -> Array:
        """Convert points (n, 3) from the object frame, metres, to the field's own coordinates (n, 3).

        Twin of `field_from_object` in shaders/common/field_frame.glsl.
        """
        width, height, deep = self.uniforms["field_size"]
        x, y, z = points.T
        return np.stack([x / width + 0.5, z / height + 0.5, (self.uniforms["field_top"] - y) / deep], -1)


class HeightFields:
    """Create height fields of depth objects when they are first needed, and free them with their objects.

    All methods take the number of a depth object that is a single planar depth image.

    Parameters
    ----------
    gl
        The scope of the asset store, which owns the GL objects.
    baked
        Returns the depth images of the depth object with a number.
    """

    def __init__(self, gl: Scope, baked: Callable[[int], BakedObject]) -> None:
        self._gl, self._baked = gl, baked
        self._fields: dict[int, HeightField] = {}

    @property
    def bytes(self) -> int:
        """Return how many bytes of GPU memory all fields take."""
        return sum(field.bytes for field in self._fields.values())

    def field(self, number: int) -> HeightField:
        """Return the height field of the depth object numbered `number`."""
        if number not in self._fields:
            self._fields[number] = upload_height_field(self._gl, self._baked(number))
        return self._fields[number]

    def distances(self, number: int, resolution: int, slices: int) -> moderngl.Texture3D:
        """Return the volume of distances of a height field, computing it if there is none of this size.

        Parameters
        ----------
        number
            The number of the depth object.
        resolution
            Largest width and height of the volume, texels; it is never larger than the picture.
        slices
            Its depth, texels.

        Returns
        -------
        moderngl.Texture3D
            The volume, metres.
        """
        field = self.field(number)
        size = min(field.depth.width, resolution), min(field.depth.height, resolution), slices
        if field.distances is None or field.distances.size != size:
            if field.distances is not None:
                self._gl.free(field.distances)
                field.distances = None
            from depthwalk.render.resources.distance_volume import distance_volume  # here: few scenes need SciPy

            volume = distance_volume(self._baked(number), size)
            field.distances = self._gl.volume(size, 1, "f2", volume.astype(np.float16).tobytes())
        return field.distances

    def triangles(self, number: int) -> moderngl.Buffer:
        """Return the uint32 indices of the triangles between all texels of the depth object numbered `number`."""
        field = self.field(number)
        if field.triangles is None:
            field.triangles = self._gl.buffer(texel_triangles(np.isfinite(self._baked(number).images[0].depth)))
        return field.triangles

    def bars(self, number: int) -> Bars:
        """Return the bars of the depth object numbered `number`."""
        field = self.field(number)
        if field.bars is None:
            solid = np.isfinite(self._baked(number).images[0].depth)
            field.bars = upload_bars(self._gl, self.relative(number), solid)
        return field.bars

    def relative(self, number: int) -> NDArray[np.float32]:
        """Return the depths (H, W) of the depth object numbered `number`, see `relative_depth`."""
        field = self.field(number)
        if field.relative is None:
            field.relative = np.ascontiguousarray(relative_depth(self._baked(number)))
        return field.relative

    def free(self, number: int) -> None:
        """Free the height field of the depth object numbered `number`, if there is one."""
        if (field := self._fields.pop(number, None)) is not None:
            self._gl.free(*field.owned)

    def forget(self) -> None:
        """Drop all fields, because their scope has been released."""
        self._fields.clear()


def upload_height_field(gl: Scope, baked: BakedObject) -> HeightField:
    """Upload the depths of an object that is a single planar depth image into a scope.

    Parameters
    ----------
    gl
        The scope that owns the texture.
    baked
        The object.

    Returns
    -------
    HeightField
        The field on the GPU.
    """
    depth, volume = relative_depth(baked), baked.cylinder
    height, width = depth.shape
    texture = gl.texture((width, height), 1, "f4", depth.tobytes())
    texture.filter = moderngl.LINEAR, moderngl.LINEAR
    uniforms = {
        "field_size": (2 * volume.half_width, 2 * volume.half_depth, volume.height),
        "field_top": volume.top,
        # The warped grid ends at the centres of the outermost texels, and so does this one.
        "field_margin": (0.5 / width, 0.5 / height),
    }
    return HeightField(depth=texture, uniforms=uniforms)


def texel_triangles(solid: NDArray[np.bool_]) -> NDArray[np.uint32]:
    """Return the two triangles between each four texels of a picture, counter-clockwise seen from its front.

    Parameters
    ----------
    solid
        (H, W) which texels have a surface; triangles with others are left out.

    Returns
    -------
    NDArray[np.uint32]
        (t, 3) numbers of texels, row by row; one degenerate triangle where there is none.
    """
    number = np.arange(solid.size, dtype=np.uint32).reshape(solid.shape)
    corner, right, up, opposite = number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:]
    cells = np.stack([np.stack([corner, up, right], -1), np.stack([opposite, right, up], -1)], -2)
    triangles = cells.reshape(-1, 3)
    kept = triangles[solid.ravel()[triangles].all(1)]
    return kept if len(kept) else np.zeros((1, 3), np.uint32)
