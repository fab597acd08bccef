"""Create textures of every kind that the program uses, each with its filter and wrap mode.

`gpu.device.Scope` implements the maker, and owns the textures.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.gpu.failures import GpuError
from depthwalk.gpu.mip_maps import SNORM, SRGB8_ALPHA8, Texels, mip_maps, set_mip_maps, srgb_mip_maps

_FETCHED = moderngl.NEAREST, moderngl.NEAREST
_TRILINEAR = moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR
_NEAREST_MIP_MAP = moderngl.LINEAR_MIPMAP_NEAREST, moderngl.LINEAR
_BILINEAR = moderngl.LINEAR, moderngl.LINEAR
_OWN_MIP_MAPS = 1 << 20  # texels, up to which a CPU makes mip-maps in less time than drivers may compile that program


class TextureLimits(NamedTuple):
    """Hold the driver's limits on the size of textures.

    Attributes
    ----------
    edge
        Texels along an edge of a 2-D texture.
    layers
        Layers of an array texture.
    volume
        Texels along an edge of a 3-D texture.
    """

    edge: int
    layers: int
    volume: int

    @classmethod
    def of(cls, context: moderngl.Context) -> "TextureLimits":
        """Return the limits of `context`, the current one."""
        kinds = "TEXTURE_SIZE", "ARRAY_TEXTURE_LAYERS", "3D_TEXTURE_SIZE"
        return cls(*[int(context.info[f"GL_MAX_{kind}"]) for kind in kinds])


class TextureMaker(ABC):
    """Create textures; a subclass registers and owns them.

    Every method that creates one raises GpuError if the driver refuses it, or if it would exceed the limits. Parameters
    mean the same everywhere: `size` is (width, height) or (width, height, layers or slices), texels; `components` is
    the number of values per texel, 1 to 4; `dtype` is moderngl's name, "f1" 8-bit from 0 to 1, "nu2" 16-bit likewise,
    "f2" half, "f4" float, "i2", "u4" and so on; `data` are the texels, layer by layer, the lower row first, and None
    leaves them undefined. Textures are clamped at their edges, except those that repeat.

    Attributes
    ----------
    owner
        The name of the part of the program that the textures are for, for messages.
    """

    def __init__(self, context: moderngl.Context, limits: TextureLimits, owner: str) -> None:
        """Create textures in `context`, within its `limits`; `owner` is named in messages."""
        self.owner = owner
        self._context = context
        self._limits = limits

    @abstractmethod
    def _make(self, kind: str, size: Any, create: Callable[[], Any]) -> Any:
        """Call `create`, check that the object exists, own it and return it.

        kind: its key in `Device.live`; size: its size for messages, None if it has none.
        """

    def texture(
        self, size: tuple[int, int], components: int, dtype: str = "f1", data: bytes | None = None
    ) -> moderngl.Texture:
        """Create and return a 2-D texture without filtering."""
        make = self._context.texture
        return self._flat(size, lambda: make(size, components, data, dtype=dtype), _FETCHED)

    def srgb_texture(self, texels: NDArray[np.uint8]) -> moderngl.Texture:
        """Create and return a texture as `tiling_texture` does, of 8-bit sRGB colours with linear alpha.

        texels: (H, W, 4), lower row first. Where H and W are powers of two, and there are at most `_OWN_MIP_MAPS`
        texels, mip-maps do not come from the driver.
        """
        height, width, _ = texels.shape
        if texels[..., 0].size > _OWN_MIP_MAPS or max(height.bit_count(), width.bit_count()) > 1:
            return self.tiling_texture((width, height), 4, texels.tobytes(), internal_format=SRGB8_ALPHA8)

        def create() -> moderngl.Texture:
            made = self._context.texture((width, height), 4, texels.tobytes(), internal_format=SRGB8_ALPHA8)
            set_mip_maps(self._context, made, srgb_mip_maps(texels), SRGB8_ALPHA8)
            return made

        return self._flat((width, height), create, _TRILINEAR, clamped=False)

    def tiling_texture(self, size: tuple[int, int], components: int, data: bytes, **layout: Any) -> moderngl.Texture:
        """Create and return a 2-D texture that repeats, with mip-maps and trilinear filtering.

        layout: moderngl's `dtype` or `internal_format`; 8-bit if neither is given.
        """
        make = self._context.texture
        texture = self._flat(size, lambda: make(size, components, data, **layout), _TRILINEAR, clamped=False)
        texture.build_mipmaps()
        texture.filter = _TRILINEAR  # again, as building mip-maps changes it
        return texture

    def mipmapped_texture(self, texels: Texels, levels: int) -> moderngl.Texture:
        """Create and return a 2-D texture with mip-maps and trilinear filtering.

        Parameters
        ----------
        texels
            (H, W, k) uint8 with k from 1 to 4, or int8 with k = 1 or 2; lower row first.
        levels
            The coarsest mip level; 0 is the finest, and each is half as wide and high as the one before. Fewer are made
            if a width or height becomes odd.
        """
        height, width, components = texels.shape
        signed = texels.dtype == np.int8
        layout: dict[str, Any] = {"dtype": "ni1", "internal_format": SNORM[components]} if signed else {}

        def create() -> moderngl.Texture:
            made = self._context.texture((width, height), components, texels.tobytes(), **layout)
            set_mip_maps(self._context, made, mip_maps(texels, levels))
            return made

        return self._flat((width, height), create, _TRILINEAR)

    def sky_texture(self, levels: Sequence[NDArray[np.float16]]) -> moderngl.Texture:
        """Create and return a texture of an equirectangular picture: filtered trilinearly, repeating horizontally.

        Parameters
        ----------
        levels
            (H, W, 3) float16, the whole picture, and all its mip-maps down to one row; upper rows first.
        """
        height, width, components = levels[0].shape

        def create() -> moderngl.Texture:
            made = self._context.texture((width, height), components, levels[0].tobytes(), dtype="f2")
            set_mip_maps(self._context, made, levels[1:])
            return made

        texture = self._flat((width, height), create, _TRILINEAR)
        texture.repeat_x = True
        return texture

    def table_texture(self, values: NDArray[np.float16]) -> moderngl.Texture:
        """Create and return a texture of a table (H, W, n) of at most four values, filtered bilinearly.

        Its rows and columns end at its edges.
        """
        height, width, components = values.shape
        make, data = self._context.texture, values.tobytes()
        return self._flat((width, height), lambda: make((width, height), components, data, dtype="f2"), _BILINEAR)

    def number_array(
        self, size: tuple[int, int, int], components: int, data: bytes | None, dtype: str
    ) -> moderngl.TextureArray:
        """Create and return an array texture of numbers, which shaders fetch without filtering."""
        return self._array(size, components, data, dtype, _FETCHED)

    def filtered_array(self, size: tuple[int, int, int], components: int, data: bytes) -> moderngl.TextureArray:
        """Create and return an array texture of 8 bits, 0 to 1, with mip-maps.

        Texels are filtered linearly within the nearest mip level.
        """
        array = self._array(size, components, data, "f1", _NEAREST_MIP_MAP)
        array.build_mipmaps()
        array.filter = _NEAREST_MIP_MAP  # again, as building mip-maps changes it
        return array

    def volume(self, size: tuple[int, int, int], components: int, dtype: str, data: bytes) -> moderngl.Texture3D:
        """Create and return a 3-D texture, filtered linearly."""
        if not 0 < min(size) <= max(size) <= self._limits.volume:
            raise GpuError(f"{self.owner}: volume of {size}; this driver allows 1 to {self._limits.volume}")
        make = self._context.texture3d
        volume: moderngl.Texture3D = self._make("volume", size, lambda: make(size, components, data, dtype=dtype))
        volume.filter = moderngl.LINEAR, moderngl.LINEAR
        volume.repeat_x = volume.repeat_y = volume.repeat_z = False
        return volume

    def multisampled_texture(
        self, size: tuple[int, int], samples: int, components: int, dtype: str = "f1"
    ) -> moderngl.Texture:
        """Create and return a 2-D texture of `samples` per texel, which shaders fetch one by one.

        There may be at most `Device.max_samples`.
        """
        make = self._context.texture
        return self._flat(size, lambda: make(size, components, samples=samples, dtype=dtype))

    def multisampled_depth(self, size: tuple[int, int], samples: int) -> moderngl.Texture:
        """Create and return a 24-bit depth texture with `samples` per texel, as `multisampled_texture` does."""
        return self._flat(size, lambda: self._context.depth_texture(size, samples=samples))

    def depth_texture(self, size: tuple[int, int]) -> moderngl.Texture:
        """Create and return a 24-bit depth texture.

        Shaders read its depths as numbers from 0 to 1, without comparison and without filtering.
        """
        texture = self._flat(size, lambda: self._context.depth_texture(size), _FETCHED)
        texture.compare_func = ""
        return texture

    def _flat(
        self,
        size: tuple[int, int],
        create: Callable[[], moderngl.Texture],
        filtered: tuple[int, int] | None = None,
        clamped: bool = True,
    ) -> moderngl.Texture:
        """Own and return the 2-D texture that `create` makes, if the driver allows its `size`.

        filtered: moderngl's filters for minification and magnification; None: it has several samples and no filter.
        """
        self._check_size(size)
        texture: moderngl.Texture = self._make("texture", size, create)
        if filtered is not None:
            texture.filter = filtered
            texture.repeat_x = texture.repeat_y = not clamped
        return texture

    def _array(
        self, size: tuple[int, int, int], components: int, data: bytes | None, dtype: str, filtered: tuple[int, int]
    ) -> moderngl.TextureArray:
        """Return a new array texture with the filters `filtered`, if the driver allows its size."""
        self._check_size(size[:2])
        if size[2] > self._limits.layers:
            raise GpuError(f"{self.owner}: {size[2]} texture layers; this driver allows {self._limits.layers}")
        make = self._context.texture_array
        array: moderngl.TextureArray = self._make(
            "texture_array", size, lambda: make(size, components, data, dtype=dtype)
        )
        array.filter = filtered
        array.repeat_x = array.repeat_y = False
        return array

    def _check_size(self, size: tuple[int, int]) -> None:
        """Raise GpuError where a texture (width, height) would exceed what the driver allows."""
        if not 0 < min(size) <= max(size) <= self._limits.edge:
            raise GpuError(
                f"{self.owner}: texture of {size[0]} × {size[1]}; this driver allows 1 to {self._limits.edge}"
            )
