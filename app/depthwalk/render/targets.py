"""Create the textures that passes hand to each other, and the framebuffers that draw into them.

`render.target_table` declares them; `Targets` creates all of them for one size of picture.
"""

from dataclasses import dataclass
from functools import cached_property

import moderngl
import numpy as np

from depthwalk.gpu.device import Device
from depthwalk.gpu.multisampling import sample_offsets
from depthwalk.render.lighting.ambient_visibility import AmbientVisibility
from depthwalk.render.shadows.sun_uniforms import LampMaps, SunMaps
from depthwalk.render.target_table import ALL_SURFACES, FRAMEBUFFERS, RGBA16F, TARGET_OF, TARGETS, Framebuffer
from depthwalk.render.tile_atlas import TileAtlas, atlas_size


@dataclass(frozen=True, kw_only=True)
class Drawn:
    """Hold the textures that objects and ground are drawn into, of one sample per pixel or several.

    Attributes
    ----------
    surface, visibility_texture, depth : see the attributes of `Targets` with these names.
    tile_light : likewise; None where tiles are not lit.
    """

    surface: moderngl.Texture
    visibility_texture: moderngl.Texture
    depth: moderngl.Texture
    tile_light: moderngl.Texture | None = None


class Targets:
    """Hold the textures of `TARGETS` and the framebuffers of `FRAMEBUFFERS`, as attributes of these names.

    Parameters
    ----------
    device : the owner of the GL context.
    size : width and height, pixels.
    samples : samples per pixel of the textures that objects are drawn into.
    atlas : the atlas of the impostor tiles, which its owner frees; None: create one. Without lit tiles in it, the
        targets `atlas_light` and `tile_light` do not exist, nor do framebuffers that draw into them.

    Attributes
    ----------
    drawn : the textures that `visibility` and `polygons` draw into: textures of their own if pixels have several
        samples, else those that the attributes hold. All other textures have one sample per pixel.
    screen : the framebuffer of the finished picture, set for each frame.
    tile_atlas : the textures of the targets `atlas` and `atlas_light`.
    atlas_size : width and height of the atlas, texels.
    offsets : (samples, 2) places of the samples from the pixel's middle, pixels to the right and up.
    sun_maps, lamp_maps : the shadow maps, set by the pass that draws them; None where nothing casts shadows.
    ambient_visibility : set by the pass that draws it; None without ambient occlusion.

    Raises
    ------
    GpuError
        Where the driver refuses a texture, for example for lack of memory; what was created is freed.
    """

    visibility_texture: moderngl.Texture
    tile_light: moderngl.Texture
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
        self.tile_atlas = atlas or TileAtlas(device, atlas_size(size, device.limits.edge))
        self.atlas_size = self.tile_atlas.size
        self.sun_maps: SunMaps | None = None
        self.lamp_maps: LampMaps | None = None
        self.ambient_visibility: AmbientVisibility | None = None
        self._before: dict[str, tuple[moderngl.Texture, moderngl.Framebuffer]] = {}  # copies, by name
        try:
            self._create(device, self.tile_atlas.lit)
        except BaseException:  # a texture was refused: free those created before
            self.release()
            raise

    def _create(self, device: Device, lit: bool) -> None:
        """Create the textures and framebuffers except those of the atlas. lit: whether tiles are lit."""
        made = [
            "visibility",
            "surface",
            "depth",
            "material_depth",
            "shadow",
            *(["tile_light"] if lit else []),
        ]
        for target in made:
            for name, texture_format in TARGETS[target].textures.items():
                setattr(self, name, texture_format.create(self.gl, self.size))
        self.lit_texture = RGBA16F.create(self.gl, self.size)
        self.drawn, self.offsets = self._textures_of_samples(), np.zeros((1, 2))
        if self.samples > 1:
            self.offsets = sample_offsets(device, self.samples)
        for name, framebuffer in FRAMEBUFFERS.items():
            exists = lit or "tile_light" not in framebuffer.colours
            if name not in ("atlas", "lit_atlas", "screen") and exists:
                setattr(self, name, self._framebuffer(framebuffer))

    def _textures_of_samples(self) -> Drawn:
        names = [name for name in (*ALL_SURFACES, "depth", "tile_light") if hasattr(self, name)]
        textures: dict[str, moderngl.Texture] = {name: getattr(self, name) for name in names}
        if self.samples > 1:
            formats = {name: TARGETS[TARGET_OF[name]].textures[name] for name in textures}
            textures = {
                name: texture_format.create(self.gl, self.size, self.samples)
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
        """Return the framebuffer of the atlas without light."""
        return self.tile_atlas.framebuffer

    @cached_property
    def lit_atlas(self) -> moderngl.Framebuffer:
        """Return the framebuffer of the atlas with its light. Raises AttributeError where tiles are not lit."""
        return self._lit_tiles().lit_framebuffer

    def _lit_tiles(self) -> TileAtlas:
        if not self.tile_atlas.lit:
            raise AttributeError("impostor tiles are not lit")
        return self.tile_atlas

    @property
    def defines(self) -> tuple[str, ...]:
        """Return the defines of shaders that draw depth images into these targets, or read what is drawn.

        `MULTISAMPLED` where pixels have several samples, otherwise none.
        """
        return ("MULTISAMPLED",) if self.samples > 1 else ()

    def lit_before(self) -> moderngl.Texture:
        """Return a copy of `lit` as it is now, filtered linearly, for a pass that both reads and draws it."""
        return self._copy("lit_texture", self.lit)

    def screen_before(self) -> moderngl.Texture:
        """Return a copy of `screen` as it is now, which must have the size of the targets."""
        return self._copy("screen", self.screen)

    def _copy(self, name: str, source: moderngl.Framebuffer) -> moderngl.Texture:
        """Copy `source` into a texture of the format that the table declares under `name`, made when first needed."""
        if name not in self._before:
            texture = TARGETS[TARGET_OF[name]].textures[name].create(self.gl, self.size)
            texture.filter = moderngl.LINEAR, moderngl.LINEAR
            self._before[name] = texture, self.gl.framebuffer([texture])
        texture, framebuffer = self._before[name]
        self.gl.device.context.copy_framebuffer(framebuffer, source)
        return texture

    def release(self) -> None:
        """Free the textures and framebuffers; an atlas only if it was created here."""
        self.gl.release()
        if self._owns_atlas:
            self.tile_atlas.release()
