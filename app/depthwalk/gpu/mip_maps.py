"""Compute mip-maps on the CPU, and upload them to textures, which moderngl cannot do.

A software driver that generates mip-maps compiles a program for each format: half a second before the first picture.
Besides, Mesa's approximates the transfer function of sRGB, and is off by up to 4 of 255.
"""

import ctypes
from collections.abc import Sequence
from functools import cache
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.colour import linear_from_srgb8, srgb8_from_linear

Texels = NDArray[np.uint8] | NDArray[np.int8]
Halves = NDArray[np.float16]

_TEXTURE_2D, _MAX_LEVEL = 0x0DE1, 0x813D
_FORMATS = {1: 0x1903, 2: 0x8227, 3: 0x1907, 4: 0x1908}  # GL_RED, GL_RG, GL_RGB, GL_RGBA, by components
_INTERNAL = {1: 0x8229, 2: 0x822B, 3: 0x8051, 4: 0x8058}  # GL_R8, GL_RG8, GL_RGB8, GL_RGBA8
SNORM = {1: 0x8F94, 2: 0x8F95}  # GL_R8_SNORM, GL_RG8_SNORM
_HALF = {3: 0x881B}  # GL_RGB16F
SRGB8_ALPHA8 = 0x8C43  # GL_SRGB8_ALPHA8: texels are decoded before they are filtered
# GL_UNSIGNED_BYTE, GL_BYTE, GL_HALF_FLOAT, with the formats of textures that hold such numbers
_NUMBERS = {"uint8": (0x1401, _INTERNAL), "int8": (0x1400, SNORM), "float16": (0x140B, _HALF)}
_FUNCTION = getattr(ctypes, "WINFUNCTYPE", ctypes.CFUNCTYPE)  # on Windows OpenGL has another calling convention
_TEX_IMAGE = _FUNCTION(None, *[ctypes.c_int] * 8, ctypes.c_void_p)
_TEX_PARAMETER = _FUNCTION(None, *[ctypes.c_int] * 3)


def mip_maps(texels: Texels, levels: int) -> list[Texels]:
    """Compute mip-maps: smaller pictures, in which each texel is the rounded mean of four of the level before.

    Parameters
    ----------
    texels
        (H, W, k) uint8, or int8 with k = 1 or 2.
    levels
        How many pictures to make; fewer are made where a height or width becomes odd.

    Returns
    -------
    list
        The pictures, (H / 2, W / 2, k), (H / 4, W / 4, k) …, of the same type.
    """
    made = [texels]
    while len(made) <= levels and not (made[-1].shape[0] % 2 or made[-1].shape[1] % 2):
        made.append(_halved(made[-1]))
    return made[1:]


def _halved(texels: Texels) -> Texels:
    height, width, components = texels.shape
    wide = np.int16 if texels.dtype == np.int8 else np.uint16
    rows = np.add(texels[0::2], texels[1::2], dtype=wide)
    # All components of a texel are added at once, as one long number, in which no component carries into the next.
    is_one = components in (2, 4) and texels.dtype == np.uint8
    whole = rows.view(f"u{2 * components}")[..., 0] if is_one else rows
    sums = np.ascontiguousarray(whole[:, 0::2] + whole[:, 1::2]).view(wide)
    means: Any = (sums + 2) >> 2
    halved: Texels = means.astype(texels.dtype).reshape(height // 2, width // 2, components)
    return halved


def srgb_mip_maps(texels: NDArray[np.uint8]) -> list[NDArray[np.uint8]]:
    """Compute the mip-maps of a picture in sRGB, down to one texel; each texel is the mean light of four.

    Parameters
    ----------
    texels
        (H, W, 4) uint8, colours in sRGB and linear alpha; H and W are powers of two.

    Returns
    -------
    list
        The pictures, of half the height and width each, where these are more than 1.
    """
    light: NDArray[np.uint16] = np.empty(texels.shape, np.uint16)
    light[..., :3], light[..., 3] = _light_of_byte()[texels[..., :3]], np.uint16(257) * texels[..., 3]
    made = []
    while max(light.shape[:2]) > 1:
        for side in (side for side in (0, 1) if light.shape[side] > 1):
            pairs = light.reshape(*light.shape[:side], -1, 2, *light.shape[side + 1 :])
            sums: Any = pairs.take([0], side + 1).astype(np.uint32) + pairs.take([1], side + 1)
            light = ((sums.squeeze(side + 1) + 1) >> 1).astype(np.uint16)
        made.append(np.concatenate([_byte_of_light()[light[..., :3]], (light[..., 3:] >> 8).astype(np.uint8)], -1))
    return made


@cache
def _light_of_byte() -> NDArray[np.uint16]:
    """Return the light of each sRGB value, 65535 for 1: twenty steps for the darkest of them."""
    light: NDArray[np.uint16] = np.round(linear_from_srgb8(np.arange(256, dtype=np.uint8)) * 65535).astype(np.uint16)
    return light


@cache
def _byte_of_light() -> NDArray[np.uint8]:
    """Return the nearest sRGB value of each light, 65535 for 1."""
    return srgb8_from_linear(np.arange(65536) / 65535)


def set_mip_maps(
    context: moderngl.Context,
    texture: moderngl.Texture,
    pictures: Sequence[Texels] | Sequence[Halves],
    internal_format: int | None = None,
) -> None:
    """Replace the mip-maps of a 2-D texture.

    Parameters
    ----------
    context
        The context, which must be the current one; its texture unit 0 is left with the texture.
    texture
        A texture of 8-bit components, or of half floats, that was just created, so that GL still assumes rows without
        padding.
    pictures
        Levels 1, 2, …, as `mip_maps` returns them, or three half floats per texel, (H, W, 3) contiguous.
    internal_format
        The texture's format, where it is not the one that texels of this type have by default.
    """
    texture.use(0)
    for level, texels in enumerate(pictures, start=1):
        height, width, components = texels.shape
        number, kinds = _NUMBERS[texels.dtype.name]
        form = _FORMATS[components]
        _load(context, "glTexImage2D", _TEX_IMAGE)(
            _TEXTURE_2D, level, internal_format or kinds[components], width, height, 0, form, number, texels.ctypes.data
        )
    _load(context, "glTexParameteri", _TEX_PARAMETER)(_TEXTURE_2D, _MAX_LEVEL, len(pictures))


def _load(context: moderngl.Context, name: str, kind: Any) -> Any:
    """Return the OpenGL function `name` of the context, as the ctypes prototype `kind`."""
    return kind(context.mglo._context.load_opengl_function(name))
