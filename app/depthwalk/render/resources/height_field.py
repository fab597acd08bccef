"""Upload planar depth images as height fields, which the rivals of the warp look surfaces up in.

A height field has coordinates of its own: u and v from 0 to 1 over the picture, as its depth image has them, and the
depth behind the picture's plane, from 0 at the plane to 1 at the back of the object. u × v points inward.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import BakedObject, Cylinder
from depthwalk.gpu.device import Scope

EMPTY = 1e4
"""Depth of a texel without a surface. Blended with others, by so little as a ten thousandth, it lies behind the box."""


@dataclass(frozen=True, kw_only=True)
class HeightField:
    """Hold a height field on the GPU, whose GL objects belong to the asset store.

    Attributes
    ----------
    depth
        The depths, filtered linearly, 0 to 1, `EMPTY` where there is no surface.
    uniforms
        The uniforms of shaders/common/height_field.vert and .glsl, by name.
    """

    depth: moderngl.Texture
    uniforms: dict[str, Any]

    @property
    def owned(self) -> tuple[moderngl.Texture, ...]:
        """Return all GL objects of the field, so that they are freed with its asset."""
        return (self.depth,)

    @property
    def bytes(self) -> int:
        """Return how many bytes of GPU memory the field takes."""
        return 4 * self.depth.width * self.depth.height


class HeightFields:
    """Make height fields of depth objects when they are first drawn so, and free them with their objects.

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
        """Return the height field of the depth object numbered `number`, which is one planar depth image."""
        if number not in self._fields:
            self._fields[number] = upload_height_field(self._gl, self._baked(number))
        return self._fields[number]

    def free(self, number: int) -> None:
        """Free what was made of the depth object numbered `number`, if anything was."""
        if (field := self._fields.pop(number, None)) is not None:
            self._gl.free(*field.owned)

    def forget(self) -> None:
        """Forget all fields, because their scope has been released."""
        self._fields.clear()


def relative_depth(baked: BakedObject) -> NDArray[np.float32]:
    """Return the depths (H, W) of one planar depth image as parts of the object's depth, `EMPTY` where none is."""
    depth = baked.images[0].depth
    return np.where(np.isfinite(depth), depth / np.float32(baked.cylinder.height), np.float32(EMPTY))


def upload_height_field(gl: Scope, baked: BakedObject) -> HeightField:
    """Upload the depths of an object of one planar depth image into a scope.

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
    depth = relative_depth(baked)
    height, width = depth.shape
    texture = gl.texture((width, height), 1, "f4", depth.tobytes())
    texture.filter = moderngl.LINEAR, moderngl.LINEAR
    # The warped grid ends in the middles of the outermost texels, and so does this one.
    margin = 0.5 / width, 0.5 / height
    return HeightField(depth=texture, uniforms=_place(baked.cylinder) | {"field_margin": margin})


def _place(volume: Cylinder) -> dict[str, Any]:
    """Return the uniforms that take the coordinates of a field to the object frame."""
    return {
        "field_size": (2 * volume.half_width, 2 * volume.half_depth, volume.height),
        "field_top": volume.top,
    }
