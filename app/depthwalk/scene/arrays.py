"""Define the camera, and the nodes and objects of a scene as structures of arrays, which every later stage works on."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray
from pyglm import glm

from depthwalk.geometry.soa import StructOfArrays
from depthwalk.scene.similarity import Similarity, compose

_BLOCK = 8192  # objects placed at a time: their transforms stay in the processor's cache


class Representation(IntEnum):
    """Name the ways to draw an object; the values are stored in `Objects.representation`."""

    MESH = 0  # its triangles
    DPCI = 1  # depth images warped onto a plane, as in the paper
    DMESH = 2  # the same depth samples warped straight to the screen (3-D warp)
    MESH_LOD = 3  # a simplified mesh, as coarse as the error on the screen allows
    MESH_CLUSTERS = 4  # patches of simplified meshes, each as coarse as its own error allows
    RELIEF = 5  # relief mapping: a linear, then a binary search along the ray in a planar depth image's height field
    DISTANCE = 6  # the same height field, traversed in steps whose lengths come from a distance volume
    PARALLAX = 7  # parallax occlusion mapping of the height field: linear steps and one secant, no silhouettes
    BUMP = 8  # the flat picture, shaded with its normals
    DISPLACEMENT = 9  # a grid of the picture's resolution, displaced vertex by vertex
    RELIEF_TEXTURE = 10  # relief texture mapping: pre-warped on the CPU, then drawn as a texture
    BAR_TEXTURE = 11  # bar texture mapping: a straight bar to each texel, from its surface down to its neighbours'
    OCTAHEDRAL = 12  # octahedral impostors: the three nearest of many captured views, blended
    BILLBOARD = 13  # one captured view on a rectangle that turns to the viewer about the y axis of the object
    AUTO = 14  # MESH or DPCI, whichever is quicker; replaced by one of these before drawing

    @property
    def label(self) -> str:
        """Return the name of this representation in scene files and on the command line."""
        return self.name.lower().replace("_", "-")


MESHES = (Representation.MESH, Representation.MESH_LOD, Representation.MESH_CLUSTERS)
"""Representations drawn as polygons."""

CAPTURED = (Representation.OCTAHEDRAL, Representation.BILLBOARD)
"""Captured views of an asset's mesh, rivals of the impostors; their numbers are consecutive and above all others."""

OF_MESH = (*MESHES, *CAPTURED)
"""Representations made from an asset's mesh, by number."""

SIMPLIFIED = (Representation.MESH_LOD, Representation.MESH_CLUSTERS, *CAPTURED)
"""Representations that need the simplified levels of a mesh; clusters and captured views cast shadows with them."""

HEIGHT_FIELDS = (
    Representation.RELIEF,
    Representation.DISTANCE,
    Representation.PARALLAX,
    Representation.BUMP,
    Representation.DISPLACEMENT,
    Representation.RELIEF_TEXTURE,
    Representation.BAR_TEXTURE,
)
"""Rivals of the warp, for assets with a single planar depth image; their numbers are consecutive."""


@dataclass(kw_only=True)
class Objects(StructOfArrays):
    """Hold n placed objects: world point = position + scale · rotate(rotation, asset point).

    Attributes
    ----------
    asset : (n,) int32
        Index into `Scene.assets`.
    position : (n, 3) float32
        Where the centre of the base of the asset's bounding box is placed, metres, world.
    rotation : (n, 4) float32
        Unit quaternion (x, y, z, w), world from asset.
    scale : (n,) float32
        Size relative to the asset, > 0.
    representation : (n,) uint8
        How each object is drawn: the number of a Representation.
    """

    asset: NDArray[np.int32]
    position: NDArray[np.float32]
    rotation: NDArray[np.float32]
    scale: NDArray[np.float32]
    representation: NDArray[np.uint8]

    def __len__(self) -> int:
        """Return the number of objects."""
        return len(self.asset)

    @property
    def of_mesh(self) -> NDArray[np.bool_]:
        """Return which objects, (n,) bool, are drawn from their mesh, and so cast shadows as their mesh."""
        return np.asarray(np.logical_or.reduce([self.representation == kind for kind in OF_MESH]))


@dataclass(frozen=True, kw_only=True)
class Nodes:
    """Hold m nodes in the order of the file, a group before its members.

    A subtree is therefore one run of nodes, and its objects are one run of objects.

    Attributes
    ----------
    name : m strings
        "" for unnamed nodes.
    parent : (m,) int32
        Row of the group that holds the node, −1 at the top.
    depth : (m,) int32
        Number of groups that enclose the node.
    end : (m,) int32
        One past the last node of the subtree.
    first_object, object_count : (m,) int32
        The run of objects in the subtree.
    angles : (m, 3) float64
        Yaw, pitch and roll by which the node is turned in its group, radians; see `similarity.from_angles`.
    local : m transforms, float64
        Parent from node: the placement of the node in its group.
    world : m transforms, float64
        World from node, kept up to date by `set_node_transform`.
    """

    name: tuple[str, ...]
    parent: NDArray[np.int32]
    depth: NDArray[np.int32]
    end: NDArray[np.int32]
    first_object: NDArray[np.int32]
    object_count: NDArray[np.int32]
    angles: NDArray[np.float64]
    local: Similarity
    world: Similarity

    def __len__(self) -> int:
        """Return the number of nodes."""
        return len(self.name)


@dataclass(frozen=True)
class Camera:
    """Describe a pinhole camera in plain numbers, as scene files do.

    Attributes
    ----------
    position
        Position of the camera, metres, world.
    target
        The point at the centre of the picture, metres, world.
    fov
        Vertical field of view, radians; 60° if left out, as in scene files.
    time
        The moment that the picture shows, seconds since the scene's animations began.
    """

    position: tuple[float, float, float]
    target: tuple[float, float, float]
    fov: float = math.radians(60)
    time: float = 0.0

    @property
    def look(self) -> glm.dvec3:
        """Return the vector from the camera to its target, metres, world."""
        return glm.dvec3(*self.target) - glm.dvec3(*self.position)

    def moved(self, shift: glm.dvec3) -> "Camera":
        """Return the camera and its target moved by `shift`, metres, world."""
        (x, y, z), (to_x, to_y, to_z) = self.position, self.target
        position, target = (x + shift.x, y + shift.y, z + shift.z), (to_x + shift.x, to_y + shift.y, to_z + shift.z)
        return replace(self, position=position, target=target)


def place_nodes(nodes: Nodes, rows: NDArray[np.integer]) -> None:
    """Recompute the world transforms of nodes from their parents', in place.

    Parameters
    ----------
    nodes
        All nodes of a scene, whose `world` changes.
    rows
        (k,) the nodes; they must be whole subtrees.
    """
    depth = nodes.depth[rows]
    for groups_above in np.unique(depth).tolist():
        level = rows[depth == groups_above]
        local = nodes.local[level]
        nodes.world[level] = compose(nodes.world[nodes.parent[level]], local) if groups_above else local


def place_objects(
    objects: Objects,
    nodes: Nodes,
    instances: Similarity,
    owner: NDArray[np.int32],
    which: slice | NDArray[np.integer],
) -> None:
    """Recompute the world transforms of objects from those of their nodes, in place.

    Parameters
    ----------
    objects
        All n objects of a scene, whose position (metres), rotation and scale change.
    nodes
        All nodes of the scene, with their present world transforms.
    instances
        n transforms, metres: the placement of each object in the frame of its node.
    owner
        (n,) int32, the row in `nodes` of the node that holds each object.
    which
        The objects: a slice of them, or (k,) their rows.
    """
    for rows in _blocks(which):
        world = compose(nodes.world[owner[rows]], instances[rows])
        objects.position[rows], objects.rotation[rows], objects.scale[rows] = (
            world.position,
            world.rotation,
            world.scale,
        )


def _blocks(which: slice | NDArray[np.integer]) -> Iterator[slice | NDArray[np.integer]]:
    """Yield a slice or rows in blocks of at most _BLOCK."""
    if isinstance(which, slice):
        for first in range(which.start, which.stop, _BLOCK):
            yield slice(first, min(first + _BLOCK, which.stop))
    else:
        for first in range(0, len(which), _BLOCK):
            yield which[first : first + _BLOCK]
