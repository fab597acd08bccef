"""Declare the textures that passes hand to each other, and the framebuffers that draw into them.

`TARGETS` declares what each texture holds and `FRAMEBUFFERS` how they are drawn into; `render.targets` creates both. A
pass names in `reads` and `writes` the targets that it uses; `render.declared_targets` lets it reach no others.
docs/generate.py writes the table in docs/parameters.md and the figure docs/images/frame.svg from them.
"""

from dataclasses import dataclass
from typing import NamedTuple

import moderngl

from depthwalk.gpu.device import Scope


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

    def create(self, gl: Scope, size: tuple[int, int], samples: int = 1) -> moderngl.Texture:
        """Create a texture of this format, which `gl` owns. Raises GpuError where the driver refuses it.

        Parameters
        ----------
        gl : the owner.
        size : width and height, pixels.
        samples : samples per pixel.
        """
        if not self.dtype:
            return gl.depth_texture(size) if samples == 1 else gl.multisampled_depth(size, samples)
        if samples == 1:
            return gl.texture(size, self.components, self.dtype)
        return gl.multisampled_texture(size, samples, self.components, self.dtype)


RGBA8 = TextureFormat("RGBA8", 4, "f1")
RGBA16F = TextureFormat("RGBA16F", 4, "f2")
RG32UI = TextureFormat("RG32UI", 2, "u4")
R16UI = TextureFormat("R16UI", 1, "u2")
R8 = TextureFormat("R8", 1, "f1")
RG32F = TextureFormat("RG32F", 2, "f4")
DEPTH24 = TextureFormat("DEPTH24", 0, "")
MOST_LIGHT = 65504.0  # that RGBA16F holds; beyond is infinity, which becomes no number as soon as it is blended
NORMAL_BITS = 12  # of each octahedral coordinate in `surface`, see shaders/common/gbuffer.glsl
_ALL_FORMATS = TextureFormat("RG32UI, RGBA16F, DEPTH24", 0, "")


@dataclass(frozen=True, kw_only=True)
class Target:
    """Declare a target: what passes hand to each other under one name.

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
    "surface": Target(
        textures={"surface": RG32UI},
        holds="G-buffer: r = square root of the linear colour, specular; g = octahedral world normal, shininess",
    ),
    "depth": Target(
        textures={"depth": DEPTH24},
        holds="Depth buffer of the picture, 0 at the near and 1 at the far plane; 1 where nothing was drawn",
    ),
    "samples": Target(
        textures={"drawn": _ALL_FORMATS},
        holds="With several samples per pixel, `visibility`, `surface` and `depth` of each of them",
    ),
    "material_depth": Target(
        textures={"material_depth_texture": DEPTH24},
        holds="Number of the asset that a pixel shows, as a depth; less FULL_COVERAGE if it covers it in part",
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
        holds="r = fraction of the sun's light that reaches the pixel's surface",
    ),
    "ambient_visibility": Target(
        textures={"ambient_visibility": RG32F},
        holds="Half as wide and high: r = fraction of the ambient light that reaches a surface; g = metres along the "
        "view axis; none without ambient occlusion",
    ),
    "lit": Target(
        textures={"lit_texture": RGBA16F, "lit_before": RGBA16F},
        holds="The picture in linear light, premultiplied by a, which is 0 where nothing is in a transparent picture",
    ),
    "screen": Target(
        textures={"screen": RGBA8, "screen_before": RGBA8},
        holds="The finished picture in sRGB, in the requested size; set for each frame",
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


ALL_SURFACES = ("surface", "visibility_texture")
FRAMEBUFFERS: dict[str, Framebuffer] = {
    "atlas": Framebuffer(("atlas_owner",), "atlas_depth"),
    "lit_atlas": Framebuffer(("atlas_owner", "atlas_light"), "atlas_depth"),
    "visibility": Framebuffer(("visibility_texture",), "depth", all_samples=True),  # what depth images write
    "lit_visibility": Framebuffer(("visibility_texture", "tile_light"), "depth", all_samples=True),  # and lit tiles
    "polygons": Framebuffer(ALL_SURFACES, "depth", all_samples=True),  # what polygons write
    "first_polygons": Framebuffer(("surface",), "depth", all_samples=True),  # and those that nothing is drawn before
    "one_sample": Framebuffer(ALL_SURFACES, "depth"),  # one of the samples of `polygons`
    "one_lit_sample": Framebuffer((*ALL_SURFACES, "tile_light"), "depth"),  # and of `lit_visibility`
    "material_depth": Framebuffer((), "material_depth_texture"),
    "shaded": Framebuffer(("surface",), "material_depth_texture"),  # the pixels of one asset
    "shaded_lit": Framebuffer(("surface", "lit_texture"), "material_depth_texture"),  # and their light, forward
    "gbuffer": Framebuffer(("surface",), "depth"),
    "shadow": Framebuffer(("shadow_texture",)),
    "lighting": Framebuffer(("lit_texture",), "depth"),
    "lit": Framebuffer(("lit_texture",)),
    "covered": Framebuffer(("lit_texture",), "material_depth_texture"),  # pixels that are covered in part
    "screen": Framebuffer(("screen",)),
}
TARGET_OF = {attribute: name for name, target in TARGETS.items() for attribute in target.textures}
