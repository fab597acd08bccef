"""Declare and create the textures that passes hand to each other, and the framebuffers that draw into them.

`TARGETS` declares what each texture holds and `FRAMEBUFFERS` how they are drawn into; `Targets` creates both for one
size of picture. A pass names in `reads` and `writes` the targets that it uses; `render.declared_targets` lets it reach
no others. docs/generate.py writes the table in docs/parameters.md
and the figure docs/images/frame.svg from them.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import moderngl
import numpy as np

from depthwalk.gpu.device import Device, Scope
from depthwalk.gpu.multisampling import sample_offsets
from depthwalk.render.shadows.sun_uniforms import LampMaps, SunMaps

ATLAS_TEXELS = 1 << 23  # smallest atlas: 4096 × 2048, 50 MB


class TextureFormat(NamedTuple):
    """Describe a format of textures.

    Attributes
    ----------
    name : its name in OpenGL.
    components : numbers per texel; 0 for depth.
    dtype : how moderngl names the type of these numbers; "" for depth.
    """

    name: str
    components: int
    dtype: str


RGBA8 = TextureFormat("RGBA8", 4, "f1")
RGBA16 = TextureFormat("RGBA16", 4, "nu2")
RGBA16F = TextureFormat("RGBA16F", 4, "f2")
RG32UI = TextureFormat("RG32UI", 2, "u4")
R16UI = TextureFormat("R16UI", 1, "u2")
R8 = TextureFormat("R8", 1, "f1")
DEPTH24 = TextureFormat("DEPTH24", 0, "")
_ALL_FORMATS = TextureFormat("RG32UI, RGBA8, RGBA16, DEPTH24", 0, "")


@dataclass(frozen=True, kw_only=True)
class Target:
    """Declare what passes hand to each other under one name.

    Attributes
    ----------
    textures : the attributes of `Targets` that hold it, each with its format. Passes that read the target use these.
    holds : what is in it: channels, space and unit.
    """

    textures: dict[str, TextureFormat]
    holds: str

    @property
    def formats(self) -> str:
        """Return the names of the textures' OpenGL formats, joined by commas, as the documentation shows them."""
        return ", ".join(dict.fromkeys(texture_format.name for texture_format in self.textures.values()))


TARGETS: dict[str, Target] = {
    "atlas": Target(
        textures={"atlas_owner": R16UI, "atlas_depth": DEPTH24},
        holds="Impostor tiles: r = image that owns the texel, 0 for none; depth = 1 − nearest·λ/w, 1 where empty",
    ),
    "atlas_light": Target(
        textures={"atlas_light": RGBA16F},
        holds="Impostor tiles: rgb = linear light of the texel's surface; only with `light.mode: warp`",
    ),
    "visibility": Target(
        textures={"visibility_texture": RG32UI},
        holds="Visibility buffer: r = object and image, 0 for polygons; g = 1 / distance along the view axis, coverage",
    ),
    "tile_light": Target(
        textures={"tile_light": RGBA16F},
        holds="rgb = linear light, filtered from the tile that the pixel shows; only with `light.mode: warp`",
    ),
    "albedo": Target(
        textures={"albedo": RGBA8},
        holds="G-buffer: rgb = square root of the linear colour, a = specular strength",
    ),
    "surface": Target(
        textures={"surface": RGBA16},
        holds="G-buffer: rg = world normal, octahedral; b = shininess / MAX_SHININESS, 0 where lit already",
    ),
    "depth": Target(
        textures={"depth": DEPTH24},
        holds="Depth buffer of the picture, 0 at the near and 1 at the far plane; 1 where nothing was drawn",
    ),
    "samples": Target(
        textures={"drawn": _ALL_FORMATS},
        holds="With several samples per pixel, `visibility`, `albedo`, `surface` and `depth` of each of them",
    ),
    "material_depth": Target(
        textures={"material_depth_texture": DEPTH24},
        holds="Depth that stands for the asset that a pixel shows, less FULL_COVERAGE where that covers it in part",
    ),
    "sun_maps": Target(
        textures={"sun_maps": DEPTH24},
        holds="Shadow maps of the sun: depth along its light, cascades side by side; none where it casts no shadows",
    ),
    "lamp_maps": Target(
        textures={"lamp_maps": DEPTH24},
        holds="Shadow maps of the lamps: depth along their light, side by side; none where no lamp casts shadows",
    ),
    "shadow": Target(
        textures={"shadow_texture": R8},
        holds="r = part of the sun's light that reaches the pixel's surface",
    ),
    "lit": Target(
        textures={"lit_texture": RGBA16F, "lit_before": RGBA16F},
        holds="The picture in linear light, premultiplied by a, which is 0 where nothing is in a transparent picture",
    ),
    "screen": Target(
        textures={"screen": RGBA8},
        holds="The finished picture in sRGB, of the size that was asked for; set for each frame",
    ),
}


class Framebuffer(NamedTuple):
    """Name the textures of `Targets` that are drawn into together.

    Attributes
    ----------
    colours : the colour textures; none where only depth is written.
    depth : the depth texture to test against, and to write if the pass does so; None: no depth.
    all_samples : whether the framebuffer has all samples of a pixel, as those do that objects are drawn into.
    """

    colours: tuple[str, ...]
    depth: str | None = None
    all_samples: bool = False


_SURFACES = ("albedo", "surface")
_ALL_SURFACES = (*_SURFACES, "visibility_texture")
FRAMEBUFFERS: dict[str, Framebuffer] = {
    "atlas": Framebuffer(("atlas_owner",), "atlas_depth"),
    "lit_atlas": Framebuffer(("atlas_owner", "atlas_light"), "atlas_depth"),
    "visibility": Framebuffer(("visibility_texture",), "depth", all_samples=True),  # what depth images write
    "lit_visibility": Framebuffer(("visibility_texture", "tile_light"), "depth", all_samples=True),  # and lit tiles
    "polygons": Framebuffer(_ALL_SURFACES, "depth", all_samples=True),  # what polygons write
    "first_polygons": Framebuffer(_SURFACES, "depth", all_samples=True),  # and those that nothing is drawn before
    "one_sample": Framebuffer(_ALL_SURFACES, "depth"),  # one of the samples of `polygons`
    "one_lit_sample": Framebuffer((*_ALL_SURFACES, "tile_light"), "depth"),  # and of `lit_visibility`
    "material_depth": Framebuffer((), "material_depth_texture"),
    "shaded": Framebuffer(_SURFACES, "material_depth_texture"),  # the pixels of one asset
    "shaded_lit": Framebuffer((*_SURFACES, "lit_texture"), "material_depth_texture"),  # and their light, forward
    "gbuffer": Framebuffer(_SURFACES, "depth"),
    "shadow": Framebuffer(("shadow_texture",)),
    "lighting": Framebuffer(("lit_texture",), "depth"),
    "lit": Framebuffer(("lit_texture",)),
    "covered": Framebuffer(("lit_texture",), "material_depth_texture"),  # pixels that are covered in part
    "screen": Framebuffer(("screen",)),
}
TARGET_OF = {attribute: name for name, target in TARGETS.items() for attribute in target.textures}


@dataclass(frozen=True, kw_only=True)
class Drawn:
    """Hold the textures that objects and ground are drawn into, of one sample per pixel or several.

    Attributes
    ----------
    albedo, surface, visibility_texture, depth : as the attributes of `Targets` with these names.
    tile_light : likewise; None where tiles are not lit.
    """

    albedo: moderngl.Texture
    surface: moderngl.Texture
    visibility_texture: moderngl.Texture
    depth: moderngl.Texture
    tile_light: moderngl.Texture | None = None


class TileAtlas:
    """Hold the textures of the tile atlas. They outlive the other targets, whose size may change in between.

    Each is made when it is first used: a scene of meshes alone needs none of their 64 MB and more.

    Parameters
    ----------
    device : the owner of the GL context.
    size : width and height, texels, see `atlas_size`.
    lit : whether tiles hold lit colours too.

    Attributes
    ----------
    size : width and height, texels.
    lit : whether tiles hold lit colours too.
    """

    def __init__(self, device: Device, size: tuple[int, int], lit: bool = False) -> None:
        self.size, self.lit, self._gl = size, lit, device.scope("atlas")

    @cached_property
    def owner(self) -> moderngl.Texture:
        """Return the texture `atlas_owner` of the target `atlas`. Raises GpuError where the driver refuses it."""
        return _texture(self._gl, self.size, TARGETS["atlas"].textures["atlas_owner"])

    @cached_property
    def depth(self) -> moderngl.Texture:
        """Return the texture `atlas_depth` of the target `atlas`. Raises GpuError where the driver refuses it."""
        return _texture(self._gl, self.size, TARGETS["atlas"].textures["atlas_depth"])

    @cached_property
    def light(self) -> moderngl.Texture:
        """Return the texture of the target `atlas_light`, of lit tiles. Raises GpuError where the driver refuses it."""
        return _texture(self._gl, self.size, TARGETS["atlas_light"].textures["atlas_light"])

    @cached_property
    def framebuffer(self) -> moderngl.Framebuffer:
        """Return what draws into owner and depth. Raises GpuError where the driver refuses it."""
        return self._gl.framebuffer([self.owner], self.depth)

    @cached_property
    def lit_framebuffer(self) -> moderngl.Framebuffer:
        """Return what draws into owner, light and depth, of lit tiles. Raises GpuError where the driver refuses it."""
        return self._gl.framebuffer([self.owner, self.light], self.depth)

    def release(self) -> None:
        """Free the textures."""
        self._gl.release()


class Targets:
    """Hold the textures of `TARGETS` and the framebuffers of `FRAMEBUFFERS`, as attributes of these names.

    Parameters
    ----------
    device : the owner of the GL context.
    size : width and height, pixels.
    samples : samples per pixel of the textures that objects are drawn into.
    atlas : the atlas of the impostor tiles, which somebody else frees; None: one of its own. Without lit tiles in it,
        the targets `atlas_light` and `tile_light` do not exist, nor do framebuffers that draw into them.

    Attributes
    ----------
    drawn : the textures that `visibility` and `polygons` draw into: textures of their own if pixels have several
        samples, else those that the attributes hold. All other textures have one sample per pixel.
    screen : the framebuffer of the finished picture, set for each frame.
    tile_atlas : the textures of the targets `atlas` and `atlas_light`.
    atlas_size : width and height of the atlas, texels.
    offsets : (samples, 2) places of the samples from the pixel's middle, pixels to the right and up.
    sun_maps, lamp_maps : the shadow maps, set by the pass that draws them; None where nothing casts shadows.

    Raises
    ------
    GpuError
        Where the driver refuses a texture, as for want of memory; nothing stays created.
    """

    visibility_texture: moderngl.Texture
    tile_light: moderngl.Texture
    albedo: moderngl.Texture
    surface: moderngl.Texture
    depth: moderngl.Texture
    material_depth_texture: moderngl.Texture
    shadow_texture: moderngl.Texture
    lit_texture: moderngl.Texture
    visibility: moderngl.Framebuffer
    lit_visibility: moderngl.Framebuffer
    polygons: moderngl.Framebuffer
    first_polygons: moderngl.Framebuffer
    one_sample: moderngl.Framebuffer
    one_lit_sample: moderngl.Framebuffer
    material_depth: moderngl.Framebuffer
    shaded: moderngl.Framebuffer
    shaded_lit: moderngl.Framebuffer
    gbuffer: moderngl.Framebuffer
    shadow: moderngl.Framebuffer
    lighting: moderngl.Framebuffer
    lit: moderngl.Framebuffer
    covered: moderngl.Framebuffer
    screen: moderngl.Framebuffer

    def __init__(self, device: Device, size: tuple[int, int], samples: int = 1, atlas: TileAtlas | None = None) -> None:
        self.size, self.samples = size, samples
        self.gl = device.scope("targets")
        self._owns_atlas = atlas is None
        self.tile_atlas = atlas or TileAtlas(device, atlas_size(size, device.max_texture_size))
        self.atlas_size = self.tile_atlas.size
        self.sun_maps: SunMaps | None = None
        self.lamp_maps: LampMaps | None = None
        self._before: tuple[moderngl.Texture, moderngl.Framebuffer] | None = None
        try:
            self._create(device, self.tile_atlas.lit)
        except BaseException:  # what was created before a texture is refused
            self.release()
            raise

    def _create(self, device: Device, lit: bool) -> None:
        """Create the textures and framebuffers but for those of the atlas. lit: whether tiles are."""
        made = [
            "visibility",
            "albedo",
            "surface",
            "depth",
            "material_depth",
            "shadow",
            *(["tile_light"] if lit else []),
        ]
        for target in made:
            for name, texture_format in TARGETS[target].textures.items():
                setattr(self, name, _texture(self.gl, self.size, texture_format))
        self.lit_texture = _texture(self.gl, self.size, RGBA16F)
        self.drawn, self.offsets = self._textures_of_samples(), np.zeros((1, 2))
        if self.samples > 1:
            self.offsets = sample_offsets(device, self.samples)
        for name, framebuffer in FRAMEBUFFERS.items():
            exists = lit or "tile_light" not in framebuffer.colours
            if name not in ("atlas", "lit_atlas", "screen") and exists:
                setattr(self, name, self._framebuffer(framebuffer))

    def _textures_of_samples(self) -> Drawn:
        names = [name for name in (*_ALL_SURFACES, "depth", "tile_light") if hasattr(self, name)]
        textures: dict[str, moderngl.Texture] = {name: getattr(self, name) for name in names}
        if self.samples > 1:
            formats = {name: TARGETS[TARGET_OF[name]].textures[name] for name in textures}
            textures = {
                name: _texture(self.gl, self.size, texture_format, self.samples)
                for name, texture_format in formats.items()
            }
        return Drawn(**textures)

    def _framebuffer(self, declaration: Framebuffer) -> moderngl.Framebuffer:
        owner = self.drawn if declaration.all_samples else self
        depth = None if declaration.depth is None else getattr(owner, declaration.depth)
        return self.gl.framebuffer([getattr(owner, name) for name in declaration.colours], depth)

    @cached_property
    def atlas_owner(self) -> moderngl.Texture:
        """Return the texture of the atlas that says which image owns a texel."""
        return self.tile_atlas.owner

    @cached_property
    def atlas_depth(self) -> moderngl.Texture:
        """Return the texture of the atlas that holds depth."""
        return self.tile_atlas.depth

    @cached_property
    def atlas_light(self) -> moderngl.Texture:
        """Return the texture of the atlas that holds light. Raises AttributeError where tiles are not lit."""
        return self._lit_tiles().light

    @cached_property
    def atlas(self) -> moderngl.Framebuffer:
        """Return what draws into the atlas, but no light."""
        return self.tile_atlas.framebuffer

    @cached_property
    def lit_atlas(self) -> moderngl.Framebuffer:
        """Return what draws into the atlas and its light. Raises AttributeError where tiles are not lit."""
        return self._lit_tiles().lit_framebuffer

    def _lit_tiles(self) -> TileAtlas:
        if not self.tile_atlas.lit:
            raise AttributeError("impostor tiles are not lit")
        return self.tile_atlas

    @property
    def defines(self) -> tuple[str, ...]:
        """Return the defines of shaders that draw depth images into these targets, or read what is drawn.

        They are `MULTISAMPLED` where pixels have several samples, otherwise none.
        """
        return ("MULTISAMPLED",) if self.samples > 1 else ()

    def lit_before(self) -> moderngl.Texture:
        """Return a copy of `lit` as it is now, filtered linearly, for a pass that both reads and draws it."""
        if self._before is None:
            texture = _texture(self.gl, self.size, RGBA16F)
            texture.filter = moderngl.LINEAR, moderngl.LINEAR
            self._before = texture, self.gl.framebuffer([texture])
        texture, framebuffer = self._before
        self.gl.device.context.copy_framebuffer(framebuffer, self.lit)
        return texture

    def release(self) -> None:
        """Free the textures and framebuffers, but for an atlas that somebody else frees."""
        self.gl.release()
        if self._owns_atlas:
            self.tile_atlas.release()


def _texture(gl: Scope, size: tuple[int, int], texture_format: TextureFormat, samples: int = 1) -> moderngl.Texture:
    _, components, dtype = texture_format
    if texture_format is DEPTH24:
        return gl.depth_texture(size) if samples == 1 else gl.multisampled_depth(size, samples)
    if samples == 1:
        return gl.texture(size, components, dtype)
    return gl.multisampled_texture(size, samples, components, dtype)


def atlas_size(size: tuple[int, int], limit: int) -> tuple[int, int]:
    """Return how large an atlas is: four pictures' worth of texels in powers of two, at least `ATLAS_TEXELS`.

    Parameters
    ----------
    size : width and height of the picture, pixels.
    limit : the largest width and height of a texture, texels.

    Returns
    -------
    Width and height, texels.
    """
    texels = max(ATLAS_TEXELS, 4 * size[0] * size[1])
    width = 1 << max(12, (int(texels**0.5) - 1).bit_length())
    height = 1 << max(11, (-(-texels // width) - 1).bit_length())
    return min(width, limit), min(height, limit)
