"""Draw one mesh, once or many times, as the plainest engine would: forward, by levels of detail decimated before.

There are no targets between the mesh and the screen, no copies, and nothing is decided but what the frustum holds and
the level of each object. Light, colours and mathematics are those of depthwalk's own passes, so that both pictures are
of the same scene.
"""

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np

from depthwalk.colour import srgb8_from_linear
from depthwalk.gpu.headless_device import headless_device
from depthwalk.gpu.instances import InstanceStream
from depthwalk.gpu.program import Program
from depthwalk.gpu.state import LESS
from depthwalk.ingest.mesh import Mesh, MeshLevel
from depthwalk.ingest.solid import is_solid
from depthwalk.render.image import read_pixels
from depthwalk.render.lighting.irradiance import lighting
from depthwalk.render.resources.placed_records import PLACED_RECORD, placed_records
from depthwalk.render.view.bounds import depth_range, object_bounds
from depthwalk.render.view.view import View
from depthwalk.render.view.view_block import PICTURE_VIEW, ViewBlock
from depthwalk.scene.scene import Scene
from depthwalk.types import Ints, Picture

_FOLDER = Path(__file__).parent


def edge_length(mesh: Mesh) -> float:
    """Return the mean length of the edges of a mesh's triangles, metres."""
    corners = mesh.positions[mesh.faces]
    return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())


class PlainEngine:
    """Draw the objects of a scene, which has a plain background, without ground, lamps or shadows.

    An object gets the coarsest level whose features are at most `allowed` pixels large where the object is nearest.

    Parameters
    ----------
    scene : the scene, whose objects have one mesh, of one material without texture.
    levels : the mesh and its decimated versions, the finest first.
    features : (levels,) what must be small in a picture, metres, rising: how far each level is from the mesh, or how
        long its edges are.
    size : width and height of the pictures, pixels.
    allowed : how large features may be, pixels; may be changed between pictures.

    Attributes
    ----------
    drawn : (levels,) how many objects the picture drawn last shows of each level.
    triangles : how many triangles that takes.
    """

    def __init__(
        self,
        scene: Scene,
        levels: Sequence[MeshLevel],
        features: Sequence[float],
        size: tuple[int, int],
        allowed: float,
    ) -> None:
        self.size, self.allowed = size, allowed
        self.drawn, self.triangles = np.zeros(len(levels), np.int64), 0
        self._faces = np.array([len(level.mesh.faces) for level in levels])
        self._features = np.maximum.accumulate(features)
        self.device = headless_device()
        with ExitStack() as made:  # what a failing step leaves behind goes with the context
            made.callback(self.device.context.release)
            with self.device.context:
                self._make(scene, levels)
            made.pop_all()
        points, self._objects = levels[0].mesh.positions, scene.objects
        centre = (points.min(0) + points.max(0)) / 2
        radius = np.linalg.norm(points - centre, axis=1).max()
        one_asset = replace(scene.objects, asset=np.zeros(len(scene.objects), np.int32))
        self._bounds = object_bounds(one_asset, centre[None], np.array([radius]))
        self._solid = is_solid(levels[0].mesh)

    def _make(self, scene: Scene, levels: Sequence[MeshLevel]) -> None:
        """Make what the pictures are drawn with, in the context, which is current."""
        self._gl = self.device.scope("plain engine")
        self._screen = self._gl.framebuffer([self._gl.texture(self.size, 4)], self._gl.depth_texture(self.size))
        light = lighting(scene.environment)
        self._background = (srgb8_from_linear(light.sky.radiance(np.array([[0.0, 1, 0]])))[0] / 255).tolist()
        self._program = Program(self._gl, _FOLDER / "plain.vert", _FOLDER / "plain.frag", ("CLAMP", *light.defines))
        material = levels[0].mesh.materials[0]
        self._program.set(
            base_colour=material.base_colour,
            specular=material.specular,
            shininess=material.shininess,
            **light.uniforms(),
        )
        self._view = ViewBlock(self._gl, PICTURE_VIEW)
        self._arrays = [self._array(level) for level in levels]
        self._instances = InstanceStream(self._gl, PLACED_RECORD)

    def _array(self, level: MeshLevel) -> moderngl.VertexArray:
        vertices = np.concatenate([level.mesh.positions, level.mesh.normals], 1).astype(np.float32)
        return self._gl.vertex_array(
            self._program.gl,
            [(self._gl.buffer(vertices), "3f 3f", "in_position", "in_normal")],
            index_buffer=self._gl.buffer(np.ascontiguousarray(level.mesh.faces, np.uint32)),
        )

    def draw(self, view: View) -> None:
        """Draw what the frustum holds, the finest levels and so the nearest objects first, and wait for nothing."""
        rows, forward = self._bounds.visible(view)
        near, far = depth_range(forward, self._bounds.bounding_radius[rows], None)
        level = self._levels(view, rows, near)
        order = np.argsort(level, kind="stable")
        self.drawn = np.bincount(level, minlength=len(self._arrays))
        self.triangles = int(self.drawn @ self._faces)
        with self.device.context:
            self._view.show(replace(view, near=near, far=far))
            red, green, blue = self._background
            self._screen.clear(color=(red, green, blue, 1.0), depth=1.0)
            records = placed_records(view.position, self._objects.take(rows[order]))
            firsts = np.cumsum(self.drawn) - self.drawn
            with self._gl.state(into=self._screen, depth_test=LESS, cull=self._solid):
                for array, first, count in zip(self._arrays, firsts.tolist(), self.drawn.tolist(), strict=True):
                    if count:
                        self._instances.upload(records[first : first + count])
                        self._instances.bind(array)
                        array.render(instances=count)

    def _levels(self, view: View, rows: Ints, near: float) -> Ints:
        """Return the level (m,) of each of the objects `rows` (m,); none is taken to be nearer than `near`, metres."""
        bounds = self._bounds.take(rows)
        nearest = np.maximum(np.linalg.norm(bounds.centre - view.position, axis=1) - bounds.bounding_radius, near)
        allowed = self.allowed * nearest / view.focal_pixels / self._objects.scale[rows]
        level: Ints = np.searchsorted(self._features, allowed, "right") - 1
        return np.maximum(level, 0)

    def finish(self) -> None:
        """Wait until the frame is drawn."""
        self.device.finish()

    def pixels(self) -> Picture:
        """Return the picture drawn last, (H, W, 4) uint8, top row first."""
        with self.device.context:
            return read_pixels(self._screen)

    def release(self) -> None:
        """Free the context and all in it."""
        with self.device.context:
            self._gl.release()
        self.device.context.release()
