"""Declare the render settings: what may stand under `render:` in a scene file, with defaults, units, ranges and help.

They are typed, and import neither OpenGL nor the renderer, so that a scene can be read and checked without a GPU. The
panel of the window, `--set render.…` and docs/parameters.md are made from the same declarations.
"""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema, model_validator

from depthwalk.limits import size_in_bytes
from depthwalk.params import Params, param
from depthwalk.scene.effect_settings import (
    DofParams,
    FxaaParams,
    GpaaParams,
    InspectionParams,
    LightParams,
    OutputParams,
    ShadowParams,
    SmaaParams,
)
from depthwalk.scene.object_settings import CompositeParams, CullingParams, LodParams, MeshParams, WarpParams
from depthwalk.scene.rival_settings import (
    BillboardParams,
    DistanceParams,
    OctahedralParams,
    ParallaxParams,
    ReliefParams,
)

DEFAULT_BUDGET = 2 << 30  # bytes: with pictures and atlas at 4K, half of what cards have at least


class PictureParams(Params):
    """Set what concerns the picture as a whole."""

    aa: Literal["none", "coverage", "msaa", "fxaa", "smaa", "gpaa", "gpaa-edge", "ssaa"] = param(
        "none",
        "Anti-aliasing: none; by the part of a pixel that depth images cover (coverage); by four samples per pixel in "
        "hardware (msaa); along edges of brightness (fxaa, smaa); along all edges of polygons (gpaa) or their "
        "outlines only (gpaa-edge), both with coverage; by drawing at twice the width and height (ssaa), which "
        "`depthwalk render` does where nothing is said here, but for EXR files",
    )


def _bytes(value: Any) -> Any:
    """Return a number of bytes, given as such or as text such as `2 GiB`."""
    if isinstance(value, str) and (found := size_in_bytes(value)) is not None:
        return found
    if type(value) is not int:
        raise ValueError(f"must be a size such as 2 GiB or 500 MB, or a number of bytes, not {value!r:.40}")
    return value


Bytes = Annotated[
    int,
    BeforeValidator(_bytes),
    Field(ge=0, le=1 << 44),
    WithJsonSchema({"anyOf": [{"type": "string"}, {"type": "integer", "minimum": 0, "maximum": 1 << 44}]}),
]


class ReprojectionParams(Params):
    """Set how the window shows slow frames; `render` and `bench` show every frame as it is."""

    mode: Literal["auto", "on", "off"] = param(
        "auto",
        "While a frame is being drawn, show the last one, moved to where the viewer is by now: on, off, or only where "
        "frames are slow (auto)",
    )
    margin: float = param(
        0.12,
        "What frames show beyond the left and right edges of the window, as a part of its width, so that it can come "
        "into sight; above and below it is a third of that part of the height",
        ge=0,
        le=0.5,
    )
    scale: float = param(
        1.0,
        "Pixels of such frames per pixel of the window, along either axis, while the viewer moves; at most",
        ge=0.25,
        le=1,
    )
    frame_limit: float = param(
        300.0,
        "Time from the beginning of such a frame to its end, with all that is shown meanwhile, beyond which the next "
        "ones have fewer pixels, down to 0.33 of `scale`",
        unit="ms",
        ge=1,
        le=60_000,
    )
    refine: bool = param(
        True,
        "When nothing moves any more, draw the picture once more, with four samples per pixel; only without other "
        "anti-aliasing (render.aa: none)",
    )
    slice: float = param(
        25.0, "Time for drawing a part of the next frame, before the last one is shown again", unit="ms", ge=1, le=1000
    )


class RenderSettings(PictureParams):
    """Hold everything that changes the picture but not the scene: `render:` of the scene file.

    Besides the settings of the picture as a whole, there is a group for the level of detail, one for culling, and one
    for each pass that has parameters, under the name of the pass.
    """

    preset: Literal["default", "paper"] = param(
        "default",
        "Settings that hold wherever this file says nothing else: the program's own, or those of the method as it was "
        "published (paper), which needs assets with `dpci: {method: paper}` to be whole",
    )
    lod: LodParams = Field(default_factory=LodParams)
    culling: CullingParams = Field(default_factory=CullingParams)
    warp: WarpParams = Field(default_factory=WarpParams)
    composite: CompositeParams = Field(default_factory=CompositeParams)
    relief: ReliefParams = Field(default_factory=ReliefParams)
    distance: DistanceParams = Field(default_factory=DistanceParams)
    parallax: ParallaxParams = Field(default_factory=ParallaxParams)
    octahedral: OctahedralParams = Field(default_factory=OctahedralParams)
    billboard: BillboardParams = Field(default_factory=BillboardParams)
    mesh: MeshParams = Field(default_factory=MeshParams)
    shadows: ShadowParams = Field(default_factory=ShadowParams)
    light: LightParams = Field(default_factory=LightParams)
    inspection: InspectionParams = Field(default_factory=InspectionParams)
    gpaa: GpaaParams = Field(default_factory=GpaaParams)
    fxaa: FxaaParams = Field(default_factory=FxaaParams)
    smaa: SmaaParams = Field(default_factory=SmaaParams)
    dof: DofParams = Field(default_factory=DofParams)
    output: OutputParams = Field(default_factory=OutputParams)
    reprojection: ReprojectionParams = Field(default_factory=ReprojectionParams)
    fused: bool = param(
        True,
        "Draw passes that follow each other and need no other pixel than their own, as light and fog, by one program; "
        "otherwise each has a time of its own",
    )
    gpu_memory: Bytes = param(
        DEFAULT_BUDGET,
        "Most GPU memory for depth images and meshes, as `2 GiB` or as a number of bytes; when it is full, "
        "what has not been seen for longest is removed",
    )

    @model_validator(mode="before")
    @classmethod
    def _add_preset(cls, values: Any) -> Any:
        if not isinstance(values, Mapping) or "preset" not in values:
            return values
        from depthwalk.scene.render_presets import with_preset  # here: few files name a preset

        return with_preset(values)
