"""Turn planar depth images into bars, for bar texture mapping.

Li, Wang and Wu 2004 (*Bar texture mapping*, Journal of Software 15) divide each texel of a depth image into consecutive
layers, from its own depth on, so that all of them together approximate the surface without gaps. A bar here is
continuous: it has both ends instead of layers.
"""

from dataclasses import dataclass

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.gpu.device import Scope

_CORNERS = np.array([0, 1, 2, 2, 1, 3], np.uint32)  # two triangles of a strip


@dataclass(frozen=True, kw_only=True)
class Bars:
    """Hold the bars of a height field on the GPU, whose GL objects belong to the asset store.

    Attributes
    ----------
    ends
        (H, W) texels: the depths of both ends of each bar, 0 to 1; see `bar_ends`.
    triangles
        The indices of the strips, see `bar_triangles`.
    """

    ends: moderngl.Texture
    triangles: moderngl.Buffer

    @property
    def bytes(self) -> int:
        """Return how many bytes of GPU memory the bars take."""
        return 8 * self.ends.width * self.ends.height + self.triangles.size


def upload_bars(gl: Scope, relative: NDArray[np.float32], solid: NDArray[np.bool_]) -> Bars:
    """Upload the bars of a planar depth image into a scope.

    Parameters
    ----------
    gl
        The scope that owns texture and buffer.
    relative
        (H, W) depths, see `relative_depth`.
    solid
        (H, W) which texels have a surface.

    Returns
    -------
    Bars
        The bars on the GPU.
    """
    height, width = relative.shape
    texture = gl.texture((width, height), 2, "f4", bar_ends(relative, solid).tobytes())
    texture.filter = moderngl.NEAREST, moderngl.NEAREST
    return Bars(ends=texture, triangles=gl.buffer(bar_triangles(solid)))


def bar_ends(relative: NDArray[np.float32], solid: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return where the bar of each texel begins and ends: at its own depth, and at that of its deepest neighbour.

    Parameters
    ----------
    relative
        (H, W) depths, 0 to 1.
    solid
        (H, W) which texels have a surface. Others have no bar, and end no bar of their neighbours.

    Returns
    -------
    NDArray[np.float32]
        (H, W, 2) depths, the second at least the first, both 0 where there is no bar.
    """
    own = np.where(solid, relative, np.float32(0))
    deepest, padded = own.copy(), np.pad(own, 1)
    for neighbour in (padded[:-2, 1:-1], padded[2:, 1:-1], padded[1:-1, :-2], padded[1:-1, 2:]):
        np.maximum(deepest, neighbour, out=deepest)
    return np.stack([own, np.where(solid, deepest, np.float32(0))], -1)


def bar_triangles(solid: NDArray[np.bool_]) -> NDArray[np.uint32]:
    """Return the triangles of the strips of all texels with a surface, four vertices to a texel.

    Parameters
    ----------
    solid
        (H, W) which texels have a surface.

    Returns
    -------
    NDArray[np.uint32]
        (6 · n,) numbers of vertices; the first texel has 0 to 3. One degenerate triangle where there is no texel.
    """
    bar = np.flatnonzero(solid).astype(np.uint32)
    if not len(bar):
        return np.zeros(3, np.uint32)
    return (4 * bar[:, None] + _CORNERS).ravel()
