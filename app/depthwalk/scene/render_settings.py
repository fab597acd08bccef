"""The render settings, typed: `render:` of the scene file. They know nothing of OpenGL, so that a scene is read without it."""

import re
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema

from depthwalk.params import Params, param


class MeshLodParams(Params):
    """How coarse meshes may be."""

    error: float = param(
        1.0,
        "How far the surface of a simplified mesh (mesh-lod) may be off, seen from where its bounds are nearest",
        unit="pixels",
        ge=0,
        le=1000,
    )


class MeshParams(MeshLodParams):
    wireframe: bool = param(False, "Draw triangles as lines")


class FxaaParams(Params):
    contrast: float = param(0.125, "Part of the brightness around by which it must differ to be an edge", ge=0, le=1)


class CompositeParams(Params):
    parallax: int = param(
        1,
        "Steps by which the surface is sought along the rays of a viewer who moved since the warp; 0: flat",
        ge=0,
        le=8,
    )
    show_tiles: bool = param(False, "Paint each intermediate image in a colour of its own")


class GpaaParams(Params):
    samples: int = param(
        2, "Samples per pixel, along either axis: where leaves share pixels, lines do not help", ge=1, le=2
    )
    crease: float = param(
        30.0, "Fold from which an edge between two visible faces is smoothed too", unit="degrees", ge=0, le=180
    )


class TileParams(Params):
    """Layout of the intermediate images, and how long they are kept."""

    tiles: Literal["screen", "plane"] = param("screen", "Texels: the screen's pixels, or squares on the plane (paper)")
    tile_scale: float = param(1.0, "Texels of an intermediate image per pixel of the screen", ge=0.1, le=4)
    cluster_pixels: float = param(
        16.0,
        "Far neighbours that are smaller than this share an intermediate image; 0: never",
        unit="pixels",
        ge=0,
        le=256,
    )
    reuse_error: float = param(
        1.0,
        "Where somebody walks, intermediate images are kept while no point is farther off than this; 0: never kept",
        unit="pixels",
        ge=0,
        le=16,
    )
    budget: int = param(
        200_000,
        "What is warped anew in a frame; images past reuse_error wait, up to four times that error",
        unit="triangles",
        ge=0,
    )


class WarpParams(TileParams):
    order: Literal["depth", "epipole"] = param(
        "depth",
        "What decides which sample of an image is in front: the depth buffer, or the order of drawing (paper; a draw "
        "call per object)",
    )
    wireframe: bool = param(False, "Draw the warped grids as lines")


class LightParams(Params):
    mode: Literal["deferred", "forward"] = param(
        "deferred",
        "Where depth images are lit: with everything else, or as in the paper where they are shaded, in their own "
        "space, by sun and ambient light alone",
    )


class LodParams(Params):
    """Which resolution and which depth images an object is warped with."""

    mode: Literal["error", "paper"] = param(
        "error", "What chooses the geometry: how far it is off, or the distance as in the paper (Iter_step)"
    )
    error: float = param(
        0.5, "How far geometry may be off, seen from where its bounds are nearest", unit="pixels", ge=0, le=100
    )
    bias: float = param(
        0.0,
        "Added to the level of detail: +1 doubles the error, or halves the grid's resolution",
        unit="levels",
        ge=-4,
        le=8,
    )
    max_step: int = param(64, "Coarsest Iter_step, where that chooses", unit="texels", ge=1, le=64)
    triangles_per_pixel: float = param(
        8.0, "Grids are coarsened until they have no more triangles than this per pixel of their object", ge=0.1, le=1e6
    )
    magnification: float = param(
        1.0,
        "Objects that are so near that a texel may cover more than this are drawn as their meshes, into shadow maps as "
        "well; 0: never",
        unit="pixels",
        ge=0,
        le=1e6,
    )
    freeze: bool = param(False, "Keep the steps and cases of the moment it was switched on")
    meso_fade: float = param(
        1.0, "Meso-structure whose height covers fewer pixels is shading only", unit="pixels", ge=0, le=1000
    )
    cases: Literal["complete", "paper"] = param(
        "complete",
        "What is left out: the top, the bottom and parts of the side of which a viewer sees nothing (complete), or the "
        "top and the bottom by the viewer's height alone (paper)",
    )


class SmaaParams(Params):
    contrast: float = param(0.05, "Difference of perceived brightness that makes an edge", ge=0, le=1)
    longest: int = param(32, "How far an edge is followed either way", unit="pixels", ge=1, le=256)


NEAREST_FOCUS, FARTHEST_FOCUS = 0.5, 10000.0  # metres; the former is beyond any focal length


class DofParams(Params):
    """A thin lens, behind which the sensor is as high as the camera's angle of view asks."""

    mode: Literal["none", "paper", "gather", "accumulate"] = param(
        "none",
        "Depth of field: blurred pictures and 13 taps (paper), rays through the depth buffer (gather), a frame from "
        "each point of the lens (accumulate)",
    )
    focal_length: float = param(
        50.0, "Focal length; over the f-number, the diameter of the lens", unit="mm", ge=1, le=400
    )
    f_number: float = param(2.8, "Focal length over the diameter of the lens", ge=0.5, le=64)
    focus_distance: float = param(
        5.0, "Where it is sharp, along the view axis", unit="m", ge=NEAREST_FOCUS, le=FARTHEST_FOCUS
    )
    samples: int = param(64, "Points on the lens: frames of accumulate, most rays of a pixel of gather", ge=1, le=1024)
    largest: float = param(
        8.0,
        "Largest circle of confusion, its diameter, of paper and gather",
        unit="% of the picture's height",
        ge=0.5,
        le=25,
    )
    autofocus: bool = param(False, "In the window: keep sharp what is in its middle")


class OutputParams(Params):
    tone: Literal["none", "reinhard", "aces", "agx"] = param(
        "none", "How light of any strength becomes what a screen shows: cut off at white, or by a curve"
    )
    exposure: float = param(0.0, "Light is doubled so many times before that", unit="EV", ge=-16, le=16)


MAX_SHADOW_LAMPS = 16  # with a map at a time

WORST_ERROR = 4.0  # times the error that is asked for: so far is taken to be off what has no more triangles than it may

MAX_CASCADES = 4  # cascades


class ShadowParams(Params):
    """Shadows that the sun casts, and lamps with `shadow: true`."""

    enabled: bool = param(False, "Objects cast shadows of the sun on each other and on the ground")
    cascades: int = param(3, "Shadow maps, each for a part of the distance", ge=1, le=MAX_CASCADES)
    resolution: int = param(1024, "Width and height of a shadow map", unit="texels", ge=64, le=8192)
    distance: float = param(80.0, "How far from the viewer there are shadows", unit="m", ge=0.01, le=1e6)
    split: float = param(
        0.75, "Where cascades end: 0, at even distances; 1, each as many times as far as the one before", ge=0, le=1
    )
    filter_width: int = param(3, "How wide edges of shadows are smoothed", unit="texels", ge=2, le=8)
    error: float = param(
        0.125,
        "How far the geometry that casts them may be off, where that does not take too many triangles",
        unit="texels",
        ge=0,
        le=100,
    )
    triangles_per_texel: float = param(
        10.0,
        "Grids are coarsened until they have no more triangles than this per texel of their object, a quarter in each "
        "map after the first",
        ge=0.01,
        le=1e6,
    )
    lamps: int = param(8, "Shadow maps of lamps, the brightest in sight first", ge=0, le=MAX_SHADOW_LAMPS)
    lamp_resolution: int = param(512, "Width and height of a lamp's shadow map", unit="texels", ge=64, le=4096)

    @property
    def worst_error(self) -> float:
        """Texels by which geometry is taken to be off, as all that `error` asks for may be too many triangles."""
        return WORST_ERROR * self.error


DEFAULT_BUDGET = 2 << 30  # bytes: with pictures and atlas at 4K, half of what cards have at least


class PictureParams(Params):
    """What concerns the picture as a whole."""

    aa: Literal["none", "coverage", "msaa", "fxaa", "smaa", "gpaa", "gpaa-edge", "ssaa"] = param(
        "none",
        "Anti-aliasing: by what of a pixel depth images cover, by the hardware's four samples per pixel (MSAA), by "
        "edges of brightness (FXAA, SMAA), by all edges of polygons or those alone that may be outlines (GPAA, with "
        "coverage), by twice the width and height (SSAA)",
    )


class CullingParams(Params):
    """What is not drawn."""

    min_pixels: float = param(
        0.5, "Objects are left out whose bounding sphere is smaller across than this", unit="pixels", ge=0, le=64
    )
    occlusion: bool = param(True, "Objects hidden behind others are left out")


_UNITS = {"B": 1} | {
    prefix + "B": 1000**power for power, prefix in enumerate("kMGT", 1)
} | {prefix + "iB": 1024**power for power, prefix in enumerate("KMGT", 1)}  # fmt: skip


def _bytes(value: Any) -> Any:
    """A number of bytes, or text such as `2 GiB`, as a number."""
    found = re.fullmatch(r"([0-9]+(?:\.[0-9]+)?) ?([A-Za-z]+)", value) if isinstance(value, str) else None
    if found and found[2] in _UNITS:
        return int(float(found[1]) * _UNITS[found[2]])
    if type(value) is not int:
        raise ValueError(f"must be a size such as 2 GiB or 500 MB, or a number of bytes, not {value!r:.40}")
    return value


Bytes = Annotated[
    int,
    BeforeValidator(_bytes),
    Field(ge=0, le=1 << 44),
    WithJsonSchema({"anyOf": [{"type": "string"}, {"type": "integer", "minimum": 0, "maximum": 1 << 44}]}),
]


class RenderSettings(PictureParams):
    """Everything that changes the picture but not the scene: `render:` of the scene file.

    Besides what concerns the picture as a whole, it has a group for the level of detail, for culling, and for each pass
    that has parameters, by the name of the pass. The panel's sections and `--set render.…` follow it.
    """

    lod: LodParams = Field(default_factory=LodParams)
    culling: CullingParams = Field(default_factory=CullingParams)
    warp: WarpParams = Field(default_factory=WarpParams)
    composite: CompositeParams = Field(default_factory=CompositeParams)
    mesh: MeshParams = Field(default_factory=MeshParams)
    shadows: ShadowParams = Field(default_factory=ShadowParams)
    light: LightParams = Field(default_factory=LightParams)
    gpaa: GpaaParams = Field(default_factory=GpaaParams)
    fxaa: FxaaParams = Field(default_factory=FxaaParams)
    smaa: SmaaParams = Field(default_factory=SmaaParams)
    dof: DofParams = Field(default_factory=DofParams)
    output: OutputParams = Field(default_factory=OutputParams)
    gpu_memory: Bytes = param(
        DEFAULT_BUDGET, "GPU memory for depth images, `2 GiB` or bytes; those not seen for longest make room"
    )
