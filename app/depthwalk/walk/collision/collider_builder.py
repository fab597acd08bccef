"""Make the collider of an asset from its mesh or from its cooked depth images."""

import numpy as np

from depthwalk.cook.lod_geometry import LodGeometry
from depthwalk.geometry.indexed_triangles import distinct_triangles, drop_unused, normals_and_areas
from depthwalk.geometry.triangles import row_ids
from depthwalk.ingest.mesh import Mesh
from depthwalk.render.lod.selection import error_level
from depthwalk.types import Array, Ints
from depthwalk.walk.collision.collider import Collider, collider
from depthwalk.walk.collision.foliage import thin_leaves

_ERROR = 0.02  # metres, world, that a level may be off
_VOXELS = 0.02, 0.05, 0.1  # metres, world: edges of the voxels in which vertices are merged while triangles are dense
_FEW = 2000  # triangles, which are never merged
_DENSE = 0.005  # metres², world: triangles that are smaller on average


def level_of(error: Array, scale: float) -> int:
    """Return which level of cooked depth images stops a viewer: the coarsest that is accurate enough.

    Parameters
    ----------
    error
        (levels,) geometric errors, metres, asset frame, the finest level first.
    scale
        Size of the object relative to the asset.

    Returns
    -------
    int
        The number of the level; 0 if none is accurate enough.
    """
    return int(error_level(error[None] * scale, np.array([_ERROR]))[0])


def from_images(geometry: LodGeometry, scale: float) -> Collider:
    """Return the collider of a cooked object.

    Parameters
    ----------
    geometry
        The object's levels.
    scale
        Size of the largest object that shows it, relative to the asset.

    Returns
    -------
    Collider
        Its surface, object frame.
    """
    level = level_of(geometry.error, scale)
    return from_triangles(geometry.positions, geometry.drawn(level), scale)


def from_mesh(mesh: Mesh, scale: float) -> Collider:
    """Return the collider of a mesh: of its opaque and translucent faces, but not of those that are cut out.

    Parameters
    ----------
    mesh
        The mesh.
    scale
        Size of the largest object that shows it, relative to the asset.

    Returns
    -------
    Collider
        Its surface, asset frame.
    """
    solid = np.ones(len(mesh.faces), bool)
    for part in mesh.parts:
        if mesh.materials[part.material].cutoff is not None:  # leaves on cards
            solid[part.first_face : part.first_face + part.face_count] = False
    faces = np.concatenate([mesh.faces[solid], mesh.translucent_faces]).astype(np.int64)
    return from_triangles(mesh.positions, faces, scale)


def from_triangles(points: Array, triangles: Ints, scale: float) -> Collider:
    """Return the collider of a surface, without thin leaves and without details that nobody feels.

    Parameters
    ----------
    points
        (n, 3) vertices, metres, asset frame.
    triangles
        (t, 3) rows of `points`.
    scale
        Size of the largest object that shows it, relative to the asset.

    Returns
    -------
    Collider
        The surface.
    """
    triangles = triangles[~thin_leaves(points, triangles, scale)]
    for voxel in _VOXELS:
        if len(triangles) > _FEW and normals_and_areas(points, triangles)[1].mean() * scale**2 < _DENSE:
            points, triangles = merged(points, triangles, voxel / scale)
    kept, triangles = drop_unused(triangles, len(points))
    return collider(points[kept], triangles)


def merged(points: Array, triangles: Ints, voxel: float) -> tuple[Array, Ints]:
    """Merge all vertices within each voxel into their mean, and drop triangles that lose a corner or occur twice.

    Unlike `cook.vertex_clustering`, this also merges the sides of a leaf, since a single one stops a viewer as well.

    Parameters
    ----------
    points
        (n, 3) vertices, metres.
    triangles
        (t, 3) rows of `points`.
    voxel
        Edge of a voxel, metres.

    Returns
    -------
    tuple
        Vertices (m, 3), metres, and triangles (u, 3), rows of these.
    """
    number, first = row_ids(np.floor(points / voxel).astype(np.int64))
    count = np.bincount(number, minlength=len(first))
    means = np.stack([np.bincount(number, axis, len(first)) / count for axis in points.T], -1)
    return means, distinct_triangles(number[triangles])
