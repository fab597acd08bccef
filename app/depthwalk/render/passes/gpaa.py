"""Geometric post-process anti-aliasing: edges blend with what is beyond them, by the part of each pixel that it takes.

Persson, *Geometric Post-process Anti-Aliasing*, 2011, and its edge-optimised variant; see docs/anti-aliasing.md.
"""

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.adjacency import EdgeAdjacency, Shape, build_adjacency
from depthwalk.gpu.device import Scope
from depthwalk.gpu.instances import InstanceStream
from depthwalk.gpu.program import Program
from depthwalk.render.antialiasing.silhouette_lines import LINE_RECORD, outlines
from depthwalk.render.draw.draw_lists import DrawBatch
from depthwalk.render.frame import Frame, Pass
from depthwalk.scene.render_settings import GpaaParams


class GpaaPass(Pass[GpaaParams]):
    name = "gpaa"
    reads = ("surface", "depth", "lit")
    writes = ("lit",)

    def setup(self, gl: Scope) -> None:
        self._edge = Program(gl, "gpaa/edge.vert", "gpaa/edge.frag")
        self._lines = InstanceStream(gl, LINE_RECORD)
        self._edges: dict[tuple[int, int, int], EdgeAdjacency] = {}  # by asset, level and pieces

    def enabled(self, frame: Frame, params: GpaaParams) -> bool:
        return frame.common.aa.geometric and len(frame.plan.mesh.groups) + len(frame.plan.dmesh.groups) > 0

    def draw(self, frame: Frame, params: GpaaParams) -> None:
        lines = self._outlines(frame, params)
        if not len(lines):
            return
        targets = frame.targets
        for unit, texture in enumerate((targets.lit_before(), targets.surface, targets.depth)):
            texture.use(unit)
        self._edge.set(lit_texture=0, surface_texture=1, depth_texture=2)
        least_fold = float(np.cos(np.radians(params.crease_angle)))
        self._edge.set(least_fold=least_fold)
        self._lines.upload(lines)
        self._lines.bind(self._edge.array, 0)
        with self.gl.state(into=targets.lit):
            self._edge.rectangles(len(lines))

    def _outlines(self, frame: Frame, params: GpaaParams) -> NDArray[np.void]:
        """LINE_RECORDs of all that is drawn as triangles; depth images tell by themselves what they cover."""
        least_fold = np.radians(params.crease_angle) if frame.common.aa.mode == "gpaa-edge" else None
        lines = [np.zeros(0, LINE_RECORD)]
        for group in frame.plan.mesh.groups:
            mesh = frame.assets.meshes.object(group.asset, group.level)
            edges = self._edges_of(group, mesh.shape)
            placed = frame.plan.mesh.records[group.first : group.first + group.count]
            lines.append(outlines(edges, frame.view, placed, least_fold, mesh.look.solid))
        for group in frame.plan.dmesh.groups:
            images = frame.assets.depth_object(group.asset)
            edges = self._edges_of(group, partial(images.shape, group.indices))
            placed = frame.plan.dmesh.records[group.first : group.first + group.count]
            lines.append(outlines(edges, frame.view, placed, np.pi, solid=True))  # smooth, but where cut
        return np.concatenate(lines)

    def _edges_of(self, group: DrawBatch, shape: Callable[[], Shape]) -> EdgeAdjacency:
        key = group.asset, group.level, group.pieces
        if key not in self._edges:
            self._edges[key] = build_adjacency(*shape())
        return self._edges[key]

    def forget_assets(self) -> None:
        self._edges.clear()
