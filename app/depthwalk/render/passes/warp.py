"""Warp depth samples, within a plane that touches their object's cylinder, into impostor tiles of the atlas.

The first pass of Liu, Liu and Wu 2007 (§2.2). A sample that lies `depth` behind the point S of that plane moves to
X = e + λ · (S − e) with λ = D_t / (D_t + depth), in 2-D, toward the epipole e; D_t is the viewer's distance from the
plane. A texel holds λ, scaled, as its depth, and the image that owns it. With `light.mode: warp` this lights each texel
too (§2.4); otherwise a tile holds no colours.
"""

from collections.abc import Iterator
from itertools import groupby
from operator import attrgetter
from typing import Any

import moderngl
import numpy as np

from depthwalk.cook.lod_geometry import GRID_LAYOUT
from depthwalk.gpu.device import CLIP_DISTANCES, Scope
from depthwalk.gpu.instances import AssetArrays, InstanceStream
from depthwalk.gpu.program import Program, Variants
from depthwalk.gpu.state import ALWAYS, LESS
from depthwalk.render.draw.draw_lists import PART_TRIANGLES, DrawList
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.impostors.tile_records import WARP_RECORD
from depthwalk.render.paper.ordered_indices import OrderedIndices
from depthwalk.render.resources.depth_image_object import DEPTH_OBJECT_BLOCK, surface_samplers
from depthwalk.scene.object_settings import WarpParams

_SLOT = np.dtype([("slot", "4f4")])


class WarpPass(Pass[WarpParams]):
    """Warp depth images into the impostor tiles of `frame.plan.warp`; tiles that are still accurate stay."""

    name = "warp"
    draws_objects = True
    writes = ("atlas", "atlas_light")

    def setup(self, gl: Scope) -> None:
        """Prepare the program, whose variants are compiled when first needed; `gl` owns their GL objects."""
        self._programs = Variants(self._program)
        self._arrays = Variants(lambda defines: AssetArrays(gl, self._programs[defines], *GRID_LAYOUT))
        self._ordered = Variants(lambda defines: OrderedIndices(gl, self._programs[defines].gl))
        self._instances = InstanceStream(gl, WARP_RECORD)
        self._clear = Variants(lambda defines: Program(gl, "warp/clear.vert", "warp/clear.frag", defines))
        self._slots = InstanceStream(gl, _SLOT)

    def _program(self, defines: tuple[str, ...]) -> Program:
        program = Program(self.gl, "warp/warp.vert", "warp/warp.frag", defines, DEPTH_OBJECT_BLOCK)
        if "LIT" in defines:
            program.set(**surface_samplers(1))
        return program

    def enabled(self, frame: Frame, params: WarpParams) -> bool:
        """Return whether `frame` warps any tile; otherwise the atlas is not touched. The `params` do not matter."""
        return bool(len(frame.plan.cleared) or frame.plan.warp.batches)

    def draw(self, frame: Frame, params: WarpParams) -> None:
        """Clear the slots of the tiles that `frame` warps, and warp samples into them in the order of `params`."""
        for _ in self.parts(frame, params):
            pass

    def parts(self, frame: Frame, params: WarpParams) -> Iterator[None]:
        """Draw as `draw` does; stop after every `PART_TRIANGLES`, unless samples are drawn in the paper's order."""
        self._clear_slots(frame)
        in_order = params.order == "epipole"
        several = [frame.plan.warp] if in_order else frame.plan.warp.parts(PART_TRIANGLES)
        for number, part in enumerate(several):
            if number:
                yield
            with self.gl.state(into=_atlas(frame), depth_test=LESS, cull=True, wireframe=params.wireframe):
                self._draw(frame, part, in_order)

    def _draw(self, frame: Frame, part: DrawList, in_order: bool) -> None:
        light_defines, light = _light(frame)
        for number, batches in part.by_asset():
            asset = frame.assets.depth_object(number)
            defines = asset.defines
            if frame.common.lit_tiles:  # with a colour per texel, even where the object's own texture would be finer
                surface = (name for name in asset.surface_defines if name != "COORDINATES")
                defines = *surface, *light_defines
            program = self._programs[defines]
            if frame.common.lit_tiles:
                asset.use_surface(program, 1, frame.common.lod)
                program.set(**light)
            else:
                asset.use_geometry(program, frame.common.lod)
            ordered = self._ordered[defines] if in_order and not frame.assets.parts.is_shipped_cooked(number) else None
            for clipped, run in groupby(batches, attrgetter("clipped")):
                with self.gl.state(direct=CLIP_DISTANCES if clipped else ()):
                    for batch in run:
                        if ordered is not None:
                            ordered.draw(frame.assets, batch, part.records_of(batch), self._instances)
                        else:
                            records = part.records_of(batch)
                            asset.draw(self._arrays[defines], number, batch.indices, self._instances, records)

    def _clear_slots(self, frame: Frame) -> None:
        """Clear the slots that are drawn into, in one draw call; scissored clears would take one call each."""
        slots = np.zeros(len(frame.plan.cleared), _SLOT)
        slots["slot"] = frame.plan.cleared
        self._slots.upload(slots)
        program = self._clear[("LIT",) if frame.common.lit_tiles else ()]
        self._slots.bind(program.array)
        program.set(atlas_size=frame.targets.atlas_size)
        with self.gl.state(into=_atlas(frame), depth_test=ALWAYS):
            program.rectangles(len(slots))

    def forget_assets(self) -> None:
        """Drop the vertex arrays over buffers of assets."""
        for arrays in self._arrays.values():
            arrays.forget()
        for ordered in self._ordered.values():
            ordered.forget()


def _atlas(frame: Frame) -> moderngl.Framebuffer:
    """Return the framebuffer that tiles are drawn into."""
    return frame.targets.lit_atlas if frame.common.lit_tiles else frame.targets.atlas


def _light(frame: Frame) -> tuple[tuple[str, ...], dict[str, Any]]:
    """Return defines and uniforms of the light that texels receive; none where tiles are not lit."""
    return (("LIT", *frame.light.defines), frame.light.uniforms()) if frame.common.lit_tiles else ((), {})
