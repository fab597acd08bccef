"""Composite: draw every impostor tile as an octagon of its plane, with the true depth of each pixel.

The second pass of Liu, Liu and Wu 2007 (§2.5). Where a tile stores λ at the point X of its plane, the viewer C sees the
surface at P = C + (X − C) / λ (§2.2). This writes P's distance, and which object and image the pixel shows, into the
visibility buffer and the depth buffer; colours are looked up later, once per pixel, by `material_resolve`. Where tiles
hold lit colours, it filters these.
"""

import numpy as np
from numpy.typing import NDArray

from depthwalk.gpu.device import DEPTH_CLAMP, Scope
from depthwalk.gpu.instances import InstanceStream
from depthwalk.gpu.program import Program, Variants
from depthwalk.gpu.state import LESS
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.impostors.tile_records import COMPOSITE_RECORD
from depthwalk.scene.object_settings import CompositeParams


class CompositePass(Pass[CompositeParams]):
    """Draw the impostors of `frame.plan.composite`: first those whose texels are pixels of the picture."""

    name = "composite"
    draws_objects = True
    reads = ("atlas", "atlas_light")
    writes = ("visibility", "depth", "tile_light")

    def setup(self, gl: Scope) -> None:
        """Prepare the variants of the program and the instance records; `gl` owns them."""
        shaders = "composite/composite.vert", "composite/composite.frag"
        self._programs = Variants(lambda defines: Program(gl, *shaders, defines=defines))
        self._instances = InstanceStream(gl, COMPOSITE_RECORD)

    def enabled(self, frame: Frame, params: CompositeParams) -> bool:
        """Return whether `frame` shows impostors; scenes of meshes never need the atlas, whatever the `params`."""
        return len(frame.plan.composite.records) > 0

    def draw(self, frame: Frame, params: CompositeParams) -> None:
        """Draw the impostors of `frame` into `visibility` and `depth`, in as many steps of parallax as `params` say."""
        records, aligned = frame.plan.composite.records, frame.plan.composite.aligned
        frame.targets.atlas_depth.use(0)
        frame.targets.atlas_owner.use(1)
        lit: tuple[str, ...] = ()
        into = frame.targets.visibility
        if frame.common.lit_tiles:
            frame.targets.atlas_light.use(2)
            lit, into = ("LIT",), frame.targets.lit_visibility
        # The number of steps is known to the compiler: with a loop software rasterisers take a tenth longer.
        defines = (f"STEPS={params.parallax_steps}", *frame.targets.defines)
        defines += ("PARTIAL",) if frame.common.aa.covering else ()
        # Unclamped, a plane may be nearer than the near plane while its object is not.
        with self.gl.state(into=into, depth_test=LESS, direct=(DEPTH_CLAMP,)):
            self._draw(frame, ("ALIGNED", *lit), records[:aligned])
            self._draw(frame, (*defines, *lit), records[aligned:])

    def _draw(self, frame: Frame, defines: tuple[str, ...], records: NDArray[np.void]) -> None:
        if len(records):
            program = self._programs[defines]
            program.set(atlas_depth=0, atlas_owner=1, first=frame.plan.first_object_id)
            if frame.common.lit_tiles:
                program.set(atlas_light=2)
            self._instances.upload(records)
            self._instances.bind(program.array)
            program.octagons(len(records))
