"""Bake a single planar depth image to an object (Liu et al. 2007, §2): a top cap without a cylinder around it."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.baker import cast_face, connect_face, trace_boundary_strips
from depthwalk.bake.face_grid import FaceGrid
from depthwalk.bake.grid import grid_cells, usable_steps
from depthwalk.bake.images import BakedObject, BoundaryStrip, Cylinder, DepthImage, Face
from depthwalk.bake.params import BakeParams
from depthwalk.bake.raycast import RayCaster
from depthwalk.colour import linear_from_srgb8
from depthwalk.errors import InputError
from depthwalk.ingest.depth_surface import continues, tolerance
from depthwalk.ingest.image import PlanarImage
from depthwalk.ingest.mesh import Material, Mesh, Part
from depthwalk.ingest.range_image import PanoramaLens, RangeImage
from depthwalk.limits import MIN_DPCI_RESOLUTION

_MATERIAL = Material((1.0, 1.0, 1.0))
_UPRIGHT = (float(np.sqrt(0.5)), 0.0, 0.0, float(np.sqrt(0.5)))  # a quarter turn about x: +Y to +Z, −Z to +Y
# Past the edge of a near object, a camera's perspective shows surface that lies behind the object in a parallel
# projection. An open mesh gets twice as many layers: one for the object, one for what it hides. A third would hold 1 in
# 100 samples of a head before a wall.
_RANGE_LAYERS = 1
_MAX_RANGE_TEXELS = 2048  # a side


def bake_planar(image: PlanarImage, key: str, cut: bool = True) -> BakedObject:
    """Bake a relief (Liu, Liu and Wu 2007, §2): one depth image that stands upright on its lower edge, seen from +Z.

    The picture's x axis is the asset's x axis.

    Parameters
    ----------
    image
        The relief.
    key
        Hex digest of what the object is made from, kept with it.
    cut
        Whether to separate texels where the depth jumps; the paper connects all.

    Returns
    -------
    BakedObject
        The object, which has a top cap only, placed in the asset's frame.
    """
    width, height = image.size
    depth = np.ascontiguousarray(image.depth[::-1])  # the cap's rows run along z, downward from the picture's top
    solid = np.isfinite(depth)
    cylinder = _slab(width, height, float(depth[solid].max(initial=0.0)))
    normal = np.where(solid[..., None], _into_cap_frame(image.normal[::-1]), 0)
    colour = linear_from_srgb8(image.colour[::-1])
    specular = np.full_like(colour[..., :1], _MATERIAL.specular)
    albedo = np.where(solid[..., None], np.concatenate([colour, specular], -1), 0)
    steps = usable_steps((depth.shape[0], depth.shape[1]))
    cells = connect_texels(depth, max(width / depth.shape[1], height / depth.shape[0]), steps, cut)
    owner = np.full(depth.shape, Face.TOP, np.uint8)
    picture = DepthImage(
        face=Face.TOP,
        layer=0,
        depth=depth,
        normal=normal.astype(np.float32),
        albedo=albedo.astype(np.float32),
        cells=cells,
        owner=owner,
    )
    return _upright(cylinder, height, (picture,), (), steps, key)


def bake_range(image: RangeImage, key: str) -> BakedObject:
    """Resample a range image to a plane seen from +Z, which is centred on its lowest point.

    A camera sees its pixels in perspective, while the renderer's planes use parallel projection. So the pixels are
    turned into a mesh, torn where the image is torn, and rays are cast at it as at any other mesh. The second layer
    keeps surfaces that only the camera's perspective shows. A texel is as large as what the median pixel saw, and the
    nearest point lies on the front plane.

    Parameters
    ----------
    image
        The image of a depth camera.
    key
        Hex digest of what the object is made from, kept with it.

    Returns
    -------
    BakedObject
        The object, placed in the asset's frame.

    Raises
    ------
    InputError
        If no two neighbouring pixels show the same surface.
    """
    mesh = range_mesh(image)
    low, high = mesh.bounds
    pixel = float(np.median(image.depth[np.isfinite(image.depth)])) / image.lens.focal
    width, height, deep = (float(extent) for extent in high - low)
    side = max(width, height) + 2 * pixel  # square, like the baker's caps
    slack = 1e-4 * max(side, deep)
    centre = np.array([low[0] + width / 2, low[1] + height / 2, high[2] + slack], np.float32)
    turned = replace(mesh, positions=_into_cap_frame(mesh.positions - centre), normals=_into_cap_frame(mesh.normals))
    cylinder = _slab(side, side, deep + 2 * slack)
    texels = int(np.clip(np.ceil(side / pixel), MIN_DPCI_RESOLUTION, _MAX_RANGE_TEXELS))
    steps = usable_steps((texels, texels))
    caster = RayCaster(turned)
    grid = FaceGrid(cylinder=cylinder, face=Face.TOP, height=texels, width=texels)
    seen = cast_face(turned, caster, grid, BakeParams(resolution=texels, layers=_RANGE_LAYERS))
    images = connect_face(caster, grid, seen, steps)
    borders = trace_boundary_strips(caster, {Face.TOP: grid}, {Face.TOP: seen}, images)
    return _upright(cylinder, height, tuple(images), tuple(borders), steps, key)


def range_mesh(image: RangeImage, cut: bool = True) -> Mesh:
    """Connect the pixels of a range image to a mesh.

    Four neighbouring pixels on one surface get two triangles; no triangle spans a tear. The last column of a panorama
    is connected to the first.

    Parameters
    ----------
    image
        The image of a depth camera.
    cut
        Whether to tear the mesh where the depth jumps; otherwise all measured neighbours are connected.

    Returns
    -------
    Mesh
        The mesh, camera frame, metres.

    Raises
    ------
    InputError
        If no two neighbouring pixels show the same surface.
    """
    inverse = np.where(np.isfinite(image.depth), 1 / image.depth.astype(np.float64), np.nan)
    height, width = image.depth.shape
    texel = np.arange(height * width).reshape(height, width)
    if isinstance(image.lens, PanoramaLens):
        inverse, texel = (np.pad(array, ((0, 0), (0, 1)), mode="wrap") for array in (inverse, texel))
    allowed = tolerance(inverse, inverse / image.lens.focal)
    kept = _triangles(inverse, allowed if cut else np.full_like(allowed, np.inf))
    here, right, up, across = texel[:-1, :-1], texel[:-1, 1:], texel[1:, :-1], texel[1:, 1:]
    lower, upper = np.stack([here, right, up], -1)[kept[0]], np.stack([right, across, up], -1)[kept[1]]
    corners = np.concatenate([lower, upper])
    if not len(corners):
        raise InputError("the range image holds no surface: no pixel continues its neighbours")
    used, faces = np.unique(corners, return_inverse=True)
    return Mesh(
        positions=image.points.reshape(-1, 3)[used],
        normals=image.normal.reshape(-1, 3)[used],
        colours=image.colour.reshape(-1, 3)[used],
        uv=np.zeros((len(used), 2), np.float32),
        faces=faces.reshape(-1, 3).astype(np.int32),
        parts=(Part(0, len(faces.reshape(-1, 3)), 0),),
        materials=(_MATERIAL,),
    )


def connect_texels(
    depth: NDArray[np.float32], cell: float, steps: int, cut: bool = True
) -> tuple[NDArray[np.uint16], ...]:
    """Connect the texels of a planar depth image to triangles, judging the surface by the image alone.

    A triangle of step 2^k is kept if the surface continues, texel by texel, along its two legs. So no grid, however
    coarse, spans a tear, and a slope in the finest grid is in all of them.

    Parameters
    ----------
    depth
        (H, W) float32, metres from the image's plane, +inf where empty.
    cell
        Width of a texel, metres.
    steps
        Number of grids, of steps 1, 2, … 2^(steps − 1) texels.
    cut
        Whether a surface ends where the depth jumps; otherwise all non-empty neighbours belong to one surface.

    Returns
    -------
    tuple
        The triangles of each level, (cells,) uint16 as in `DepthImage.cells`.
    """
    allowed = tolerance(depth, cell) if cut else np.full_like(depth, np.inf)
    # Tears counted up to each texel: if two texels of a row have equal counts, there is none between them.
    tears_along, tears_up = (
        np.pad(np.cumsum(~continues(depth, allowed, axis), axis=axis), ((axis == 0, 0), (axis == 1, 0)))
        for axis in (1, 0)
    )
    solid = np.isfinite(depth)
    cells = []
    for level in range(steps):
        i0, j0, i1, j1 = grid_cells((depth.shape[0], depth.shape[1]), Face.TOP, 1 << level)
        along = [(tears_along[j, i0] == tears_along[j, i1]) & solid[j, i0] & solid[j, i1] for j in (j0, j1)]
        up = [(tears_up[j0, i] == tears_up[j1, i]) & solid[j0, i] & solid[j1, i] for i in (i0, i1)]
        cells.append((along[0] & up[0]).astype(np.uint16) | (along[1] & up[1]).astype(np.uint16) << 7)
    return tuple(cells)


def _triangles(values: NDArray[np.floating], allowed: NDArray[np.floating]) -> tuple[NDArray[np.bool_], ...]:
    """Return which lower and upper triangles (H − 1, W − 1) lie on the surface: it continues along both legs."""
    along, up = continues(values, allowed, 1), continues(values, allowed, 0)
    return along[:-1] & up[:, :-1], along[1:] & up[:, 1:]


def _into_cap_frame(vectors: NDArray[np.float32]) -> NDArray[np.float32]:
    """Rotate vectors (…, 3) of an upright picture into the cap's frame: x stays, up is −z, toward the viewer is +y."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.stack([x, z, -y], -1)


def _slab(width: float, height: float, deepest: float) -> Cylinder:
    """Return the volume under a cap of `width` × `height` metres at y = 0 whose image is `deepest` metres deep."""
    bottom = -1.0001 * max(deepest, 1e-3 * max(width, height))
    return Cylinder(
        radius=float(np.hypot(width, height)) / 2,
        bottom=bottom,
        top=0.0,
        half_width=width / 2,
        half_depth=height / 2,
    )


def _upright(
    cylinder: Cylinder,
    height: float,
    images: tuple[DepthImage, ...],
    borders: tuple[BoundaryStrip, ...],
    steps: int,
    key: str,
) -> BakedObject:
    """Turn the cap upright; its content is `height` metres high and centred."""
    return BakedObject(
        cylinder=cylinder,
        images=images,
        boundary_strips=borders,
        shininess=_MATERIAL.shininess,
        steps=steps,
        key=key,
        position=(0.0, height / 2, 0.0),
        rotation=_UPRIGHT,
    )
