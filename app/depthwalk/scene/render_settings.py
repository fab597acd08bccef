"""Declare the render settings: everything under `render:` in a scene file, with defaults, units, ranges and help.

They are typed, and import neither OpenGL nor the renderer, so that a scene can be read and checked without a GPU. The
window's panel, `--set render.…` and docs/parameters.md are generated from the same declarations.
"""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema, model_validator

from depthwalk.limits import size_in_bytes
from depthwalk.params import Params, param
from depthwalk.scene.effect_settings import (
    AmbientOcclusionParams,
    DofParams,
    FxaaParams,
    GpaaParams,
    InspectionParams,
    LightParams,
    OutputParams,
    ShadowParams,
    SmaaParams,
)
from depthwalk.scene.object_settings import (
    BillboardParams,
    CompositeParams,
    CullingParams,
    DistanceParams,
    LodParams,
    MeshParams,
    OctahedralParams,
    ParallaxParams,
    ReliefParams,
    WarpParams,
)

DEFAULT_BUDGET = 2 << 30  # bytes: with targets and atlas at 4K, half of what even small cards have


class PictureParams(Params):
    """Set properties of the picture as a whole."""

    aa: Literal["none", "coverage", "msaa", "fxaa", "smaa", "gpaa", "gpaa-edge", "ssaa"] = param(
        "none",
        "Anti-aliasing: none; by the part of a pixel that depth images cover (coverage); by four hardware samples per "
        "pixel (msaa); along edges in brightness (fxaa, smaa); along all edges of polygons (gpaa) or their silhouettes "
        "only (gpaa-edge), both with coverage; by drawing at twice the width and height (ssaa), the default of "
        "`depthwalk render` except for EXR files",
    )


def _bytes(value: Any) -> Any:
    """Return a number of bytes, given as a number or as text such as `2 GiB`."""
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
    """Set how the window bridges slow frames; `render` and `bench` show every frame as it is."""

    mode: Literal["auto", "on", "off"] = param(
        "auto",
        "While a frame is being drawn, show the last one as seen from the viewer's present position: always (on), "
        "never (off), or only if frames are slow (auto)",
    )
    margin: float = param(
        0.12,
        "How far such frames extend beyond the left and right edges of the window, as a part of its width, so that "
        "these areas can come into sight; above and below it is a third of that part of the height",
        ge=0,
        le=0.5,
    )
    scale: float = param(
        1.0,
        "Most pixels of such frames per pixel of the window, along either axis, while the viewer moves",
        ge=0.25,
        le=1,
    )
    frame_limit: float = param(
        300.0,
        "Longest time from the beginning of such a frame to its end, with all that is shown meanwhile; beyond it the "
        "next frames have fewer pixels, down to 0.33 of `scale`",
        unit="ms",
        ge=1,
        le=60_000,
    )
    refine: bool = param(
        True,
        "When nothing moves any more, draw the picture once more with four samples per pixel; only without other "
        "anti-aliasing (render.aa: none)",
    )
    slice: float = param(
        25.0, "Time to spend on a part of the next frame before the last one is shown again", unit="ms", ge=1, le=1000
    )


class RenderSettings(PictureParams):
    """Hold everything that changes the picture but not the scene: `render:` of the scene file.

    Besides settings of the picture as a whole, there is a group for the level of detail, one for culling, and one for
    each pass that has parameters, named like the pass.
    """

    preset: Literal["default", "paper"] = param(
        "default",
        "Settings that apply where the file sets nothing else: the program's own, or those of the published method "
        "(paper), which is complete only with `dpci: {method: paper}` in the assets",
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
    ambient_occlusion: AmbientOcclusionParams = Field(default_factory=AmbientOcclusionParams)
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
        "Draw consecutive passes that need no pixel but their own, such as light and fog, in one program; otherwise "
        "each is drawn and timed separately",
    )
    gpu_memory: Bytes = param(
        DEFAULT_BUDGET,
        "Most GPU memory for depth images and meshes, as `2 GiB` or as a number of bytes; when it is full, whatever "
        "has been out of sight for longest is removed",
    )

    @model_validator(mode="before")
    @classmethod
    def _add_preset(cls, values: Any) -> Any:
        if not isinstance(values, Mapping) or "preset" not in values:
            return values
        from depthwalk.scene.render_presets import with_preset  # here: few files name a preset

        return with_preset(values)
