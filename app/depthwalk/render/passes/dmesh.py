"""Draw depth samples straight to the screen by 3-D warping: where the viewer is inside a cylinder, and for `dmesh`.

Each sample is projected as an ordinary vertex, into the visibility buffer and the depth buffer. There is no impostor
tile in between, as in Pajarola et al. 2004, "DMesh", with which the paper compares itself.
"""

from depthwalk.cook.lod_geometry import GRID_LAYOUT
from depthwalk.gpu.device import Scope
from depthwalk.gpu.instances import AssetArrays, InstanceStream
from depthwalk.gpu.program import Program, Variants
from depthwalk.gpu.state import LESS
from depthwalk.params import Params
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.resources.depth_image_object import DEPTH_OBJECT_BLOCK
from depthwalk.render.resources.placed_records import PLACED_RECORD

BEHIND = 0.002  # metres that backs count as farther away than they are


class DmeshPass(Pass[Params]):
    """Draw the objects of `frame.plan.dmesh` as triangles between their depth samples."""

    name = "dmesh"
    draws_objects = True
    writes = ("visibility", "depth")

    def setup(self, gl: Scope) -> None:
        """Prepare the program, whose variants are compiled when first needed; `gl` owns their GL objects."""
        shaders = "dmesh/dmesh.vert", "dmesh/dmesh.frag"
        self._programs = Variants(lambda defines: Program(gl, *shaders, defines, DEPTH_OBJECT_BLOCK))
        self._arrays = Variants(lambda defines: AssetArrays(gl, self._programs[defines], *GRID_LAYOUT))
        self._instances = InstanceStream(gl, PLACED_RECORD)

    def enabled(self, frame: Frame, params: Params) -> bool:
        """Return whether `frame` draws depth images without impostors; `params` is empty."""
        return bool(frame.plan.dmesh.batches)

    def draw(self, frame: Frame, params: Params) -> None:
        """Draw the objects that `frame` shows without impostor into `visibility` and `depth`; `params` is empty."""
        first_object_id = frame.plan.first_object_id + len(frame.plan.composite.records)
        drawn = frame.plan.dmesh
        for number, batches in drawn.by_asset():
            asset = frame.assets.depth_object(number)
            backs = ("BACKS",) if asset.shows_backs else ()
            defines = (*asset.defines, *frame.targets.defines, *backs)
            program, arrays = self._programs[defines], self._arrays[defines]
            asset.use_geometry(program, frame.common.lod)
            if backs:
                near, far = frame.view.depth_range
                program.set(depth_scale=near * far / (far - near))
            with self.gl.state(
                into=frame.targets.visibility,
                depth_test=LESS,
                cull=not asset.shows_backs,
                wireframe=frame.common.wireframe,
            ):
                for batch in batches:
                    program.set(first=first_object_id + batch.first)
                    asset.draw(arrays, number, batch.indices, self._instances, drawn.records_of(batch))

    def forget_assets(self) -> None:
        """Drop the vertex arrays over buffers of assets."""
        for arrays in self._arrays.values():
            arrays.forget()
