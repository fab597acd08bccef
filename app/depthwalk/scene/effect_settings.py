"""Declare the settings of light, shadows, anti-aliasing, the lens and the output."""

from typing import Literal

from depthwalk.params import Params, param


class LightParams(Params):
    """Set at which stage light is computed."""

    mode: Literal["deferred", "forward", "warp"] = param(
        "deferred",
        "Light depth images together with everything else, after all is drawn (deferred); or by sun and ambient light "
        "only, either once for each pixel that shows them (forward), or while they are warped, so that impostors hold "
        "lit colours, which are then filtered, as in the paper (warp)",
    )


class AmbientOcclusionParams(Params):
    """Set how much surfaces close by hide each other from ambient light, as in corners and below objects."""

    enabled: bool = param(False, "Let surfaces that are close to each other in the picture darken ambient light")
    radius: float = param(
        0.5,
        "Distance up to which surfaces hide each other from ambient light, less and less from half of it on; longer "
        "for landscapes, shorter for small things",
        unit="m",
        ge=0.001,
        le=1000,
    )
    directions: int = param(
        1,
        "Planes through the view ray in which both horizons are searched; sixteen neighbours have different ones, and "
        "share what they find",
        ge=1,
        le=16,
    )
    steps: int = param(6, "Places that are looked at for each horizon; more find thinner things", ge=1, le=32)


MAX_SHADOW_LAMPS = 16  # lamps that can have a shadow map at the same time

WORST_ERROR = 4.0  # multiple of `ShadowParams.error` to expect where triangles_per_texel coarsens casters further

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
        "How the distance is divided among the cascades: 0 evenly, 1 logarithmically (each reaches the same factor "
        "farther than the one before), in between a blend of both",
        ge=0,
        le=1,
    )
    filter_width: int = param(3, "Width over which the edges of shadows are blurred", unit="texels", ge=2, le=8)
    error: float = param(
        0.125,
        "Largest geometric error of shadow casters, as far as triangles_per_texel allows",
        unit="texels",
        ge=0,
        le=100,
    )
    triangles_per_texel: float = param(
        5.0,
        "Most triangles of an object per texel that it covers in a shadow map; a quarter of this in each map after the "
        "first. Finer grids are replaced by coarser ones",
        ge=0.01,
        le=1e6,
    )
    lamps: int = param(
        8, "Most lamps that cast shadows at the same time; the brightest in view come first", ge=0, le=MAX_SHADOW_LAMPS
    )
    lamp_resolution: int = param(512, "Width and height of a lamp's shadow map", unit="texels", ge=64, le=4096)

    @property
    def worst_error(self) -> float:
        """Return the geometric error to expect of shadow casters, texels of a shadow map.

        It exceeds the requested `error`, since `triangles_per_texel` may be too low to reach that.
        """
        return WORST_ERROR * self.error


class GpaaParams(Params):
    """Set geometric anti-aliasing, used with `render.aa: gpaa` and `gpaa-edge`."""

    samples: int = param(
        2,
        "Samples per pixel along either axis; 2 also smooths foliage, where several leaves share a pixel and blending "
        "along edges does not help",
        ge=1,
        le=2,
    )
    crease_angle: float = param(
        30.0,
        "Smallest angle between two visible faces at which the edge between them is smoothed, like a silhouette",
        unit="degrees",
        ge=0,
        le=180,
    )


class FxaaParams(Params):
    """Set fast approximate anti-aliasing, used with `render.aa: fxaa`."""

    edge_threshold: float = param(
        0.125,
        "Smallest difference in brightness that counts as an edge, as a fraction of the brightest pixel around it",
        ge=0,
        le=1,
    )


class SmaaParams(Params):
    """Set enhanced subpixel morphological anti-aliasing, used with `render.aa: smaa`."""

    edge_threshold: float = param(
        0.05, "Smallest difference in perceived brightness that counts as an edge", ge=0, le=1
    )
    max_search_distance: int = param(
        32, "How far an edge is followed in either direction to find its ends", unit="pixels", ge=1, le=256
    )


NEAREST_FOCUS, FARTHEST_FOCUS = 0.5, 10000.0  # metres; the former is beyond any focal length


class DofParams(Params):
    """Set the depth of field of a thin lens. Its focal length and the camera's `fov` determine the sensor's height."""

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
        64, "Points on the lens: frames to average (accumulate), or most rays per pixel (gather)", ge=1, le=1024
    )
    max_blur: float = param(
        8.0,
        "Largest diameter of the circle of confusion, with `paper` and `gather`",
        unit="% of the picture's height",
        ge=0.5,
        le=25,
    )
    autofocus: bool = param(False, "In the window: focus on whatever is in the middle of the picture")


HowDrawn = Literal["representation", "level", "case", "error"]
"""What false colours tell about how a frame drew its objects."""


class InspectionParams(Params):
    """Set what is shown instead of the lit picture, to find out what is wrong with a model, or how it is drawn."""

    show: Literal["picture", "normals", "distance", "albedo", HowDrawn] = param(
        "picture",
        "What is shown: the lit picture; the normals in world axes, from −1 to 1, as red, green and blue; the distance "
        "along the view axis, nearer is brighter; the colours before lighting (albedo); or, in false colours, how each "
        "object is drawn: its representation, its level of detail, the case of its depth images, or the error of its "
        "impostor or simplified mesh, red where it is as large as allowed. The background is black",
    )
    half_distance: float = param(
        10.0, "Distance over which the grey of `show: distance` falls by half", unit="m", ge=0.001, le=100_000
    )

    @property
    def how_drawn(self) -> HowDrawn | None:
        """Return what false colours are to tell about objects; None where something else is shown."""
        match self.show:
            case "representation" | "level" | "case" | "error" as told:
                return told
        return None


class OutputParams(Params):
    """Set how the lit picture is converted to what a screen can show."""

    tone_mapping: Literal["none", "reinhard", "aces", "agx"] = param(
        "none", "Curve that compresses light of any strength into the range of a screen; none clips it at white"
    )
    exposure: float = param(
        0.0, "Brightens the picture before tone mapping; each +1 doubles its light", unit="EV", ge=-16, le=16
    )
    dither: bool = param(
        True,
        "In scenes with sky, fog or lamps: add a pattern of less than half a step of 8 bits, so that smooth gradients "
        "show no bands",
    )
