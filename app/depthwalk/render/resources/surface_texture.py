"""Upload the virtual textures of depth images, colours and normals, at a given resolution.

`render.resources.texture_streaming` chooses that resolution.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.cook.texture_detail import Detail
from depthwalk.cook.virtual_texture import LEVELS, VirtualTexture
from depthwalk.gpu.device import Scope
from depthwalk.gpu.mip_maps import Texels, mip_maps
from depthwalk.types import Array


@dataclass(frozen=True, kw_only=True)
class SurfaceTexture:
    """Hold a virtual texture on the GPU, whose GL objects belong to the asset store.

    Attributes
    ----------
    normals
        The normals of the virtual texture, tile by tile.
    colours
        The colours of the virtual texture, tile by tile; one or two components where `tints` has the others.
    tints
        The other components of the colours, for 2 × 2 texels each.
    coordinates
        Where the texels lie in the object's own texture; None where it has none, or they are left out.
    base
        The object's own texture; None where `coordinates` is.
    reflections
        Roughness and metalness, tile by tile; None where the texels do not tell them.
    page_table
        The table of where each tile lies in these pictures, one layer per depth image.
    detail
        Which part of the whole texture is on the GPU.
    defines
        Defines of shaders/common/virtual_texture.glsl: which colours the object has, and whether texels are left out.
    uniforms
        Values of the object's uniform block, by name, see `depth_image_object.DEPTH_OBJECT`.
    bytes
        Bytes of GPU memory, mip-maps included.
    """

    normals: moderngl.Texture
    colours: moderngl.Texture
    tints: moderngl.Texture
    coordinates: moderngl.Texture | None
    base: moderngl.Texture | None
    reflections: moderngl.Texture | None
    page_table: moderngl.TextureArray
    detail: Detail
    defines: tuple[str, ...]
    uniforms: dict[str, Any]
    bytes: int

    @cached_property
    def images(self) -> tuple[moderngl.Texture | moderngl.TextureArray | None, ...]:
        """Return the textures in the order of their texture units, None for those that it lacks."""
        pages = self.normals, self.colours, self.tints, self.page_table
        return *pages, self.coordinates, self.base, self.reflections

    @property
    def owned(self) -> tuple[moderngl.Texture | moderngl.TextureArray, ...]:
        """Return all GL objects of this texture, to be freed when it is replaced."""
        return tuple(image for image in self.images if image is not None)


def texture_bytes(pages: VirtualTexture, tells_roughness: bool) -> int:
    """Return how many bytes of GPU memory a virtual texture takes; parameters as for `upload_texture`."""
    told = sum(pages.normals[..., :2].size >> 2 * level for level in range(LEVELS + 1)) if tells_roughness else 0
    return pages.table.nbytes + pages.bytes_with_mip_maps + told


def upload_texture(gl: Scope, pages: VirtualTexture, detail: Detail, tells_roughness: bool = False) -> SurfaceTexture:
    """Upload a virtual texture into a scope.

    Parameters
    ----------
    gl
        The scope that owns the GL objects.
    pages
        The texture as `at_detail` returned it for `detail`.
    detail
        Which part of the whole texture that is.
    tells_roughness
        Whether its texels tell roughness and metalness, see `BakedObject`.

    Returns
    -------
    SurfaceTexture
        The texture on the GPU.
    """
    variants = {
        "COLOURED": pages.colours.size,
        "TINTED": pages.tints.size,
        "PAIRED": pages.tints.size and pages.colours.shape[2] == 2,
        "PARTIAL": detail,
        "COORDINATES": pages.has_coordinates,
    }
    left_out, tints_left_out = pages.colour_level, max(pages.colour_level - 1, 0)
    table = _of_one_kind(pages.table, (1, 2), 1)
    images, rows, columns, _ = table.shape
    return SurfaceTexture(
        normals=_upload_picture(gl, pages.normals, LEVELS),
        colours=_upload_picture(gl, _at_level(pages.colours, left_out), LEVELS - left_out),
        tints=_upload_picture(gl, _at_level(pages.tints, tints_left_out), LEVELS - 1 - tints_left_out),
        coordinates=_upload_coordinates(gl, pages.coordinates) if pages.has_coordinates else None,
        base=_upload_base(gl, pages.texture) if pages.has_coordinates else None,
        reflections=_upload_picture(gl, _reflections(pages), LEVELS) if tells_roughness else None,
        page_table=gl.number_array((columns, rows, images), 2, table.tobytes(), "i2"),
        detail=detail,
        defines=tuple(name for name, is_needed in variants.items() if is_needed),
        uniforms={
            "first_colour": tuple(pages.palette[0].tolist()),
            "colour_axes": tuple(pages.palette[1:].ravel().tolist()),
            "first_rows": pages.first_rows,
            "last_mip_tier": pages.last_mip_tier,
            "page_detail": int(detail),
            "colour_level": pages.colour_level,
        },
        bytes=texture_bytes(pages, tells_roughness),
    )


def _reflections(pages: VirtualTexture) -> NDArray[np.uint8]:
    """Return roughness and metalness (H, W, 2), 255 for 1, of codes in the place of specular strengths.

    They are filtered like colours; codes cannot be, as between those of metal and of anything else rough metal lies.
    """
    from depthwalk.bake.reflection_code import reflections_of_codes  # here: few objects have maps

    codes: Array = np.full(pages.normals.shape[:2], pages.palette[0, 3])
    if pages.tints.size:
        own = pages.colours.shape[2]
        codes += pages.colours / 127 @ pages.palette[1 : 1 + own, 3]
        codes += (pages.tints / 255 @ pages.palette[1 + own :, 3]).repeat(2, 0).repeat(2, 1)
    elif pages.colours.size:
        codes = pages.colours[..., 3] / 255
    return np.round(255 * np.stack(reflections_of_codes(codes), -1).clip(0, 1)).astype(np.uint8)


def _upload_picture(gl: Scope, texels: NDArray[np.int8] | NDArray[np.uint8], levels: int) -> moderngl.Texture:
    """Upload a picture of the virtual texture, (H, W, k), signed only if k is 1 or 2, with mip-maps up to `levels`."""
    if not texels.size:
        return gl.mipmapped_texture(np.zeros((1, 1, 1), np.uint8), 0)  # no shader looks it up
    return gl.mipmapped_texture(_of_one_kind(texels, (0, 1), 1 << levels), levels)


def _of_one_kind(texels: NDArray[Any], sides: tuple[int, int], step: int) -> NDArray[Any]:
    """Return texels with their last rows and columns repeated where their number would be a power of two.

    Mesa's software rasteriser compiles a program once for textures whose width, or height, is a power of two, and once
    for others (`pot_width` in gallivm's lp_sampler_static_texture_state). With textures of one kind, no asset that
    comes into sight has to wait for that, a third of a second each time.

    sides: the axes of rows and columns; step: how many are added at once, so that mip-maps keep their places.
    """
    for side in sides:
        while texels.shape[side].bit_count() == 1:
            last = texels.take([-1], side)
            texels = np.concatenate([texels, last.repeat(step, side)], side)
    return texels


def _at_level(texels: Texels, level: int) -> Texels:
    """Return the mip-map of a picture (H, W, k) of number `level`; 0 is the picture itself."""
    return mip_maps(texels, level)[-1] if level and texels.size else texels


def _upload_coordinates(gl: Scope, coordinates: NDArray[np.uint16]) -> moderngl.Texture:
    """Upload a picture of texture coordinates, (H, W, 2), without mip-maps."""
    return gl.texture((coordinates.shape[1], coordinates.shape[0]), 2, "u2", coordinates.tobytes())


def _upload_base(gl: Scope, texture: NDArray[np.uint8]) -> moderngl.Texture:
    """Upload a texture (h, w, 3), sRGB, in the format of mesh textures, so that both are filtered alike."""
    opaque = np.full((*texture.shape[:2], 1), 255, np.uint8)
    return gl.srgb_texture(np.concatenate([texture, opaque], -1))
