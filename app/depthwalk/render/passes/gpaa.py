"""Blend pixels that an edge of the geometry crosses with their neighbour: geometric post-process anti-aliasing (GPAA).

Silhouettes and creases of everything drawn as triangles are drawn as lines over the picture; each pixel that a line
crosses is mixed with the one beyond, by the part of its area that lies beyond. Persson, *Geometric Post-process
Anti-Aliasing*, 2011, and its edge-optimised variant; see docs/anti-aliasing.md.
"""

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.adjacency import EdgeAdjacency, Shape, build_adjacency
from depthwalk.gpu.device import DEPTH_CLAMP, Scope
from depthwalk.gpu.instances import InstanceStream
from depthwalk.gpu.program import Program, Variants
from depthwalk.render.antialiasing.silhouette_lines import LINE_RECORD, silhouette_lines
from depthwalk.render.blended_picture import blended_picture, blending_defines, picture_before
from depthwalk.render.draw.draw_lists import DrawBatch
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.resources.placed_records import PLACED_RECORD
from depthwalk.render.view.view import View
from depthwalk.scene.effect_settings import GpaaParams
from depthwalk.scene.environment import GroundParams


class GpaaPass(Pass[GpaaParams]):
    """Anti-alias the silhouettes and creases of everything drawn as triangles, and the sides of the ground."""

    name = "gpaa"
    blends_shown = True
    reads = ("surface", "depth", "lit", "screen")
    writes = ("lit", "screen")

    def setup(self, gl: Scope) -> None:
        """Prepare the variants of the program, and the buffer of lines; `gl` owns them."""
        self._programs = Variants(lambda defines: Program(gl, "gpaa/edge.vert", "gpaa/edge.frag", defines))
        self._lines = InstanceStream(gl, LINE_RECORD)
        self._edges: dict[tuple[int, int, int], EdgeAdjacency] = {}  # by asset, level of detail and pieces

    def enabled(self, frame: Frame, params: GpaaParams) -> bool:
        """Return whether the anti-aliasing of `frame` is geometric and anything is drawn as triangles.

        The `params` do not matter.
        """
        polygons = frame.plan.polygons.batches or frame.plan.dmesh.batches or _ground(frame) is not None
        return frame.common.aa.geometric and bool(polygons)

    def draw(self, frame: Frame, params: GpaaParams) -> None:
        """Blend pixels along the silhouettes and creases in `frame` that `params` ask for."""
        lines = self._silhouettes(frame, params)
        if not len(lines):
            return
        targets = frame.targets
        program = self._programs[blending_defines(frame)]
        for unit, texture in enumerate((picture_before(frame), targets.surface, targets.depth)):
            texture.use(unit)
        program.set(before_texture=0, surface_texture=1, depth_texture=2)
        least_fold = float(np.cos(np.radians(params.crease_angle)))
        program.set(least_fold=least_fold)
        self._lines.upload(lines)
        self._lines.bind(program.array)
        with self.gl.state(into=blended_picture(frame), direct=(DEPTH_CLAMP,)):  # the ground may end at the far plane
            program.rectangles(len(lines))

    def _silhouettes(self, frame: Frame, params: GpaaParams) -> NDArray[np.void]:
        """Return the LINE_RECORDs of everything drawn as triangles. Depth images have `coverage` instead."""
        least_fold = np.radians(params.crease_angle) if frame.common.aa.mode == "gpaa-edge" else None
        lines = [np.zeros(0, LINE_RECORD)]
        polygons = frame.plan.polygons
        for batch in polygons.batches:
            mesh = frame.assets.meshes.object(batch.asset, batch.level)
            edges = self._edges_of(batch, mesh.shape)
            placed = polygons.records[batch.first : batch.first + batch.count]
            lines.append(silhouette_lines(edges, frame.view, placed, least_fold, mesh.look.solid))
        for batch in frame.plan.dmesh.batches:
            images = frame.assets.depth_object(batch.asset)
            edges = self._edges_of(batch, partial(images.shape, batch.indices))
            placed = frame.plan.dmesh.records[batch.first : batch.first + batch.count]
            # Smooth surfaces, without creases except at cuts.
            lines.append(silhouette_lines(edges, frame.view, placed, np.pi, solid=not images.shows_backs))
        if (ground := _ground(frame)) is not None:
            lines.append(_ground_lines(frame.view, ground))
        return np.concatenate(lines)

    def _edges_of(self, batch: DrawBatch, shape: Callable[[], Shape]) -> EdgeAdjacency:
        """Return the edges of what a batch draws, computed when first needed. shape: returns points and triangles."""
        key = batch.asset, batch.level, batch.pieces
        if key not in self._edges:
            self._edges[key] = build_adjacency(*shape())
        return self._edges[key]

    def forget_assets(self) -> None:
        """Drop the edges of meshes and depth images."""
        self._edges.clear()


def _ground(frame: Frame) -> GroundParams | None:
    """Return the ground whose sides are smoothed; `gpaa`, as in the paper, draws the edges of objects alone."""
    return frame.environment.ground if frame.common.aa.mode == "gpaa-edge" else None


def _ground_lines(view: View, ground: GroundParams) -> NDArray[np.void]:
    """Return the LINE_RECORDs of the four sides of the ground, its horizon; see shaders/ground/ground.vert."""
    side = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]]) * ground.half_size
    placed = np.zeros(1, PLACED_RECORD)
    placed["origin"] = np.array([0.0, ground.height, 0.0]) - view.position
    placed["rotation"], placed["scale"] = (0, 0, 0, 1), 1
    return silhouette_lines(build_adjacency(side, np.array([[0, 2, 1], [0, 3, 2]])), view, placed, np.pi, solid=False)
