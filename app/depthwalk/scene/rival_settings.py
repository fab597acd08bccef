"""Declare the settings of the other ways to draw an object, each as in its publication."""

from depthwalk.params import Params, param


class ReliefParams(Params):
    """Set relief mapping (Policarpo, Oliveira and Comba 2005), used with `representation: relief`."""

    linear_steps: int = param(
        10, "Equal steps in which a ray searches for the first point below the surface", ge=1, le=1024
    )
    binary_steps: int = param(6, "Times that the last of these steps is then halved around the surface", ge=0, le=24)


class DistanceParams(Params):
    """Set per-pixel displacement with distance functions (Donnelly 2005), used with `representation: distance`."""

    steps: int = param(16, "Steps of a ray, each as long as the distance to the surface allows", ge=1, le=1024)
    resolution: int = param(256, "Most width and height of the distance volume", unit="texels", ge=16, le=512)
    slices: int = param(16, "Depth of the distance volume", unit="texels", ge=2, le=128)


class ParallaxParams(Params):
    """Set parallax occlusion mapping (Tatarchuk 2006), used with `representation: parallax`."""

    min_steps: int = param(8, "Steps of a ray perpendicular to the picture's plane", ge=1, le=1024)
    max_steps: int = param(50, "Steps of a ray along the plane; interpolated in between by the cosine", ge=1, le=1024)


class OctahedralParams(Params):
    """Set octahedral impostors (Brucks 2018), used with `representation: octahedral`."""

    views: int = param(
        12,
        "Capture directions along either side of the square to which the octahedron around the object unfolds: 12 make "
        "144 pictures",
        ge=2,
        le=16,
    )
    resolution: int = param(
        170,
        "Width and height of each picture; an asset takes views² · resolution² · 10.7 bytes",
        unit="texels",
        ge=8,
        le=256,
    )
    parallax_steps: int = param(1, "Times that each picture is shifted by its depth along the view ray", ge=0, le=8)
    hemisphere: bool = param(
        False, "Capture from above the horizon only; a viewer below it then sees the views from the horizon"
    )


class BillboardParams(Params):
    """Set billboards (Rohlf and Helman 1994), used with `representation: billboard`."""

    views: int = param(8, "Capture directions, all around the object", ge=1, le=64)
    resolution: int = param(256, "Width and height of each picture", unit="texels", ge=8, le=512)
