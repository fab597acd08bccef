"""Define the objects of a scene as a structure of arrays, which every later stage works on, and its camera."""

from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray
from pyglm import glm

from depthwalk.geometry.soa import StructOfArrays


class Representation(IntEnum):
    """Say how an object is drawn; the values are stored in `Objects.representation`."""

    MESH = 0  # its triangles
    DPCI = 1  # depth images warped onto a plane (the paper)
    DMESH = 2  # the same depth samples warped straight to the screen (3-D warp)
    MESH_LOD = 3  # a simplified mesh, as coarse as the error on the screen allows
    MESH_CLUSTERS = 4  # patches of simplified meshes, each as coarse as its own error allows
    RELIEF = 5  # relief mapping: rays meet the height field of a planar depth image after linear and binary search
    DISTANCE = 6  # rays cross the same height field in steps as long as a volume of distances allows
    PARALLAX = 7  # parallax occlusion mapping of the same: linear steps and one secant, no silhouettes
    BUMP = 8  # the plane of the picture, with its normals
    DISPLACEMENT = 9  # a grid of the picture's resolution, displaced vertex by vertex
    RELIEF_TEXTURE = 10  # relief texture mapping: pre-warped by the processor, then drawn as a texture
    OCTAHEDRAL = 11  # octahedral impostors: the three nearest of many captured views, blended
    BILLBOARD = 12  # one captured view on an upright rectangle that faces the viewer
    AUTO = 13  # as MESH or DPCI, whichever is quicker; what is drawn is one of these

    @property
    def label(self) -> str:
        """Return the name by which scene files and the command line ask for this representation."""
        return self.name.lower().replace("_", "-")


MESHES = (Representation.MESH, Representation.MESH_LOD, Representation.MESH_CLUSTERS)
"""What is drawn as polygons."""

CAPTURED = (Representation.OCTAHEDRAL, Representation.BILLBOARD)
"""Rivals of the impostors: pictures of an asset's mesh, captured before; numbered without a gap, above all others."""

OF_MESH = (*MESHES, *CAPTURED)
"""What is made of an asset's mesh, by its number."""

SIMPLIFIED = (Representation.MESH_LOD, Representation.MESH_CLUSTERS, *CAPTURED)
"""What needs the simplified levels of meshes; clusters and captured views cast shadows by them."""

HEIGHT_FIELDS = (
    Representation.RELIEF,
    Representation.DISTANCE,
    Representation.PARALLAX,
    Representation.BUMP,
    Representation.DISPLACEMENT,
    Representation.RELIEF_TEXTURE,
)
"""Rivals of the warp, for assets of one planar depth image; numbered without a gap."""


@dataclass(kw_only=True)
class Objects(StructOfArrays):
    """Hold n placed objects: world point = position + scale · rotate(rotation, asset point).

    Attributes
    ----------
    asset : (n,) int32
        Index into `Scene.assets`.
    position : (n, 3) float32
        Metres, world: where the centre of the base of the asset's bounding box is.
    rotation : (n, 4) float32
        Unit quaternion (x, y, z, w), world from asset.
    scale : (n,) float32
        Size relative to the asset, > 0.
    representation : (n,) uint8
        How each is drawn: the number of a Representation.
    """

    asset: NDArray[np.int32]
    position: NDArray[np.float32]
    rotation: NDArray[np.float32]
    scale: NDArray[np.float32]
    representation: NDArray[np.uint8]

    def __len__(self) -> int:
        """Return how many objects there are."""
        return len(self.asset)

    @property
    def of_mesh(self) -> NDArray[np.bool_]:
        """Return which objects, (n,) bool, are drawn by what is made of their mesh, and cast shadows as that."""
        return np.asarray(np.logical_or.reduce([self.representation == kind for kind in OF_MESH]))


@dataclass(frozen=True)
class Camera:
    """Describe a pinhole camera in plain numbers, as scene files hold it.

    Attributes
    ----------
    position
        Where the camera stands, metres, world.
    target
        A point in the middle of the picture, metres, world.
    fov
        Vertical angle of view, radians.
    """

    position: tuple[float, float, float]
    target: tuple[float, float, float]
    fov: float

    @property
    def look(self) -> glm.dvec3:
        """Return the vector from the camera to its target, metres, world."""
        return glm.dvec3(*self.target) - glm.dvec3(*self.position)

    def moved(self, shift: glm.dvec3) -> "Camera":
        """Return the camera and its target moved by `shift`, metres, world."""
        (x, y, z), (to_x, to_y, to_z) = self.position, self.target
        position, target = (x + shift.x, y + shift.y, z + shift.z), (to_x + shift.x, to_y + shift.y, to_z + shift.z)
        return replace(self, position=position, target=target)
