"""Fill the uniform block `View` of shaders/common/view.glsl: what a picture or a shadow map is seen through.

Every shader that projects points, follows rays or measures pixels reads this one block, which is filled once per view
instead of once per program. Pictures and shadow maps have separate binding points, so that drawing maps in the middle
of a frame does not disturb the picture's view.
"""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from pyglm import glm

from depthwalk.gpu.device import Scope
from depthwalk.render.view.view import View, matrix_array

PICTURE_VIEW, MAP_VIEW = 0, 1  # binding points of the block in programs that draw pictures, and shadow maps

# std140: a matrix is a run of columns, each padded to 16 bytes; vectors of three begin at multiples of 16 bytes.
VIEW_BLOCK = np.dtype(
    {
        "names": [
            "clip_from_eye",
            "ray_from_screen",
            "eye",
            "view_position",
            "pixel_angle",
            "depth_range",
            "depth_from_inverse",
            "view_size",
        ],
        "formats": ["(4,4)f4", "(3,4)f4", "4f4", "3f4", "f4", "2f4", "2f4", "2f4"],
        "offsets": [0, 64, 112, 128, 140, 144, 152, 160],
        "itemsize": 176,
    }
)


class MapView(Protocol):
    """Describe what one shadow map sees; implemented by `Cascade` for maps of the sun and by `Spot` for lamps."""

    @property
    def clip_from_centre(self) -> glm.dmat4:
        """Return the transform from world vectors that begin at `centre`, metres, to clip coordinates."""
        ...

    @property
    def centre(self) -> tuple[float, float, float]:
        """Return the world point that vectors in the shader are measured from, metres."""
        ...

    @property
    def light(self) -> tuple[float, float, float, float]:
        """Return the position of the light relative to `centre`, in homogeneous coordinates, world axes.

        For the sun this is the direction to it, with a last component of 0.
        """
        ...

    @property
    def texel(self) -> float:
        """Return the length that the edge of a texel covers, metres; for a lamp, at a distance of one metre."""
        ...

    @property
    def resolution(self) -> int:
        """Return how many texels an edge of the map has."""
        ...


class ViewBlock:
    """Hold one uniform buffer with a `VIEW_BLOCK` record.

    Parameters
    ----------
    scope
        Owns the buffer.
    binding
        The binding point of the programs that read it: `PICTURE_VIEW` or `MAP_VIEW`.
    """

    def __init__(self, scope: Scope, binding: int) -> None:
        self._binding = binding
        self._scope = scope
        self._buffer = scope.buffer(reserve=VIEW_BLOCK.itemsize, dynamic=True)
        self._shown: View | MapView | None = None

    def show(self, view: View | MapView) -> None:
        """Fill the buffer with a view and bind it; it is written only if `view` is another object than before.

        Parameters
        ----------
        view
            What a picture or a shadow map is seen through.

        Raises
        ------
        ValueError
            For a picture's view whose near and far plane are not fitted yet.
        """
        if view is not self._shown:
            record = picture_record(view) if isinstance(view, View) else map_record(view)
            self._scope.refill(self._buffer, record)
            self._shown = view
        self._buffer.bind_to_uniform_block(self._binding)


def picture_record(view: View) -> NDArray[np.void]:
    """Return a single `VIEW_BLOCK` record for a picture, whose `view` has near and far plane fitted."""
    near, far = view.depth_range
    record = np.zeros((), VIEW_BLOCK)
    record["clip_from_eye"] = matrix_array(view.clip_from_eye).T
    record["ray_from_screen"][:, :3] = view.ray_from_screen.T
    record["eye"] = 0, 0, 0, 1
    record["view_position"] = view.position
    record["pixel_angle"] = 1 / view.focal_pixels
    record["depth_range"] = near, far
    record["depth_from_inverse"] = far / (far - near), near * far / (far - near)
    record["view_size"] = view.size
    return record


def map_record(view: MapView) -> NDArray[np.void]:
    """Return a single `VIEW_BLOCK` record for a shadow map that `view` describes.

    Shaders only compare the depths of a map, and follow no rays in it, so the fields for these are 0.
    """
    record = np.zeros((), VIEW_BLOCK)
    record["clip_from_eye"] = matrix_array(view.clip_from_centre).T
    record["eye"] = view.light
    record["view_position"] = view.centre
    record["pixel_angle"] = view.texel
    record["view_size"] = view.resolution
    return record
