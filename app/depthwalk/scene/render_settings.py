"""Declare the render settings: what may stand under `render:` in a scene file, with defaults, units, ranges and help.

They are typed, and import neither OpenGL nor the renderer, so that a scene can be read and checked without a GPU. The
panel of the window, `--set render.…` and docs/parameters.md are made from the same declarations.
"""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema, model_validator

from depthwalk.limits import size_in_bytes
from depthwalk.params import Params, param


class MeshLodParams(Params):
    """Set the level of detail of meshes."""

    error: float = param(
        1.0,
        "Largest geometric error of a simplified mesh on the screen, measured at the point of its bounds that is "
        "nearest to the camera: those of the object (mesh-lod) or of each patch (mesh-clusters)",
        unit="pixels",
        ge=0,
        le=1000,
    )


class MeshParams(MeshLodParams):
    """Set how polygon meshes are drawn."""

    wireframe: bool = param(False, "Draw the edges of the triangles only")


class FxaaParams(Params):
    """Set fast approximate anti-aliasing, in effect with `render.aa: fxaa`."""

    edge_threshold: float = param(
        0.125,
        "Smallest difference in brightness that counts as an edge, as a fraction of the brightest pixel around it",
        ge=0,
        le=1,
    )


class CompositeParams(Params):
    """Set how impostors, the images that depth images were warped into, are drawn to the screen."""

    parallax_steps: int = param(
        1,
        "Steps of the search for the surface along each view ray when the camera has moved since an impostor was "
        "warped; 0 draws the impostor as a flat picture",
        ge=0,
        le=8,
    )
    show_tiles: bool = param(False, "Tint each impostor with a colour of its own")


class GpaaParams(Params):
    """Set geometric anti-aliasing, in effect with `render.aa: gpaa` and `gpaa-edge`."""

    samples: int = param(
        2,
        "Samples per pixel along either axis; 2 also smooths foliage, where several leaves share a pixel and blending "
        "along edges does not help",
        ge=1,
        le=2,
    )
    crease_angle: float = param(
        30.0,
        "Smallest angle between two visible faces at which the edge between them is smoothed, as outlines are",
        unit="degrees",
        ge=0,
        le=180,
    )


class TileParams(Params):
    """Set how impostors are laid out and for how long they are reused."""

    tile_mapping: Literal["screen", "plane"] = param(
        "screen",
        "What an impostor's texels are aligned with: the pixels of the screen, or squares on the impostor's plane as "
        "in the paper",
    )
    tile_scale: float = param(1.0, "Texels of an impostor per pixel of the screen, along either axis", ge=0.1, le=4)
    cluster_pixels: float = param(
        16.0,
        "Far neighbouring objects that are smaller than this on the screen share an impostor; 0 gives every object its "
        "own",
        unit="pixels",
        ge=0,
        le=256,
    )
    reuse_error: float = param(
        1.0,
        "Reuse an impostor from an earlier frame while its parallax error stays below this many pixels; 0 re-warps "
        "every frame",
        unit="pixels",
        ge=0,
        le=16,
    )
    triangle_budget: int = param(
        200_000,
        "Most triangles that are warped again in one frame; impostors beyond it wait for a later frame, until their "
        "error is four times reuse_error",
        unit="triangles",
        ge=0,
    )


class ReliefParams(Params):
    """Set relief mapping (Policarpo, Oliveira and Comba 2005), in effect with `representation: relief`."""

    linear_steps: int = param(
        10, "Steps of equal length in which a ray looks for a first point below the surface", ge=1, le=1024
    )
    binary_steps: int = param(6, "Times that the last of these steps is then halved about the surface", ge=0, le=24)


class DistanceParams(Params):
    """Set per-pixel displacement with distance functions (Donnelly 2005), with `representation: distance`."""

    steps: int = param(16, "Steps of a ray, each as long as the distance to the surface allows", ge=1, le=1024)
    resolution: int = param(256, "Most width and height of the volume of distances", unit="texels", ge=16, le=512)
    slices: int = param(16, "Depth of the volume of distances", unit="texels", ge=2, le=128)


class ParallaxParams(Params):
    """Set parallax occlusion mapping (Tatarchuk 2006), in effect with `representation: parallax`."""

    min_steps: int = param(8, "Steps of a ray that meets the picture's plane at a right angle", ge=1, le=1024)
    max_steps: int = param(50, "Steps of a ray along the plane; between the two by the cosine", ge=1, le=1024)


class OctahedralParams(Params):
    """Set octahedral impostors (Brucks 2018), in effect with `representation: octahedral`."""

    views: int = param(
        12,
        "Directions from which an object is captured, along either side of the square to which the octahedron about it "
        "unfolds: 12 are 144 pictures",
        ge=2,
        le=16,
    )
    resolution: int = param(
        170,
        "Width and height of each picture; views² · resolution² · 10.7 bytes for an asset",
        unit="texels",
        ge=8,
        le=256,
    )
    parallax_steps: int = param(1, "Times that each picture is shifted by its depth along the view ray", ge=0, le=8)
    hemisphere: bool = param(
        False, "Capture from above the horizon only; who looks from below then sees the views from the horizon"
    )


class BillboardParams(Params):
    """Set billboards (Rohlf and Helman 1994), in effect with `representation: billboard`."""

    views: int = param(8, "Directions, all around, from which an object is captured", ge=1, le=64)
    resolution: int = param(256, "Width and height of each picture", unit="texels", ge=8, le=512)


class WarpParams(TileParams):
    """Set how depth images are warped into impostors, and for how long impostors are reused."""

    order: Literal["depth", "epipole"] = param(
        "depth",
        "What decides which sample is in front: the depth buffer, or the drawing order of the paper, which needs a "
        "draw call per object",
    )
    wireframe: bool = param(False, "Draw the edges of the warped grids only")


class LightParams(Params):
    """Set when light is computed."""

    mode: Literal["deferred", "forward", "warp"] = param(
        "deferred",
        "Light depth images together with everything else after all is drawn (deferred); or by sun and ambient light "
        "only, once for each pixel that shows them (forward), or while they are warped, so that impostors hold lit "
        "colours, which are filtered when these are drawn, as in the paper (warp)",
    )


class LodParams(Params):
    """Set the level of detail of depth images: how finely an object is drawn, and from which of its images."""

    mode: Literal["error", "paper"] = param(
        "error", "Choose the geometry by its error on the screen, or by distance as in the paper (Iter_step)"
    )
    error: float = param(
        0.5,
        "Largest geometric error on the screen, measured at the point of the object's bounds that is nearest to the "
        "camera",
        unit="pixels",
        ge=0,
        le=100,
    )
    bias: float = param(
        0.0,
        "Added to the level of detail: each +1 doubles the error that is allowed, or halves the resolution of the "
        "grid, and so makes drawing faster and coarser",
        unit="levels",
        ge=-4,
        le=8,
    )
    max_step: int = param(
        64, "Coarsest grid step (Iter_step) that the mode `paper` may choose", unit="texels", ge=1, le=64
    )
    triangles_per_pixel: float = param(
        8.0,
        "Most triangles per pixel that an object covers; finer grids are replaced by coarser ones",
        ge=0.1,
        le=1e6,
    )
    magnification: float = param(
        1.0,
        "Draw an object as its mesh, in shadow maps too, when it is so near that one texel of its depth images could "
        "cover more than this; 0 never does, not even where `auto` takes the mesh for quicker, nor does a "
        "`--representation` other than scene and auto",
        unit="pixels",
        ge=0,
        le=1e6,
    )
    freeze: bool = param(
        False, "Keep the level of detail of the moment this was switched on, to look at it from elsewhere"
    )
    meso_fade: float = param(
        1.0,
        "Show meso-structure by shading only when its height covers fewer pixels than this",
        unit="pixels",
        ge=0,
        le=1000,
    )
    cases: Literal["complete", "paper", "side", "cap"] = param(
        "complete",
        "What of an object is left out: the top, the bottom and those parts of the side that cannot be seen "
        "(complete); the top or the bottom by the camera's height alone (paper); both (side), or all but the one that "
        "`paper` would draw with the side (cap), to see what each image adds",
    )

    @property
    def allowed_error(self) -> float:
        """Return the geometric error that `error` and `bias` together allow on the screen, pixels."""
        return self.error * 2**self.bias


class SmaaParams(Params):
    """Set enhanced subpixel morphological anti-aliasing, in effect with `render.aa: smaa`."""

    edge_threshold: float = param(
        0.05, "Smallest difference in perceived brightness that counts as an edge", ge=0, le=1
    )
    max_search_distance: int = param(
        32, "How far an edge is followed in either direction to find its ends", unit="pixels", ge=1, le=256
    )


NEAREST_FOCUS, FARTHEST_FOCUS = 0.5, 10000.0  # metres; the former is beyond any focal length


class DofParams(Params):
    """Set the depth of field of a thin lens. Focal length and the camera's `fov` say how high its sensor is."""

    mode: Literal["none", "paper", "gather", "accumulate"] = param(
        "none",
        "Depth of field: none; blurred copies of the picture, mixed by 13 samples (paper); rays traced through the "
        "depth buffer (gather); the average of many frames, one from each point of the lens (accumulate)",
    )
    focal_length: float = param(50.0, "Focal length of the lens; longer lenses blur more", unit="mm", ge=1, le=400)
    f_number: float = param(
        2.8, "Focal length divided by the diameter of the aperture; smaller numbers blur more", ge=0.5, le=64
    )
    focus_distance: float = param(
        5.0,
        "Distance along the view axis at which the picture is sharp",
        unit="m",
        ge=NEAREST_FOCUS,
        le=FARTHEST_FOCUS,
    )
    samples: int = param(
        64, "Points on the lens: frames to average (accumulate), most rays of a pixel (gather)", ge=1, le=1024
    )
    max_blur: float = param(
        8.0,
        "Largest diameter of the circle of confusion, of `paper` and `gather`",
        unit="% of the picture's height",
        ge=0.5,
        le=25,
    )
    autofocus: bool = param(False, "In the window: focus on what is in the middle of the picture")


class OutputParams(Params):
    """Set how the lit picture is converted to what a screen can show."""

    tone_mapping: Literal["none", "reinhard", "aces", "agx"] = param(
        "none", "Curve that brings light of any strength into the range of a screen; none clips it at white"
    )
    exposure: float = param(
        0.0, "Brightens the picture before tone mapping; each +1 doubles its light", unit="EV", ge=-16, le=16
    )


MAX_SHADOW_LAMPS = 16  # lamps that can have a shadow map at a time

WORST_ERROR = 4.0  # times `ShadowParams.error`: the error to expect where the limit on triangles coarsens casters more

MAX_CASCADES = 4


class ShadowParams(Params):
    """Set the shadows of the sun, and of lamps with `shadow: true`."""

    enabled: bool = param(False, "Let the sun cast shadows of objects on each other and on the ground")
    cascades: int = param(
        3, "Shadow maps of the sun, each for a range of distances from the camera", ge=1, le=MAX_CASCADES
    )
    resolution: int = param(1408, "Width and height of each shadow map of the sun", unit="texels", ge=64, le=8192)
    distance: float = param(80.0, "Distance from the camera at which the sun's shadows end", unit="m", ge=0.01, le=1e6)
    split: float = param(
        0.8,
        "How the distance is divided among the cascades: 0 evenly, 1 logarithmically (each reaches the same number of "
        "times as far as the one before), between them a blend of both",
        ge=0,
        le=1,
    )
    filter_width: int = param(3, "Width over which the edges of shadows are blurred", unit="texels", ge=2, le=8)
    error: float = param(
        0.125,
        "Largest geometric error of what casts shadows, as far as triangles_per_texel allows",
        unit="texels",
        ge=0,
        le=100,
    )
    triangles_per_texel: float = param(
        10.0,
        "Most triangles per texel that an object covers in a shadow map, a quarter of this in each map after the "
        "first; finer grids are replaced by coarser ones",
        ge=0.01,
        le=1e6,
    )
    lamps: int = param(
        8, "Most lamps that cast shadows at a time; the brightest in view come first", ge=0, le=MAX_SHADOW_LAMPS
    )
    lamp_resolution: int = param(512, "Width and height of a lamp's shadow map", unit="texels", ge=64, le=4096)

    @property
    def worst_error(self) -> float:
        """Return the geometric error to expect of shadow casters, texels of a shadow map.

        It is larger than the `error` that is asked for, which `triangles_per_texel` may be too low to reach.
        """
        return WORST_ERROR * self.error


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


class CullingParams(Params):
    """Set which objects are left out because they cannot be seen."""

    min_pixels: float = param(
        0.5,
        "Leave out objects whose bounding sphere is smaller than this on the screen, in diameter",
        unit="pixels",
        ge=0,
        le=64,
    )
    occlusion: bool = param(True, "Leave out objects that are hidden behind others")


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
        500.0,
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
