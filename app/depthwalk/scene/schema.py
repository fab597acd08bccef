"""Declare the scene file, version 1: its keys, with defaults, units, ranges and help.

Angles are degrees, lengths metres, colours sRGB, as in the file. pydantic checks files against these classes, and the
JSON schema for editors and docs/scene-file.md are generated from them. The rest is declared in `environment` and
`render_settings`.
"""

from typing import Annotated, Any, Literal, Self

from pydantic import Field, Tag, model_validator

from depthwalk.limits import (
    DEFAULT_DPCI_LAYERS,
    DEFAULT_DPCI_RESOLUTION,
    MAX_ASSETS,
    MAX_COORDINATE,
    MAX_DPCI_RESOLUTION,
    MAX_KEYFRAMES,
    MIN_DPCI_RESOLUTION,
)
from depthwalk.params import param
from depthwalk.scene.environment import CameraParams, Environment, WalkParams
from depthwalk.scene.fields import (
    KIND,
    Axis,
    Coordinate,
    Count,
    Extent,
    FileParams,
    FilePath,
    FocalLength,
    GridCount,
    ImageSize,
    Layers,
    Length,
    Parts,
    Scale,
    ScaleRange,
    Vector,
    Version,
    one_of_keys,
)
from depthwalk.scene.render_settings import RenderSettings

BakeMethod = Literal["raycast", "six-view", "paper"]
Coordinates = Literal["auto", "never"]


class MesoParams(FileParams):
    """Describe meso-structure: a small relief repeated all over an object, which changes its silhouette too."""

    depth: FilePath = param(..., "Seamless depth image: white is on the surface, black `height` below it")
    normal: FilePath | None = param(None, "Normal map of the relief; if left out, computed from the depth")
    height: Length = param(..., "Depth between white and black", unit="m")
    tile: ImageSize = param(
        ..., "Width and height of one repetition, the width measured along the cylinder's circumference", unit="m"
    )


class DpciParams(FileParams):
    """Set how an asset is baked to depth images on a cylinder: one around its side, one each for top and bottom."""

    resolution: int = param(
        DEFAULT_DPCI_RESOLUTION,
        "Width and height of the depth image of the side",
        unit="texels",
        ge=MIN_DPCI_RESOLUTION,
        le=MAX_DPCI_RESOLUTION,
    )
    layers: Layers = param(
        DEFAULT_DPCI_LAYERS,
        "Depth layers: surfaces kept along each ray, from the outside inward; auto: as many as show something visible; "
        "six-view and paper allow only 1",
    )
    method: BakeMethod = param(
        "raycast",
        "How surfaces are sampled: by ray casting, or from six orthographic views drawn on the GPU (six-view); paper: "
        "six-view without cut triangles, further layers, or faces other than side, top and bottom, as published",
    )
    parts: Parts = param(
        1,
        "Most parts the mesh may be divided into, each with depth images of its own; auto: as many as sample it well",
    )
    axis: Axis = param(
        "y",
        "Axis of the cylinder, or of each part's: x, y, z, a direction [x, y, z], or auto: the one that samples best",
    )
    coordinates: Coordinates = param(
        "auto",
        "Texture coordinates in each texel, so that a textured mesh is as sharp as its texture; auto: if the texture "
        "is finer than the depth images; never: only a colour in each texel, which takes less memory",
    )
    meso: MesoParams | None = param(None, "Relief added when the depth images are drawn; needs no re-bake")

    @model_validator(mode="before")
    @classmethod
    def _one_layer_of_six_views(cls, value: Any) -> Any:
        method = value.get("method") if isinstance(value, dict) else None
        if method not in ("six-view", "paper"):
            return value
        if value.get("layers", 1) != 1:
            raise ValueError(f"method {method} sees one surface per ray: layers must be 1")
        return {"layers": 1} | value


class MeshAssetParams(FileParams):
    """Describe an asset that is read from a mesh file."""

    mesh: FilePath = param(
        ...,
        "OBJ, PLY, STL, OFF, GLB, glTF, FBX, DAE, 3DS, 3MF, USD, LAS or LAZ file, a path relative to the scene file",
    )
    texture: FilePath | None = param(None, "Colour image that replaces the textures of the mesh file")
    up: Literal["y", "z"] = param("y", "Axis of the file that points upward")
    height: Length | None = param(None, "Height to which the asset is scaled; if left out, as in the file", unit="m")
    dpci: DpciParams | None = param(None, "Depth images to bake; if left out, the mesh itself is drawn")


class BakedAssetParams(FileParams):
    """Describe an asset whose depth images are a file, so that no mesh is read, baked or cooked to show it."""

    baked: FilePath = param(..., "Depth images made by `depthwalk bake`: .dpci.npz (cooked) or .dpci.exr")
    mesh: FilePath | None = param(
        None, "Mesh that the depth images were made from; if the file is missing, no mesh is drawn"
    )
    texture: FilePath | None = param(None, "Colour image that replaces the textures of the mesh file")
    up: Literal["y", "z"] = param("y", "Axis of the mesh file that points upward")
    height: Length | None = param(None, "Height to which the mesh is scaled; if left out, as in the file", unit="m")


class IntrinsicsParams(FileParams):
    """Describe the pinhole camera of a range image, without distortion; (0, 0) is the centre of the top left pixel."""

    fx: FocalLength = param(..., "Horizontal focal length", unit="pixels")
    fy: FocalLength = param(..., "Vertical focal length", unit="pixels")
    cx: Coordinate = param(..., "Column of the principal point", unit="pixels")
    cy: Coordinate = param(..., "Row of the principal point, from the top", unit="pixels")


class PanoramaParams(FileParams):
    """Describe a cylindrical panorama: an upright full turn with square pixels, seen from one point."""

    horizon: Coordinate | None = param(
        None, "Row of the horizon, from the centre of the top row; if left out, the picture's middle", unit="pixels"
    )


class DepthImageParams(FileParams):
    """Describe a picture with a depth per pixel: a relief (`size`), a range image (`intrinsics`) or a `panorama`."""

    depth: FilePath = param(..., "Depths: PNG, TIFF, EXR (channel Z) or NPY; whole numbers need `unit` or `range`")
    colour: FilePath | None = param(None, "Colour image; if left out, light grey")
    normal: FilePath | None = param(None, "Normal map; if left out, computed from the depth")
    size: ImageSize | None = param(None, "Width and height of a relief", unit="m")
    intrinsics: IntrinsicsParams | None = param(
        None, "Camera that took a range image; depth is measured along its axis"
    )
    panorama: PanoramaParams | None = param(
        None,
        "Marks the picture as a cylindrical panorama; {} if there is nothing else to set. Depth is the horizontal "
        "distance from the viewpoint, which is above the object's position",
    )
    range: Length | None = param(None, "Depth between white, in front, and black, of a relief", unit="m")
    unit: Length | None = param(
        None, "Metres per unit of the file, in which 0 means no surface; if left out, floats are metres", unit="m"
    )
    method: Literal["cut", "paper"] = param(
        "cut",
        "How pixels of a relief or a panorama become a surface: neighbours are separated at jumps in depth (cut), or "
        "all are connected, by rubber sheets across the jumps, as published (paper)",
    )

    @model_validator(mode="after")
    def _one_of_each(self) -> Self:
        kinds = {"size": self.size, "intrinsics": self.intrinsics, "panorama": self.panorama}
        given = [name for name, value in kinds.items() if value is not None]
        if len(given) != 1:
            raise ValueError(f"needs exactly one of {', '.join(map(repr, kinds))}")
        if self.range is not None and (self.unit is not None or given != ["size"]):
            other = "unit" if self.unit is not None else given[0]
            raise ValueError(f"needs 'range' or {other!r}, not both")
        if self.normal is not None and self.panorama is not None:
            raise ValueError("needs 'normal' or 'panorama', not both: normals of a panorama are computed")
        if self.method != "cut" and self.intrinsics is not None:
            raise ValueError(
                f"method {self.method} is for reliefs and panoramas; a range image with 'intrinsics' is always cut"
            )
        return self


class DepthImageAssetParams(FileParams):
    """Describe an asset that is read from a depth image, a range image or a panorama."""

    depth_image: DepthImageParams = param(..., "A relief, a range image or a panorama: colour with a depth per pixel")


AssetParams = Annotated[
    Annotated[MeshAssetParams, Tag(KIND + "mesh")]
    | Annotated[DepthImageAssetParams, Tag(KIND + "depth_image")]
    | Annotated[BakedAssetParams, Tag(KIND + "baked")],
    one_of_keys("mesh", "baked", "depth_image", first="baked"),
]


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


_OWN = "if left out, the node's own"
MAX_ANGLE = 36000  # degrees, a hundred turns


class AnimationKeyParams(FileParams):
    """Describe the placement of a node at one moment; what is left out is as the node itself says."""

    time: float = param(..., "Time of the keyframe", unit="s", ge=0, le=1e6)
    position: Vector | None = param(None, f"Position in the parent; {_OWN}", unit="m")
    yaw: float | None = param(
        None, f"Rotation about +Y; {_OWN}. 360 after 0 is a whole turn", unit="degrees", ge=-MAX_ANGLE, le=MAX_ANGLE
    )
    pitch: float | None = param(None, f"Rotation about +X; {_OWN}", unit="degrees", ge=-MAX_ANGLE, le=MAX_ANGLE)
    roll: float | None = param(None, f"Rotation about +Z; {_OWN}", unit="degrees", ge=-MAX_ANGLE, le=MAX_ANGLE)
    scale: Scale | None = param(None, f"Size of an object or a group; {_OWN}")


class AnimationParams(FileParams):
    """Describe how a node moves over time, together with everything below it."""

    keyframes: Annotated[list[AnimationKeyParams], Field(min_length=2, max_length=MAX_KEYFRAMES)] = param(
        ..., "Placements at different times, in order; before the first, the node stays there"
    )
    interpolation: Literal["smooth", "linear", "step"] = param(
        "smooth",
        "Between keyframes: along a smooth curve, at constant speed, or not at all until the next. Angles are "
        "interpolated one by one",
    )
    repeat: Literal["loop", "ping-pong", "once"] = param(
        "loop", "After the last keyframe: from the beginning again, back and forth, or stay there"
    )
    start: float = param(
        0.0, "Moment at which it begins; negative: it has been going on for so long", unit="s", ge=-1e6, le=1e6
    )


class PlacedParams(FileParams):
    """Hold the keys that every node of the scene graph has."""

    name: str | None = param(None, "Name, for programs that move the node")
    position: Vector = param(
        (0.0, 0.0, 0.0),
        "Position in the parent: where the centre of an object's base goes, about which it turns",
        unit="m",
    )
    yaw: float = param(
        0.0, "Rotation about +Y, counter-clockwise seen from above", unit="degrees", ge=-MAX_ANGLE, le=MAX_ANGLE
    )
    pitch: float = param(
        0.0,
        "Rotation about +X, counter-clockwise seen from its tip, before that by `yaw`; 90: the top points towards +Z",
        unit="degrees",
        ge=-MAX_ANGLE,
        le=MAX_ANGLE,
    )
    roll: float = param(
        0.0,
        "Rotation about +Z, counter-clockwise seen from its tip, before that by `pitch`; 90: the top points towards "
        "−X, 180: upside down",
        unit="degrees",
        ge=-MAX_ANGLE,
        le=MAX_ANGLE,
    )
    animation: AnimationParams | None = param(None, "How the node moves over time, with everything below it")


class ObjectParams(PlacedParams):
    """Place one object."""

    asset: str = param(..., "Name of the asset")
    scale: Scale = param(1.0, "Size relative to the asset")
    representation: RepresentationName | None = param(None, f"How it is drawn; {_LEFT_OUT}")


class GridParams(PlacedParams):
    """Place objects of one asset in rows along x and z, centred on `position`; its angles turn the whole grid."""

    asset: str = param(..., "Name of the asset")
    count: GridCount = param(..., "Objects along x and z")
    spacing: Extent = param(..., "Distance between neighbours along x and z", unit="m")
    scale: Scale = param(1.0, "Size of each object relative to the asset")
    representation: RepresentationName | None = param(None, f"How they are drawn; {_LEFT_OUT}")


class ScatterParams(PlacedParams):
    """Place objects of one asset at random in a rectangle centred on `position`, each with a random yaw."""

    asset: str = param(..., "Name of the asset")
    count: Count = param(..., "Number of objects")
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
        ...,
        "CSV with the columns x, y, z and optionally yaw, scale, pitch, roll; or NPY of shape (n, 3 to 7) in that "
        "order",
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


class SceneFile(FileParams):
    """Describe a scene file as it is written."""

    version: Version = param(..., "Version of the file format")
    assets: Annotated[dict[str, AssetParams], Field(max_length=MAX_ASSETS)] = Field({}, description="Models, by name")
    objects: list[ItemParams] = Field(
        [], description="Nodes of the scene graph: objects, groups and other sets of objects"
    )
    environment: Environment = Field(default_factory=Environment, description="Sky, ground and lights")
    camera: CameraParams | None = param(None, "Camera at the start; if left out, one that shows all objects")
    walk: WalkParams = Field(default_factory=WalkParams, description="Walking in the window")
    advice: FilePath | None = param(None, "File written by `depthwalk advise`, which `representation: auto` follows")
    render: RenderSettings = Field(default_factory=RenderSettings, description="Render settings")
