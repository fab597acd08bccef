"""Blend translucent surfaces over the lit picture, from back to front, and add the glow of opaque surfaces.

Depth images and the G-buffer hold only opaque surfaces, and not the light that they emit. So this draws both as
polygons, for all representations, before anti-aliasing and depth of field. Depth is tested, not written: focus,
reprojection and measurements refer to what is behind the glass.
"""

from typing import Any, NamedTuple

import moderngl

from depthwalk.gpu.device import DEPTH_CLAMP, Scope
from depthwalk.gpu.instances import AssetArrays, InstanceStream
from depthwalk.gpu.program import Program, Variants
from depthwalk.params import Params
from depthwalk.render.draw.translucency_planner import TranslucentBatch
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.lamp_inputs import LampInputs
from depthwalk.render.lod.selection import error_at_a_metre
from depthwalk.render.passes.fog import fog_inputs
from depthwalk.render.pixel_pass import PixelInputs, joined_defines, joined_uniforms
from depthwalk.render.resources.placed_records import PLACED_RECORD
from depthwalk.render.resources.translucent_store import TranslucentObject

# moderngl's format of a TRANSLUCENT_VERTEX, and the attributes that are read: all, or those that glow or unlit
# surfaces need.
_LAYOUT = "3f 2f 3f 3f 4f 2f", "in_position", "in_uv", "in_emission", "in_normal", "in_colour", "in_highlight"
_GLOW_LAYOUT = "3f 2f 3f 36x", *_LAYOUT[1:4]
_UNLIT_LAYOUT = "3f 2f 3f 12x 4f 8x", *_LAYOUT[1:4], "in_colour"
_GLOW, _NORMAL_MAP, _UNLIT = "GLOW", "NORMAL_MAP", "UNLIT"
# Depth tolerance for glowing surfaces, whose depth images may be off, as part of the radius about an object's glowing
# and translucent triangles: a third of a texel of 256² for a lamp alone, and less for small lamps on large objects, so
# that few of them shine through thin walls.
_TOLERANCE = 1 / 128
# Depth offsets that bring translucent surfaces in front of opaque ones on which they lie, as glass on the ground.
# Rounding takes little of how much depth changes from pixel to pixel; the nearest of several samples, which gives
# the pixel's depth, is up to half a pixel from its middle. Greater offsets would bring glass in front of labels on it.
_ON_TOP = -0.02, -4.0
_ON_TOP_OF_SAMPLES = -0.52, -4.0
_OVER = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA  # for premultiplied light; with opacity 0 it is added


class _Light(NamedTuple):
    """Describe what programs light surfaces by: their defines, uniforms, and the texture unit of normal maps."""

    defines: tuple[str, ...]
    uniforms: dict[str, Any]
    normal_map_unit: int


class TranslucencyPass(Pass[Params]):
    """Draw translucent and glowing polygons over `lit`."""

    name = "translucency"
    reads = ("depth", "sun_maps", "lamp_maps")
    writes = ("lit",)

    def setup(self, gl: Scope) -> None:
        """Prepare the variants of the program and the instance buffer; `gl` owns them."""
        shaders = "translucency/translucency.vert", "translucency/translucency.frag"
        self._programs = Variants(lambda defines: Program(gl, *shaders, defines))
        self._arrays = Variants(lambda defines: AssetArrays(gl, self._programs[defines], *_layout(defines)))
        self._instances = InstanceStream(gl, PLACED_RECORD)
        self._lamps: LampInputs | None = None  # created on first use, as most scenes have no translucent surfaces
        self._sorted = gl.buffer(reserve=4, dynamic=True)  # indices of sorted triangles

    def enabled(self, frame: Frame, params: Params) -> bool:
        """Return whether anything in sight of `frame` is translucent or glows; `params` is empty."""
        return bool(frame.translucent.batches)

    def draw(self, frame: Frame, params: Params) -> None:
        """Add the glow in `frame`, then blend what is translucent over it; `params` is empty."""
        self.gl.refill(self._sorted, frame.translucent.faces)
        into = frame.targets.lighting
        # Depths are clamped, since near and far plane are fitted to opaque surfaces.
        with self.gl.state(into=into, depth_test="<=", depth_write=False, blend=_OVER, direct=(DEPTH_CLAMP,)):
            self._add_glow(frame)
            with self.gl.state(depth_offset=_ON_TOP_OF_SAMPLES if frame.targets.samples > 1 else _ON_TOP):
                self._blend(frame)

    def _add_glow(self, frame: Frame) -> None:
        """Add the light that opaque surfaces emit, where they are the nearest."""
        inputs = _joined([_fog(frame)])
        defines = (_GLOW, *joined_defines(inputs))
        program = self._programs[defines]
        program.set(**_units(inputs), **joined_uniforms(inputs))
        program.set(seen_error=error_at_a_metre(frame.view, frame.common.lod))
        for batch in frame.translucent.batches:
            of_asset = frame.assets.translucent.objects[batch.asset]
            if of_asset.mesh.glowing:
                program.set(tolerance=_TOLERANCE * of_asset.mesh.radius)
                self._instances.upload(frame.translucent.records_of(batch))
                array = self._array(defines, batch, of_asset, of_asset.indices)
                for run in of_asset.mesh.glowing:
                    program.set(cutoff=run.cutoff or 0.0)
                    of_asset.use(run)
                    array.render(vertices=3 * run.count, first=3 * run.first, instances=batch.count)

    def _blend(self, frame: Frame) -> None:
        """Blend translucent surfaces over the picture, from back to front."""
        self._lamps = self._lamps or LampInputs(self.gl)
        inputs = _joined([_sun(frame), self._lamps.of(frame), _fog(frame)])
        defines = joined_defines(inputs)
        units = _units(inputs)
        uniforms = units | joined_uniforms(inputs)
        self._programs[defines].set(**uniforms)
        for part in inputs:
            for name, texture in part.textures.items():
                texture.use(units[name])
        light = _Light(defines, uniforms, len(units))
        for batch in frame.translucent.batches:
            of_asset = frame.assets.translucent.objects[batch.asset]
            if of_asset.mesh.runs:
                self._instances.upload(frame.translucent.records_of(batch))
                self._blend_batch(light, batch, of_asset)

    def _blend_batch(self, light: _Light, batch: TranslucentBatch, of_asset: TranslucentObject) -> None:
        runs = of_asset.mesh.runs
        indices: tuple[Any, ...] = (of_asset.indices,)
        drawn = [(run, run.first, run.count) for run in runs]
        if batch.sorted is not None:
            indices = self._sorted, "sorted"
            drawn = [(runs[part.run], part.first, part.count) for part in batch.sorted]
        arrays = Variants(lambda variant: self._array(variant, batch, of_asset, *indices))
        for run, first, count in drawn:
            of_asset.use(run)
            chosen = light.defines
            if run.unlit:
                chosen = _UNLIT, *chosen
                self._programs[chosen].set(**light.uniforms)
            elif run.normal_map is not None:
                chosen = _NORMAL_MAP, *chosen
                of_asset.use_normal_map(run, light.normal_map_unit)
                own = {"normal_map": light.normal_map_unit, "normal_scale": run.normal_scale}
                self._programs[chosen].set(**light.uniforms, **own)
            arrays[chosen].render(vertices=3 * count, first=3 * first, instances=batch.count)

    def _array(
        self,
        defines: tuple[str, ...],
        batch: TranslucentBatch,
        of_asset: TranslucentObject,
        indices: moderngl.Buffer,
        *key: str,
    ) -> moderngl.VertexArray:
        """Return the vertex array of an asset by some indices, which reads the records that are uploaded."""
        array = self._arrays[defines].get((batch.asset, *key), of_asset.vertices, indices)
        self._instances.bind(array)
        return array

    def forget_assets(self) -> None:
        """Drop the vertex arrays over buffers of assets."""
        for arrays in self._arrays.values():
            arrays.forget()


def _layout(defines: tuple[str, ...]) -> tuple[str, ...]:
    """Return the attributes that a program with these defines reads, as `AssetArrays` takes them."""
    if _GLOW in defines:
        return _GLOW_LAYOUT
    return _UNLIT_LAYOUT if _UNLIT in defines else _LAYOUT


def _joined(inputs: list[PixelInputs | None]) -> list[PixelInputs]:
    return [part for part in inputs if part is not None]


def _units(inputs: list[PixelInputs]) -> dict[str, int]:
    """Return the numbers of the texture units of a program, by the names of its samplers."""
    names = ["base_texture", "emission_texture", *(name for part in inputs for name in part.textures)]
    return {name: unit for unit, name in enumerate(names)}


def _sun(frame: Frame) -> PixelInputs:
    """Return the light of sun and sky, with the shadow maps of the sun where it casts shadows."""
    defines, uniforms = frame.light.defines, frame.light.uniforms()
    if (maps := frame.targets.sun_maps) is None:
        return PixelInputs(defines=defines, uniforms=uniforms)
    uniforms |= maps.uniforms(frame.view, frame.common.lod)
    defines += ("SHADOWS", *maps.defines)
    return PixelInputs(defines=defines, textures={"sun_maps": maps.texture}, uniforms=uniforms)


def _fog(frame: Frame) -> PixelInputs | None:
    """Return the fog between the viewer and what is drawn; None where there is none."""
    fog = frame.environment.fog
    if fog is None or fog.density <= 0:
        return None
    inputs = fog_inputs(frame)
    return PixelInputs(defines=("FOG", *inputs.defines), uniforms=inputs.uniforms)
