"""Draw one mesh as the plainest engine would: forward, in one draw, by a level of detail decimated before.

There are no targets between the mesh and the screen, no copies, and nothing is decided but the level. Light, colours
and mathematics are those of depthwalk's own passes, so that both pictures are of the same scene.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np

from depthwalk.colour import srgb8_from_linear
from depthwalk.geometry.quaternions import rotate
from depthwalk.gpu.device import headless_device
from depthwalk.gpu.program import Program
from depthwalk.gpu.state import LESS
from depthwalk.ingest.mesh import MeshLevel
from depthwalk.ingest.solid import is_solid
from depthwalk.render.lighting.irradiance import lighting
from depthwalk.render.renderer import read_pixels
from depthwalk.render.view.bounds import depth_range
from depthwalk.render.view.view import View
from depthwalk.render.view.view_block import PICTURE_VIEW, ViewBlock
from depthwalk.scene.scene import Scene
from depthwalk.types import Picture

_FOLDER = Path(__file__).parent


class PlainEngine:
    """Draw the first object of a scene, which has a plain background, without ground, lamps or shadows.

    Parameters
    ----------
    scene : the scene, whose mesh has one material without texture.
    levels : the mesh and its decimated versions, the finest first.
    size : width and height of the pictures, pixels.
    error : how far the level that is drawn may be from the mesh, pixels; may be changed between pictures.
    """

    def __init__(self, scene: Scene, levels: Sequence[MeshLevel], size: tuple[int, int], error: float) -> None:
        self.size, self.error, self.level = size, error, 0
        self._levels = levels
        self.device = headless_device()
        with self.device.context:
            self._gl = self.device.scope("plain engine")
            self._screen = self._gl.framebuffer([self._gl.texture(size, 4)], self._gl.depth_texture(size))
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
        points, self._scale = levels[0].mesh.positions, float(scene.objects.scale[0])
        centre = (points.min(0) + points.max(0)) / 2
        self._radius = self._scale * float(np.linalg.norm(points - centre, axis=1).max())
        self._origin, self._rotation = scene.objects.position[0], scene.objects.rotation[0]
        self._centre = self._origin + self._scale * rotate(self._rotation, centre)
        self._solid = is_solid(levels[0].mesh)

    def _array(self, level: MeshLevel) -> moderngl.VertexArray:
        vertices = np.concatenate([level.mesh.positions, level.mesh.normals], 1).astype(np.float32)
        return self._gl.vertex_array(
            self._program.gl,
            [(self._gl.buffer(vertices), "3f 3f", "in_position", "in_normal")],
            index_buffer=self._gl.buffer(np.ascontiguousarray(level.mesh.faces, np.uint32)),
        )

    def draw(self, view: View) -> None:
        """Draw the object, and wait for nothing."""
        distance = float(view.axes[2] @ (self._centre - view.position))
        near, far = depth_range(np.array([distance]), np.array([self._radius]), None)
        view = replace(view, near=near, far=far)
        nearest = max(float(np.linalg.norm(self._centre - view.position)) - self._radius, near)
        allowed = self.error * nearest / view.focal_pixels / self._scale
        self.level = max(k for k, level in enumerate(self._levels) if level.error <= allowed)
        origin = tuple((self._origin - view.position).tolist())
        with self.device.context:
            self._view.show(view)
            red, green, blue = self._background
            self._screen.clear(color=(red, green, blue, 1.0), depth=1.0)
            self._program.set(origin=origin, rotation=tuple(self._rotation.tolist()), scale=self._scale)
            with self._gl.state(into=self._screen, depth_test=LESS, cull=self._solid):
                self._arrays[self.level].render()

    def pixels(self) -> Picture:
        """Return the picture drawn last, (H, W, 4) uint8, top row first."""
        with self.device.context:
            return read_pixels(self._screen)

    def release(self) -> None:
        """Free the context and all in it."""
        with self.device.context:
            self._gl.release()
        self.device.context.release()
