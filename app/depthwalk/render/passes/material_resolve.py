"""Look up colour and normal of each pixel that shows a depth-image object, once, into the G-buffer.

Deferred texturing of a visibility buffer (Burns and Hunt 2013). Every asset has textures of its own, so its pixels are
drawn together: a first step writes a depth that stands for the asset of each pixel, its material depth, and then each
asset's rectangle is drawn with a depth test for that value (Karis et al. 2021, "Nanite: A Deep Dive").
"""

from collections.abc import Iterator
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.gpu.device import Scope
from depthwalk.gpu.instances import RecordTexture
from depthwalk.gpu.program import Program, Variants
from depthwalk.gpu.state import ALWAYS
from depthwalk.params import Params
from depthwalk.render.draw.material_depth import SURFACE_RECORD, MaterialRecords
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.resources.depth_image_object import DEPTH_OBJECT_BLOCK, SURFACE_UNITS, surface_samplers
from depthwalk.render.resources.reflections import REFLECTS

_SURFACE = 2  # first texture unit of an object's textures
_SUN_MAPS = _SURFACE + SURFACE_UNITS  # texture unit
_TILE_LIGHT = _SUN_MAPS + 1
_PART = 0.6  # of the picture, which the rectangles of assets may cover in one part of the pass


class MaterialResolvePass(Pass[Params]):
    """Look up albedo and normal for every pixel of the visibility buffer; in forward mode add light to them.

    Where tiles are lit, light comes from them, and what nobody needs besides is not looked up.
    """

    name = "material_resolve"
    per_sample = True
    reads = ("visibility", "depth", "sun_maps", "tile_light")
    writes = ("material_depth", "surface", "lit")

    def setup(self, gl: Scope) -> None:
        """Create the programs and the texture of object records; `gl` owns them."""
        self._material_depth = Program(gl, "common/rectangle.vert", "material_resolve/material_depth.frag")
        self._programs = Variants(self._program)
        self._objects = RecordTexture(gl, SURFACE_RECORD)

    def _program(self, defines: tuple[str, ...]) -> Program:
        shaders = "common/rectangle.vert", "material_resolve/material_resolve.frag"
        program = Program(self.gl, *shaders, defines, DEPTH_OBJECT_BLOCK)
        program.set(objects=0, visibility_texture=1, **surface_samplers(_SURFACE))
        return program

    def enabled(self, frame: Frame, params: Params) -> bool:
        """Return whether `frame` shows objects by their depth images; `params` is empty."""
        return frame.materials is not None and len(frame.materials.assets) > 0

    def draw(self, frame: Frame, params: Params) -> None:
        """Look up albedo and normal of the surfaces that `frame` shows, asset by asset; `params` is empty."""
        for _ in self.parts(frame, params):
            pass

    def parts(self, frame: Frame, params: Params) -> Iterator[None]:
        """Draw as `draw` does; stop whenever assets have filled most of the picture once more."""
        materials = frame.materials
        assert materials is not None  # as `enabled` found
        self._objects.upload(materials.records)
        if _alone(frame, materials):
            yield from self._resolve(frame, materials, frame.targets.gbuffer, ">", np.ones(1))
            return
        self._draw_material_depth(frame, materials)
        target = frame.targets.shaded_lit if frame.common.forward else frame.targets.shaded
        yield from self._resolve(frame, materials, target, "==", materials.material_depth)

    def _draw_material_depth(self, frame: Frame, materials: MaterialRecords) -> None:
        self._bind(frame)
        corners = *materials.low.min(0), *materials.high.max(0)
        self._material_depth.set(corners=corners, objects=0, visibility_texture=1)
        with self.gl.state(into=frame.targets.material_depth, depth_test=ALWAYS):
            self._material_depth.rectangles()

    def _bind(self, frame: Frame) -> None:
        self._objects.use(0)
        frame.targets.visibility_texture.use(1)

    def _resolve(
        self,
        frame: Frame,
        materials: MaterialRecords,
        target: moderngl.Framebuffer,
        depth_test: str,
        depth: NDArray[np.floating],
    ) -> Iterator[None]:
        """Draw the rectangles of the assets into `target`, where `depth_test` passes. depth: (assets,) of each.

        Where pixels may be covered in part, a second instance of each rectangle draws these.
        """
        defines, light = _light(frame)
        if frame.common.show_tiles:
            defines += ("SHOW_TILES",)
        # Forward mode lights here, without reflections; colours that tell objects apart have none.
        mirrors = frame.light.reflected is not None and not (frame.common.forward or frame.common.show_tiles)
        corners = np.concatenate([materials.low, materials.high], 1)
        columns = materials.assets.tolist(), depth.tolist(), corners.tolist()
        instances = 2 if frame.common.aa.covering else 1
        rows = list(zip(*columns, strict=True))
        for part in _parts(materials):
            if part.start:
                yield
            self._bind(frame)
            with self.gl.state(into=target, depth_test=depth_test, depth_write=False):
                for number, asset_depth, rectangle in rows[part]:
                    asset = frame.assets.depth_object(number)
                    reflects = (REFLECTS,) if asset.reflects and mirrors else ()
                    program = self._programs[*asset.surface_defines, *reflects, *defines]
                    asset.use_surface(program, _SURFACE, frame.common.lod)
                    program.set(**light, corners=tuple(rectangle), depth=asset_depth)
                    program.rectangles(instances)


def _parts(materials: MaterialRecords) -> Iterator[slice]:
    """Yield the rows of the assets that each part of the pass draws."""
    start, filled = 0, 0.0
    for number, covered in enumerate(((materials.high - materials.low).prod(1) / 4).tolist()):
        if filled > _PART:
            yield slice(start, number)
            start, filled = number, 0.0
        filled += covered
    yield slice(start, len(materials.assets))


def _light(frame: Frame) -> tuple[tuple[str, ...], dict[str, Any]]:
    """Return defines and uniforms of the light that is added here: in forward mode sun and ambient light."""
    if not frame.common.forward:
        return (), {}
    light, maps = frame.light, frame.targets.sun_maps
    defines, values = ("FORWARD", *light.defines), light.uniforms()
    if frame.common.lit_tiles and not frame.common.show_tiles:
        frame.targets.tile_light.use(_TILE_LIGHT)
        values |= {"tile_light": _TILE_LIGHT}
        needs_surface = maps is not None or frame.common.aa.geometric
        defines += ("LIT_TILES", "SURFACE_TOO") if needs_surface else ("LIT_TILES",)
    if maps is None:
        return defines, values
    maps.texture.use(_SUN_MAPS)
    values |= {"sun_maps": _SUN_MAPS} | maps.uniforms(frame.view, frame.common.lod)
    return (*defines, "SHADOWS", *maps.defines), values


def _alone(frame: Frame, materials: MaterialRecords) -> bool:
    """Return whether all that is drawn is of one asset's depth images.

    Then its pixels are those in front of the far plane, and no material depth is needed.
    """
    polygons = len(frame.plan.mesh.records) > 0 or bool(frame.plan.clusters) or bool(frame.plan.captured)
    polygons |= frame.environment.ground is not None
    alone = len(materials.assets) == 1 and not polygons and not frame.common.forward
    return alone and not frame.common.aa.covering  # partial coverage is told by the material depth
