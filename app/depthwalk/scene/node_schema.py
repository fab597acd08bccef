"""Declare what a scene file may say of its nodes: objects, rows, scattered ones, places from a file, and groups."""

from typing import Annotated, Literal

from pydantic import Field, Strict, Tag

from depthwalk.limits import MAX_COORDINATE, MAX_INSTANCES
from depthwalk.params import param
from depthwalk.scene.fields import KIND, Extent, FileParams, FilePath, Scale, ScaleRange, Vector, numbers, one_of_keys

_Count = Annotated[int, Field(ge=1, le=MAX_INSTANCES)]
GridCount = Annotated[tuple[_Count, _Count], Strict(False), numbers("nx", "nz")]
RepresentationName = Literal[
    "dpci",
    "mesh",
    "mesh-lod",
    "mesh-clusters",
    "dmesh",
    "relief",
    "distance",
    "parallax",
    "bump",
    "displacement",
    "relief-texture",
    "bar-texture",
    "octahedral",
    "billboard",
    "auto",
]

_LEFT_OUT = "if left out, auto for an asset with mesh and depth images, else the one that it has"


class PlacedParams(FileParams):
    """Hold the keys that every node of the scene graph has."""

    name: str | None = param(None, "Name, for programs that move the node")
    position: Vector = param((0.0, 0.0, 0.0), "Position in the parent; an object's base is centred on it", unit="m")
    yaw: float = param(0.0, "Rotation about +Y, counter-clockwise seen from above", unit="degrees", ge=-36000, le=36000)


class ObjectParams(PlacedParams):
    """Place one object."""

    asset: str = param(..., "Name of the asset")
    scale: Scale = param(1.0, "Size relative to the asset")
    representation: RepresentationName | None = param(None, f"How it is drawn; {_LEFT_OUT}")


class GridParams(PlacedParams):
    """Place objects of one asset in rows along x and z, centred on `position`; `yaw` turns the whole grid."""

    asset: str = param(..., "Name of the asset")
    count: GridCount = param(..., "Objects along x and z")
    spacing: Extent = param(..., "Distance between neighbours along x and z", unit="m")
    scale: Scale = param(1.0, "Size of each object relative to the asset")
    representation: RepresentationName | None = param(None, f"How they are drawn; {_LEFT_OUT}")


class ScatterParams(PlacedParams):
    """Place objects of one asset at random in a rectangle centred on `position`, each with a random yaw."""

    asset: str = param(..., "Name of the asset")
    count: _Count = param(..., "Number of objects")
    area: Extent = param(..., "Size of the rectangle along x and z", unit="m")
    seed: int = param(0, "Seed of the random numbers; the same seed gives the same positions", ge=0, le=2**32 - 1)
    spacing: float = param(0.0, "Smallest distance between two objects", unit="m", ge=0, le=MAX_COORDINATE)
    scale: ScaleRange = param(
        (1.0, 1.0), "Size of each object relative to the asset, or [low, high] to choose it from at random"
    )
    representation: RepresentationName | None = param(None, f"How they are drawn; {_LEFT_OUT}")


class PlacesParams(PlacedParams):
    """Place objects of one asset at positions that a file lists."""

    asset: str = param(..., "Name of the asset")
    file: FilePath = param(
        ..., "CSV with the columns x, y, z and optionally yaw, scale; or NPY of shape (n, 3 to 5) in that order"
    )
    scale: Scale = param(1.0, "Multiplies the sizes in the file")
    representation: RepresentationName | None = param(None, f"How they are drawn; {_LEFT_OUT}")


class GroupParams(PlacedParams):
    """Group nodes, which then move, turn and scale together."""

    scale: Scale = param(1.0, "Scales the objects of the group and the distances between them")
    objects: list["ItemParams"] = param(..., "Nodes of the group")


class GridItemParams(FileParams):
    """Hold an item of a list of nodes with the key `grid`, which places objects in rows."""

    grid: GridParams = param(..., "Objects in rows along x and z")


class ScatterItemParams(FileParams):
    """Hold an item of a list of nodes with the key `scatter`, which places objects at random."""

    scatter: ScatterParams = param(..., "Objects at random positions")


class PlacesItemParams(FileParams):
    """Hold an item of a list of nodes with the key `places`, which reads positions from a file."""

    places: PlacesParams = param(..., "Objects at positions that a file lists")


class GroupItemParams(FileParams):
    """Hold an item of a list of nodes with the key `group`, which moves several nodes together."""

    group: GroupParams = param(..., "Nodes that move, turn and scale together")


ItemParams = Annotated[
    Annotated[ObjectParams, Tag(KIND + "asset")]
    | Annotated[GridItemParams, Tag(KIND + "grid")]
    | Annotated[GroupItemParams, Tag(KIND + "group")]
    | Annotated[PlacesItemParams, Tag(KIND + "places")]
    | Annotated[ScatterItemParams, Tag(KIND + "scatter")],
    one_of_keys("asset", "grid", "group", "places", "scatter"),
]
