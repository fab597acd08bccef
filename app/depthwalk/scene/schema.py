"""The scene file, version 1: what may stand in it, with defaults, units and ranges. Degrees, metres, sRGB."""

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Discriminator, Field, Strict, Tag, WithJsonSchema, model_validator

from depthwalk.limits import (
    MAX_ASSETS,
    MAX_COORDINATE,
    MAX_DPCI_LAYERS,
    MAX_DPCI_PARTS,
    MAX_DPCI_RESOLUTION,
    MAX_INSTANCES,
    MIN_DPCI_RESOLUTION,
)
from depthwalk.params import param
from depthwalk.scene.environment import CameraParams, Environment, WalkParams
from depthwalk.scene.fields import (
    Coordinate,
    Extent,
    FileParams,
    FilePath,
    ImageSize,
    Length,
    Scale,
    ScaleRange,
    Vector,
    Version,
    numbers,
)
from depthwalk.scene.render_settings import RenderSettings
from depthwalk.scene.validate import KIND, shown

_Count = Annotated[int, Field(ge=1, le=MAX_INSTANCES)]
Focal = Annotated[float, Field(ge=1, le=MAX_COORDINATE)]
GridCount = Annotated[tuple[_Count, _Count], Strict(False), numbers("nx", "nz")]
RepresentationName = Literal["dpci", "mesh", "mesh-lod", "dmesh"]
BakeMethod = Literal["raycast", "six-view"]


def _auto_or_up_to(most: int) -> BeforeValidator:
    def check(value: Any) -> Any:
        if value != "auto" and not (type(value) is int and 1 <= value <= most):
            raise ValueError(f"must be auto or a whole number from 1 to {most}, not {shown(value)}")
        return value

    return BeforeValidator(check)


def _auto_or_up_to_schema(most: int) -> WithJsonSchema:
    return WithJsonSchema({"anyOf": [{"const": "auto"}, {"type": "integer", "minimum": 1, "maximum": most}]})


def _axis(value: Any) -> Any:
    if value not in ("auto", "x", "y", "z") and not (
        isinstance(value, list | tuple)
        and len(value) == 3
        and all(type(part) in (int, float) and abs(part) <= MAX_COORDINATE for part in value)
        and any(value)
    ):
        raise ValueError(f"must be auto, x, y, z or a direction [x, y, z], not {shown(value)}")
    return value


CountOrAuto = int | Literal["auto"]
Layers = Annotated[CountOrAuto, _auto_or_up_to(MAX_DPCI_LAYERS), _auto_or_up_to_schema(MAX_DPCI_LAYERS)]
Parts = Annotated[CountOrAuto, _auto_or_up_to(MAX_DPCI_PARTS), _auto_or_up_to_schema(MAX_DPCI_PARTS)]
AxisName = Literal["auto", "x", "y", "z"]
Axis = Annotated[AxisName | Vector, BeforeValidator(_axis)]


class MesoParams(FileParams):
    """Meso-structure: a relief that is repeated all over an object, with true silhouettes."""

    depth: FilePath = param(..., "Seamless depth image, white on the surface, black `height` below it")
    normal: FilePath | None = param(None, "Normal map of the relief; absent derives it from the depth")
    height: Length = param(..., "Depth between white and black", unit="m")
    tile: ImageSize = param(..., "Width and height of one repetition, the width measured on the cylinder", unit="m")


class DpciParams(FileParams):
    """How an asset is baked to depth images."""

    resolution: int = param(
        512, "Width and height of the side image", unit="texels", ge=MIN_DPCI_RESOLUTION, le=MAX_DPCI_RESOLUTION
    )
    layers: Layers = param(
        3, "Depth layers peeled along each ray; 1 with six-view; auto: as many as hold what can be seen"
    )
    method: BakeMethod = param("raycast", "How surfaces are sampled: by rays, or by six views warped on the GPU")
    parts: Parts = param(1, "Objects that share the mesh, at most; auto: as many as it takes to sample it well")
    axis: Axis = param("y", "Of the cylinder, or of each part's: x, y, z, [x, y, z], or auto: what samples it best")
    meso: MesoParams | None = param(None, "Relief laid over the depth images when they are drawn; changes no bake")

    @model_validator(mode="before")
    @classmethod
    def _one_layer_of_six_views(cls, value: Any) -> Any:
        if not isinstance(value, dict) or value.get("method") != "six-view":
            return value
        if value.get("layers", 1) != 1:
            raise ValueError("method six-view sees one surface per ray: layers must be 1")
        return {"layers": 1} | value


class MeshAssetParams(FileParams):
    """An asset read from a mesh file."""

    mesh: FilePath = param(..., "OBJ, PLY, STL, GLB or glTF file, relative to the scene file")
    texture: FilePath | None = param(None, "Colour image, where the mesh file names none")
    up: Literal["y", "z"] = param("y", "The file's upward axis")
    height: Length | None = param(None, "Height the asset is scaled to; absent keeps the file's size", unit="m")
    dpci: DpciParams | None = param(None, "Depth images to bake; absent draws the mesh itself")


class IntrinsicsParams(FileParams):
    """The pinhole camera that took a range image, without distortion; 0, 0 is the centre of the top left pixel."""

    fx: Focal = param(..., "Horizontal focal length", unit="pixels")
    fy: Focal = param(..., "Vertical focal length", unit="pixels")
    cx: Coordinate = param(..., "Column of the optical axis", unit="pixels")
    cy: Coordinate = param(..., "Row of the optical axis, from the top", unit="pixels")


class DepthImageParams(FileParams):
    """An upright picture with a depth per pixel: a relief with `size`, or a range image with `intrinsics`."""

    depth: FilePath = param(..., "PNG, TIFF, EXR (channel Z) or NPY; whole numbers need `unit` or `range`")
    colour: FilePath | None = param(None, "Colour image; absent is light grey")
    normal: FilePath | None = param(None, "Normal map; absent derives normals from the depth")
    size: ImageSize | None = param(None, "Width and height of a relief", unit="m")
    intrinsics: IntrinsicsParams | None = param(None, "Camera of a range image, whose depth is along its axis")
    range: Length | None = param(None, "Depth of black in a relief, white being in front", unit="m")
    unit: Length | None = param(None, "Metres per count, 0 is empty; absent: floats are metres", unit="m")

    @model_validator(mode="after")
    def _one_of_each(self) -> Self:
        if (self.size is None) == (self.intrinsics is None):
            raise ValueError("needs exactly one of 'size', 'intrinsics'")
        if self.range is not None and (self.unit is not None or self.intrinsics is not None):
            raise ValueError(f"'range' and '{'unit' if self.unit is not None else 'intrinsics'}' exclude each other")
        return self


class DepthImageAssetParams(FileParams):
    """An asset read from a depth image or a range image."""

    depth_image: DepthImageParams = param(..., "A relief or a range image: colour with a depth per pixel")


def _kind(*keys: str) -> Discriminator:
    """Decide a union's branch by the one key that only this branch has."""

    def present(value: Any) -> str | None:
        found = [key for key in keys if isinstance(value, dict) and key in value]
        return KIND + found[0] if len(found) == 1 else None

    message = f"needs exactly one of {', '.join(map(repr, keys))}"
    return Discriminator(present, custom_error_type="no_kind", custom_error_message=message)


AssetParams = Annotated[
    Annotated[MeshAssetParams, Tag(KIND + "mesh")] | Annotated[DepthImageAssetParams, Tag(KIND + "depth_image")],
    _kind("mesh", "depth_image"),
]


class PlacedParams(FileParams):
    """What every node of the scene graph has."""

    name: str | None = param(None, "Name of the node")
    position: Vector = param((0.0, 0.0, 0.0), "Place in the parent; for an object, the centre of its base", unit="m")
    yaw: float = param(0.0, "Turn about +Y, counter-clockwise seen from above", unit="degrees", ge=-36000, le=36000)


class ObjectParams(PlacedParams):
    """One placed object."""

    asset: str = param(..., "Name of the asset")
    scale: Scale = param(1.0, "Size relative to the asset")
    representation: RepresentationName | None = param(None, "How it is drawn; absent: dpci where the asset has it")


class GridParams(PlacedParams):
    """Objects of one asset in rows along x and z, centred on `position`; `yaw` turns the whole grid."""

    asset: str = param(..., "Name of the asset")
    count: GridCount = param(..., "Objects along x and z")
    spacing: Extent = param(..., "Distance between neighbours along x and z", unit="m")
    scale: Scale = param(1.0, "Size of each object relative to the asset")
    representation: RepresentationName | None = param(None, "How they are drawn; absent: dpci where the asset has it")


class ScatterParams(PlacedParams):
    """Objects of one asset strewn at random over a rectangle centred on `position`, each with a random yaw."""

    asset: str = param(..., "Name of the asset")
    count: _Count = param(..., "Number of objects")
    area: Extent = param(..., "Sides of the rectangle along x and z", unit="m")
    seed: int = param(0, "The same seed gives the same places", ge=0, le=2**32 - 1)
    spacing: float = param(0.0, "Least distance between two objects", unit="m", ge=0, le=MAX_COORDINATE)
    scale: ScaleRange = param((1.0, 1.0), "Size of each object, or [low, high] to draw it from")
    representation: RepresentationName | None = param(None, "How they are drawn; absent: dpci where the asset has it")


class PlacesParams(PlacedParams):
    """Objects of one asset where a file says."""

    asset: str = param(..., "Name of the asset")
    file: FilePath = param(..., "CSV with the columns x, y, z and, if wanted, yaw, scale; or NPY of those, (n, 3 to 5)")
    scale: Scale = param(1.0, "Size of each object relative to the asset, beside the file's")
    representation: RepresentationName | None = param(None, "How they are drawn; absent: dpci where the asset has it")


class GroupParams(PlacedParams):
    """Nodes that share a transform."""

    scale: Scale = param(1.0, "Scales everything in the group, distances included")
    objects: list["ItemParams"] = param(..., "The nodes of the group")


class GridItemParams(FileParams):
    """A grid of objects."""

    grid: GridParams = param(..., "Objects in rows along x and z")


class ScatterItemParams(FileParams):
    """Objects at random places."""

    scatter: ScatterParams = param(..., "Objects at random places")


class PlacesItemParams(FileParams):
    """Objects from a file of places."""

    places: PlacesParams = param(..., "Objects where a file says")


class GroupItemParams(FileParams):
    """A group of nodes."""

    group: GroupParams = param(..., "Nodes that share a transform")


ItemParams = Annotated[
    Annotated[ObjectParams, Tag(KIND + "asset")]
    | Annotated[GridItemParams, Tag(KIND + "grid")]
    | Annotated[GroupItemParams, Tag(KIND + "group")]
    | Annotated[PlacesItemParams, Tag(KIND + "places")]
    | Annotated[ScatterItemParams, Tag(KIND + "scatter")],
    _kind("asset", "grid", "group", "places", "scatter"),
]


class SceneFile(FileParams):
    """A scene file as it is written."""

    version: Version = param(..., "Version of the format")
    assets: Annotated[dict[str, AssetParams], Field(max_length=MAX_ASSETS)] = Field({}, description="Models by name")
    objects: list[ItemParams] = Field([], description="The nodes of the scene graph")
    environment: Environment = Field(default_factory=Environment, description="Sky, ground and lights")
    camera: CameraParams | None = param(None, "First view; absent frames the objects")
    walk: WalkParams = Field(default_factory=WalkParams, description="How the window's viewer moves")
    render: RenderSettings = Field(default_factory=RenderSettings, description="How the picture is made")
