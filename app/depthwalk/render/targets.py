"""The textures that passes hand to each other."""

from dataclasses import dataclass
from typing import Any, cast

import moderngl
import numpy as np

from depthwalk.gpu.device import Device, Scope
from depthwalk.gpu.multisampling import sample_offsets
from depthwalk.render.shadows.sun_uniforms import LampMaps, SunMaps

ATLAS_TEXELS = 1 << 23  # smallest atlas: 4096 × 2048, 50 MB

# What passes declare that they read or write: what there is of each of them, to be read, in `Targets`.
TARGETS: dict[str, tuple[str, ...]] = {
    "atlas": ("atlas_owner", "atlas_depth"),
    "visible": ("visibility_texture",),
    "albedo": ("albedo",),
    "surface": ("surface",),
    "depth": ("depth",),
    "samples": ("drawn",),  # the four above where pixels have several
    "levels": (),
    "sun_maps": ("sun_maps",),
    "lamp_maps": ("lamp_maps",),
    "shadow": ("shadow_texture",),
    "lit": ("lit_texture", "lit_before"),
    "screen": (),
}
_READ = {name: target for target, names in TARGETS.items() for name in names}
# The targets that framebuffers draw into: colours, and the depth that is tested against or written.
_DRAWN_INTO: dict[str, tuple[tuple[str, ...], str | None]] = {
    "atlas": (("atlas",), None),
    "visible": (("visible",), "depth"),
    "polygons": (("albedo", "surface", "visible"), "depth"),
    "one_sample": (("albedo", "surface", "visible"), "depth"),
    "levels": (("levels",), None),
    "shaded": (("albedo", "surface"), "levels"),
    "gbuffer": (("albedo", "surface"), "depth"),
    "shadow": (("shadow",), None),
    "lighting": (("lit",), "depth"),
    "lit": (("lit",), None),
    "shaded_lit": (("albedo", "surface", "lit"), "levels"),
    "covered": (("lit",), "levels"),
    "screen": (("screen",), None),
}
_OF_ALL = {"size", "samples", "atlas_size", "offsets", "defines"}  # numbers, that every pass may know


@dataclass(frozen=True, kw_only=True)
class Drawn:
    """The textures that objects and ground are drawn into, of one sample per pixel or several."""

    albedo: moderngl.Texture
    surface: moderngl.Texture
    visible: moderngl.Texture
    depth: moderngl.Texture


class Targets:
    """atlas: intermediate images (owner, 1 − nearest·λ/w); visible: image in front and its distance, depth; polygons:
    all that polygons write; levels: the asset in front, as a depth; shaded: albedo, surface, that; gbuffer: albedo,
    surface, depth; shadow: part of the sun's light that reaches a pixel; sun_maps: where it casts shadows; lamp_maps:
    depth, tiles, of those lamps that cast shadows, both None where none does, made by the pass that draws them; lit:
    linear RGBA, half, premultiplied; lighting: that, depth; shaded_lit: as shaded, with lit;
    covered: lit, levels.

    screen: where the finished picture goes, set for each frame.

    With several `samples` per pixel, at `offsets` (samples, 2) from its middle, pixels, visible and polygons have
    textures of their own (`drawn`); one_sample is a sample of polygons, and all others know of that alone.
    """

    def __init__(self, device: Device, size: tuple[int, int], samples: int = 1) -> None:
        self.size, self.samples = size, samples
        self.gl = device.scope("targets")
        gl = self.gl
        self.atlas_size = _atlas_size(size, device.max_texture_size)
        self.atlas_owner = gl.texture(self.atlas_size, 1, "u2")
        self.atlas_depth = gl.depth_texture(self.atlas_size)
        self.atlas = gl.framebuffer([self.atlas_owner], self.atlas_depth)
        self.albedo = gl.texture(size, 4)
        self.surface = gl.texture(size, 4, "nu2")
        self.depth = gl.depth_texture(size)
        self.visibility_texture = gl.texture(size, 2, "u4")
        self.one_sample = gl.framebuffer([self.albedo, self.surface, self.visibility_texture], self.depth)
        self.drawn = Drawn(albedo=self.albedo, surface=self.surface, visible=self.visibility_texture, depth=self.depth)
        self.offsets = np.zeros((1, 2))
        if samples > 1:
            self.drawn, self.offsets = _multisampled(gl, size, samples), sample_offsets(device, samples)
        drawn = self.drawn
        self.visible = gl.framebuffer([drawn.visible], drawn.depth)
        self.polygons = gl.framebuffer([drawn.albedo, drawn.surface, drawn.visible], drawn.depth)
        level = gl.depth_texture(size)
        self.levels = gl.framebuffer([], level)
        self.shaded = gl.framebuffer([self.albedo, self.surface], level)
        self.gbuffer = gl.framebuffer([self.albedo, self.surface], self.depth)
        self.shadow_texture = gl.texture(size, 1)
        self.shadow = gl.framebuffer([self.shadow_texture])
        self.sun_maps: SunMaps | None = None
        self.lamp_maps: LampMaps | None = None
        self.screen: moderngl.Framebuffer
        self.lit_texture = gl.texture(size, 4, "f2")
        self.lighting = gl.framebuffer([self.lit_texture], self.depth)
        self.lit = gl.framebuffer([self.lit_texture])
        self.shaded_lit = gl.framebuffer([self.albedo, self.surface, self.lit_texture], level)
        self.covered = gl.framebuffer([self.lit_texture], level)
        self._before: tuple[moderngl.Texture, moderngl.Framebuffer] | None = None

    @property
    def defines(self) -> tuple[str, ...]:
        """Of the shaders that draw depth images into these, or read what is drawn."""
        return ("MULTISAMPLED",) if self.samples > 1 else ()

    def lit_before(self) -> moderngl.Texture:
        """A copy of lit as it is now, for a pass that changes what it reads."""
        if self._before is None:
            texture = self.gl.texture(self.size, 4, "f2")
            texture.filter = moderngl.LINEAR, moderngl.LINEAR
            self._before = texture, self.gl.framebuffer([texture])
        texture, framebuffer = self._before
        self.gl.device.context.copy_framebuffer(framebuffer, self.lit)
        return texture

    def release(self) -> None:
        self.gl.release()


class DeclaredTargets:
    """`Targets` as far as a pass declares them. Anything else raises AttributeError, which names pass and target.

    Framebuffers are for writing their colours, and for writing their depth or testing against it.
    """

    def __init__(self, targets: Targets, user: str, reads: tuple[str, ...], writes: tuple[str, ...]) -> None:
        if unknown := {*reads, *writes} - TARGETS.keys():
            raise ValueError(f"pass {user}: no target {', '.join(sorted(unknown))}; there are {', '.join(TARGETS)}")
        values = {"_targets": targets, "_user": user, "_reads": frozenset(reads), "_writes": frozenset(writes)}
        self.__dict__.update(values)

    def __getattr__(self, name: str) -> Any:
        if name in _DRAWN_INTO:
            colours, depth = _DRAWN_INTO[name]
            for target in colours:
                self._need(target, "write", self._writes)
            if depth is not None:
                self._need(depth, "test", self._reads | self._writes)
        elif name in _READ:
            self._need(_READ[name], "read", self._reads)
        elif name not in _OF_ALL:
            raise AttributeError(f"pass {self._user}: no target {name}")
        return getattr(self._targets, name)

    def __setattr__(self, name: str, value: Any) -> None:
        self._need(_READ.get(name, name), "write", self._writes)
        setattr(self._targets, name, value)

    def _need(self, target: str, use: str, declared: frozenset[str]) -> None:
        """use: "read", "write", or "test" against a depth."""
        if target not in declared:
            raise AttributeError(f"pass {self._user} does not declare that it {use}s target {target}")


def declared(targets: Targets, user: str, reads: tuple[str, ...], writes: tuple[str, ...]) -> Targets:
    """`targets`, of which the pass `user` reaches those that it declares to read or write."""
    return cast(Targets, DeclaredTargets(targets, user, reads, writes))


def _multisampled(gl: Scope, size: tuple[int, int], samples: int) -> Drawn:
    albedo, surface, visible = (
        gl.multisampled_texture(size, samples, components, dtype)
        for components, dtype in ((4, "f1"), (4, "nu2"), (2, "u4"))
    )
    return Drawn(albedo=albedo, surface=surface, visible=visible, depth=gl.multisampled_depth(size, samples))


def _atlas_size(size: tuple[int, int], limit: int) -> tuple[int, int]:
    """Four pictures' worth of texels in powers of two, at least `ATLAS_TEXELS`."""
    wanted = max(ATLAS_TEXELS, 4 * size[0] * size[1])
    width = 1 << max(12, (int(wanted**0.5) - 1).bit_length())
    height = 1 << max(11, (-(-wanted // width) - 1).bit_length())
    return min(width, limit), min(height, limit)
