"""Declare the settings of what draws objects: depth images, meshes, and the other representations.

Each of the others is as in its publication, which its class names.
"""

from typing import Literal

from depthwalk.params import Params, param


class MeshLodParams(Params):
    """Set the level of detail of meshes."""

    error: float = param(
        1.0,
        "Largest error of a simplified mesh on the screen, in its surface or its shading, measured at the point of the "
        "bounds nearest to the camera: the bounds of the object (mesh-lod) or of each patch (mesh-clusters)",
        unit="pixels",
        ge=0,
        le=1000,
    )


class MeshParams(MeshLodParams):
    """Set how polygon meshes are drawn."""

    wireframe: bool = param(False, "Draw only the edges of the triangles")


class CompositeParams(Params):
    """Set how impostors, the pictures into which depth images are warped, are drawn to the screen."""

    parallax_steps: int = param(
        1,
        "Steps of the search for the surface along each view ray when the camera has moved since an impostor was "
        "warped; 0 draws the impostor as a flat picture",
        ge=0,
        le=8,
    )
    show_tiles: bool = param(False, "Tint each impostor with a colour of its own")


class TileParams(Params):
    """Set how impostors are laid out and how long they are reused."""

    tile_mapping: Literal["screen", "plane"] = param(
        "screen",
        "What an impostor's texels are aligned with: the pixels of the screen, or rectangles of one size on the "
        "impostor's plane as in the paper",
    )
    tile_scale: float = param(1.0, "Texels of an impostor per pixel of the screen, along either axis", ge=0.1, le=4)
    cluster_pixels: float = param(
        16.0,
        "Distant neighbouring objects smaller than this on the screen share an impostor; 0 gives every object its own",
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
        "Most triangles that are re-warped in one frame; impostors beyond it wait for a later frame, until their error "
        "is four times reuse_error",
        unit="triangles",
        ge=0,
    )


class WarpParams(TileParams):
    """Set how depth images are warped into impostors, and how long impostors are reused."""

    order: Literal["depth", "epipole"] = param(
        "depth",
        "What decides which sample is in front: the depth buffer, or the paper's drawing order, which needs a draw "
        "call per object",
    )
    wireframe: bool = param(False, "Draw only the edges of the warped grids")


class LodParams(Params):
    """Set the level of detail of depth images: how finely an object is drawn, and from which of its images."""

    mode: Literal["error", "paper"] = param(
        "error", "Choose the geometry by its error on the screen, or by distance as in the paper (Iter_step)"
    )
    error: float = param(
        0.5,
        "Largest geometric error on the screen, measured at the point of the object's bounds nearest to the camera",
        unit="pixels",
        ge=0,
        le=100,
    )
    bias: float = param(
        0.0,
        "Added to the level of detail: each +1 doubles the allowed error, or halves the resolution of the grid, which "
        "makes drawing faster and coarser",
        unit="levels",
        ge=-4,
        le=8,
    )
    max_step: int = param(
        64, "Coarsest grid step (Iter_step) that the mode `paper` may choose", unit="texels", ge=1, le=64
    )
    triangles_per_pixel: float = param(
        8.0,
        "Most triangles of an object per pixel that it covers; finer grids are replaced by coarser ones",
        ge=0.1,
        le=1e6,
    )
    magnification: float = param(
        1.0,
        "Draw an object as its mesh, in shadow maps too, when it is so near that one texel of its depth images could "
        "cover more than this. 0 turns this off, even where `auto` finds the mesh quicker; so does any "
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
        "Show meso-structure by shading alone when its height covers fewer pixels than this",
        unit="pixels",
        ge=0,
        le=1000,
    )
    cases: Literal["complete", "paper", "side", "cap"] = param(
        "complete",
        "What is left out of an object: the top, the bottom and the parts of the side that cannot be seen (complete); "
        "the top or the bottom, by the camera's height alone (paper); both top and bottom (side); or all but the cap "
        "that `paper` would draw with the side (cap). The last two show what each image contributes",
    )

    @property
    def allowed_error(self) -> float:
        """Return the geometric error on the screen that `error` and `bias` together allow, pixels."""
        return self.error * 2**self.bias


class CullingParams(Params):
    """Set which objects are culled because they cannot be seen."""

    min_pixels: float = param(
        0.5,
        "Cull objects whose bounding sphere has a smaller diameter than this on the screen",
        unit="pixels",
        ge=0,
        le=64,
    )
    occlusion: bool = param(True, "Cull objects that are hidden behind others")


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
        False,
        "Capture from above the object's horizon only; a viewer below it, as in front of one that is upside down, then "
        "sees the views from the horizon",
    )


class BillboardParams(Params):
    """Set billboards (Rohlf and Helman 1994), used with `representation: billboard`."""

    views: int = param(8, "Capture directions, all around the object", ge=1, le=64)
    resolution: int = param(256, "Width and height of each picture", unit="texels", ge=8, le=512)
