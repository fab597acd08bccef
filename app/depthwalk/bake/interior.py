"""Find out whether a mesh encloses a space, such as a room, whose walls cannot be seen from outside."""

import numpy as np

from depthwalk.bake.raycast import RayCaster
from depthwalk.geometry.extreme_points import spread_directions
from depthwalk.ingest.mesh import Mesh

_ALONG = 5  # positions along each axis of the bounding box
_RAYS = 48  # from each position
_CLOSED = 0.9  # of the rays must hit something: a room has a door and windows, an arcade is open
_FACING = 0.8  # of the hits must face the position: within a solid all show their backs, within foliage half
_LEAST_SHARE = 0.05  # of the positions must be in such a space


def has_interior(mesh: Mesh, caster: RayCaster) -> bool:
    """Return whether a mesh has an interior to stand in, whose surfaces depth images leave out.

    Depth images hold what can be seen from outside. Rays are cast in all directions from a grid in the bounding box.

    Parameters
    ----------
    mesh
        The mesh.
    caster
        The same mesh, ready for ray casting.

    Returns
    -------
    bool
        Whether at least a twentieth of the positions are enclosed by surfaces that face them.
    """
    low, high = (corner.astype(np.float64) for corner in mesh.bounds)
    steps = (np.arange(_ALONG) + 0.5) / _ALONG
    places = low + np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), -1).reshape(-1, 3) * (high - low)
    directions = spread_directions(_RAYS)
    hits = caster.first(np.repeat(places, _RAYS, axis=0), np.tile(directions, (len(places), 1)))
    met = np.isfinite(hits.distance).reshape(-1, _RAYS)
    facing = (~hits.flipped).reshape(-1, _RAYS) & met
    enclosed = (met.mean(1) >= _CLOSED) & (facing.sum(1) >= _FACING * met.sum(1))
    return bool(enclosed.mean() >= _LEAST_SHARE)
