"""Find which mesh is in front at each pixel, in frames that ask for it.

The visibility buffer distinguishes depth-image objects, but holds one value for all polygons. This pass draws the
frame's polygons once more, into targets of its own; other passes do not depend on it.
"""

from typing import NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.gpu.device import Scope
from depthwalk.gpu.instances import AssetArrays, InstanceStream
from depthwalk.gpu.program import Program
from depthwalk.gpu.state import LESS
from depthwalk.params import Params
from depthwalk.render.cluster_drawing import ClusterDrawing
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.resources.mesh_object import POSITION_LAYOUT
from depthwalk.render.resources.placed_records import PLACED_RECORD


class FrontMeshes(NamedTuple):
    """Hold which mesh is in front of all others at each pixel.

    Attributes
    ----------
    number : (H, W) uint32, row of `FrameDrawLists.polygons.records` of the whole frame, row 0 at the bottom; undefined
        where depth is 1.
    depth : (H, W) float32, value of the depth buffer, row 0 at the bottom; 1 where no polygon is.
    """

    number: NDArray[np.uint32]
    depth: NDArray[np.float32]


class _Target(NamedTuple):
    """Hold what the pass draws into."""

    number: moderngl.Texture
    depth: moderngl.Texture
    framebuffer: moderngl.Framebuffer


class ObjectIdPass(Pass[Params]):
    """Draw the number of the mesh in front at each pixel, in frames for which `requested` is set.

    Where pixels have several samples, it draws the last one, which the visibility buffer holds at the end of the frame.

    Attributes
    ----------
    has_drawn : whether it has drawn a frame since `requested` was set last.
    """

    name = "object_id"
    per_sample = True

    def setup(self, gl: Scope) -> None:
        """Create programs and buffers through `gl`; targets are created when they are first drawn into."""
        self._requested = self.has_drawn = False
        self._program = Program(gl, "object_id/object_id.vert", "object_id/object_id.frag")
        self._arrays = AssetArrays(gl, self._program, *POSITION_LAYOUT)
        self._cluster_program = Program(gl, "object_id/clusters.vert", "object_id/object_id.frag")
        self._clusters = ClusterDrawing(gl)
        self._instances = InstanceStream(gl, PLACED_RECORD)
        self._target: _Target | None = None

    @property
    def requested(self) -> bool:
        """Return whether frames find the meshes in front; the caller sets it, also while a frame is being drawn."""
        return self._requested

    @requested.setter
    def requested(self, requested: bool) -> None:
        self._requested, self.has_drawn = requested, False

    def resize(self, size: tuple[int, int]) -> None:
        """Drop the targets; those of `size` (width, height) pixels are made when they are needed."""
        if self._target is not None:
            self.gl.free(self._target.framebuffer, self._target.number, self._target.depth)
        self._target = None

    def enabled(self, frame: Frame, params: Params) -> bool:
        """Return whether the pass is requested and `frame` is that of the last sample; `params` is empty."""
        return self.requested and frame.sample == frame.targets.samples - 1

    def draw(self, frame: Frame, params: Params) -> None:
        """Draw the polygons of `frame` into the targets of this pass; `params` is empty."""
        self.has_drawn = True
        target = self._target = self._target or self._make(frame.targets.size)
        target.framebuffer.clear(depth=1.0)
        for batch in frame.plan.mesh.batches:
            self._instances.upload(frame.plan.mesh.records_of(batch))
            mesh = frame.assets.meshes.object(batch.asset, batch.level)
            array = self._arrays.get((batch.asset, batch.level), mesh.vertices, mesh.indices)
            self._instances.bind(array)
            self._program.set(first=batch.first)
            with self.gl.state(into=target.framebuffer, depth_test=LESS, cull=mesh.look.solid):
                array.render(instances=batch.count)
        self._cluster_program.set(first=len(frame.plan.mesh.records))
        with self.gl.state(into=target.framebuffer, depth_test=LESS):
            self._clusters.draw(frame.plan.clusters, frame.assets.meshes, lambda clusters, part: self._cluster_program)

    def read(self) -> FrontMeshes | None:
        """Return which mesh was in front at each pixel of the frame drawn last. Waits until the GPU has drawn it.

        Returns
        -------
        The meshes and their depths; None unless it `has_drawn`.
        """
        if self._target is None or not self.has_drawn:
            return None
        width, height = self._target.number.size
        number = np.frombuffer(self._target.number.read(alignment=1), np.uint32).reshape(height, width)
        depth = np.frombuffer(self._target.depth.read(alignment=1), np.float32).reshape(height, width)
        return FrontMeshes(number, depth)

    def forget_assets(self) -> None:
        """Drop the vertex arrays over the assets' buffers."""
        self._arrays.forget()

    def _make(self, size: tuple[int, int]) -> _Target:
        number, depth = self.gl.texture(size, 1, "u4"), self.gl.depth_texture(size)
        return _Target(number, depth, self.gl.framebuffer([number], depth))
