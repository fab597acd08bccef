"""Draw planar depth images by relief texture mapping: pre-warped on the CPU, then drawn as ordinary textures.

Oliveira, Bishop and McAllister 2000, "Relief Texture Mapping". The CPU warps the depths of each object within the
picture's plane, in two one-dimensional passes (`render.relief_prewarp`); one rectangle shows the result. As in the
publication, nothing is kept from frame to frame.
"""

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.quaternions import conjugate, rotate
from depthwalk.gpu.device import DEPTH_CLAMP, Scope
from depthwalk.gpu.instances import InstanceStream
from depthwalk.gpu.program import Program, Variants
from depthwalk.gpu.state import LESS
from depthwalk.params import Params
from depthwalk.render.frame import Frame, Pass
from depthwalk.render.relief_prewarp import PlaneImages, most_texels, plane_images, prewarp
from depthwalk.render.resources.placed_records import PLACED_RECORD
from depthwalk.scene.arrays import Representation
from depthwalk.types import Array

_PLACED = PLACED_RECORD.names or ()
_IMAGE = "low", "step", "count"  # where an object's image lies, see `PlaneImages`
_RECORD = np.dtype([*((name, PLACED_RECORD[name]) for name in _PLACED), *((name, "2f4") for name in _IMAGE)])
_RECTANGLE = 6  # vertices
_MOST_BYTES = 64 << 20  # of the images that are warped before they are drawn; a single image has at most a quarter


class ReliefTexturePass(Pass[Params]):
    """Draw the height fields of objects with `representation: relief-texture`."""

    name = "relief_texture"
    draws_objects = True
    representation = Representation.RELIEF_TEXTURE
    writes = ("visibility", "depth")

    def setup(self, gl: Scope) -> None:
        """Prepare the program, whose variants are compiled when first needed; `gl` owns their GL objects."""
        shaders = "relief_texture/relief_texture.vert", "relief_texture/relief_texture.frag"
        self._programs = Variants(lambda defines: Program(gl, *shaders, defines))
        self._instances = InstanceStream(gl, _RECORD)
        self._images: moderngl.TextureArray | None = None

    def draw(self, frame: Frame, params: Params) -> None:
        """Draw into `visibility` and `depth` what `frame` shows in this representation; `params` is empty."""
        drawn = frame.plan.height_fields[Representation.RELIEF_TEXTURE]
        first_id = frame.plan.first_id_of(Representation.RELIEF_TEXTURE)
        # Unclamped, the rectangle may be nearer than the near plane while the surface behind it is not.
        with self.gl.state(into=frame.targets.visibility, depth_test=LESS, cull=True, direct=(DEPTH_CLAMP,)):
            for batch in drawn.batches:
                end = batch.first + batch.count
                most = self._objects_at_once(frame.assets.height_fields.relative(batch.asset))
                for first in range(batch.first, end, most):
                    records = drawn.records[first : min(first + most, end)]
                    self._draw_images(frame, batch.asset, records, first_id + first)

    def _draw_images(self, frame: Frame, number: int, records: NDArray[np.void], first_id: int) -> None:
        """Warp and draw instances of the depth object `number`, PLACED_RECORDs; `first_id`: the number of the first."""
        field, depth = frame.assets.height_fields.field(number), frame.assets.height_fields.relative(number)
        viewer = field.from_object(_viewers(records))
        images = plane_images((depth.shape[0], depth.shape[1]), viewer)
        self._upload(prewarp(depth, viewer, images))
        program = self._programs[frame.targets.defines]
        program.set(images=0, first=first_id, **field.uniforms)
        self._instances.upload(_with_images(records, images))
        self._instances.bind(program.array)
        program.array.render(moderngl.TRIANGLES, vertices=_RECTANGLE, instances=len(records))

    def _objects_at_once(self, depth: Array) -> int:
        """Return how many images of the height field `depth` (H, W) are warped before they are drawn."""
        largest = 4 * int(np.prod(most_texels((depth.shape[0], depth.shape[1]))))
        return max(1, min(_MOST_BYTES // largest, self.gl.device.limits.layers))

    def _upload(self, warped: Array) -> None:
        """Upload the images `warped` (n, rows, columns) float32 as layers of the texture, and bind it to unit 0."""
        needed = size = np.array(warped.shape[::-1])
        if self._images is not None:
            both = np.maximum(needed, self._images.size)
            size = both if 4 * int(np.prod(both)) <= _MOST_BYTES else needed
        if self._images is None or (size > self._images.size).any():
            if self._images is not None:
                self.gl.free(self._images)
            self._images = self.gl.number_array(tuple(size.tolist()), 1, None, "f4")
        self._images.write(warped.tobytes(), viewport=(0, 0, 0, *needed.tolist()))
        self._images.use(0)


def _viewers(records: NDArray[np.void]) -> Array:
    """Return where the viewer stands in the frames of objects, (n, 3) metres, from their PLACED_RECORDs."""
    origin, rotation = records["origin"].astype(np.float64), records["rotation"].astype(np.float64)
    viewers: Array = rotate(conjugate(rotation), -origin) / records["scale"][:, None]
    return viewers


def _with_images(records: NDArray[np.void], images: PlaneImages) -> NDArray[np.void]:
    """Return n PLACED_RECORDs, each with where its image lies, as `_RECORD`s."""
    joined = np.zeros(len(records), _RECORD)
    for name in _PLACED:
        joined[name] = records[name]
    for name in _IMAGE:
        joined[name] = getattr(images, name)
    return joined
