"""Declare the settings of the other ways to draw an object, each as its publication has them."""

from depthwalk.params import Params, param


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
