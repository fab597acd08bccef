"""List the objects that may be visible, by their numbers in the visibility buffer, for the pass `material_resolve`.

Pixels are shaded asset by asset: every asset has a depth of its own, so that a depth test selects its pixels (material
depth, as in Nanite and Bevy).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.render import kernels
from depthwalk.render.lod.selection import greatest_stretch
from depthwalk.render.view.bounds import extents
from depthwalk.render.view.view import View, viewer_in_object
from depthwalk.render.world.asset_table import AssetTable
from depthwalk.render.world.render_world import SceneArrays
from depthwalk.types import Array, Mask, Rows

# What material_resolve.frag reads per object: the viewer in its frame, and its scale; its rotation; the material depth
# of its asset, and whether it has an impostor tile.
SURFACE_RECORD = np.dtype([("viewer", "4f4"), ("rotation", "4f4"), ("material_depth", "4f4")])

# Assets with more objects than this are assumed to cover the whole screen; computing their bounds would cost more than
# it saves.
_CROWD = 1 << 14
# Asset k has the depth FULL_COVERAGE + k / MATERIAL_DEPTH_STEPS, which float32 and a depth buffer of 24 bits tell
# apart; pixels that it covers in part have k / MATERIAL_DEPTH_STEPS, in front of all others. All are less than ¼: there
# they are so near to depths of that buffer that every way to round leads to the same. At ½ they lie between two of its
# depths, and a GPU may round what a shader writes otherwise than what it interpolates.
MATERIAL_DEPTH_STEPS = 1 << 20
FULL_COVERAGE = 0.125


@dataclass(frozen=True, kw_only=True)
class MaterialRecords:
    """Hold what the material pass reads of n objects and their assets.

    Attributes
    ----------
    records : (1 + n,) SURFACE_RECORD by the object's number. The field `viewer` holds where the viewer stands in the
        object's frame, metres there, and the object's scale; `rotation` the object's unit quaternion (x, y, z, w),
        world from object; `material_depth` the depth that stands for its asset, whether it has an impostor tile (1 or
        0), and two zeros. Number 0 is no object: its depth is 1, the far plane, and all else is 0.
    assets : (a,) numbers in `CookedParts` of the assets that may be visible.
    material_depth : (a,) the depth that stands for each asset where it covers a pixel whole, as the depth buffer holds
        it: above `FULL_COVERAGE`, and below twice that. Where it covers a pixel in part, the depth is less by that.
    low : (a, 2) lower left corner of the part of the picture in which each asset may be, −1 to 1, y upward.
    high : (a, 2) upper right corner of that part.
    """

    records: NDArray[np.void]
    assets: Rows
    material_depth: Array
    low: Array
    high: Array


def material_records(view: View, scene: SceneArrays, rows: Rows, tiled: Mask) -> MaterialRecords:
    """Return what the pass `material_resolve` reads of n objects, in the order of their numbers.

    Parameters
    ----------
    view : the view of the picture.
    scene : all objects.
    rows : (n,) rows of the objects, the first of which has the number 1 in the visibility buffer.
    tiled : (n,) which of the objects are drawn by impostor tiles.

    Returns
    -------
    The records of objects and assets.
    """
    count = np.bincount(scene.objects.asset[rows])
    (assets,) = count.nonzero()
    asset_number = np.zeros(len(count), np.int64)
    asset_number[assets] = np.arange(len(assets))
    material_depth = FULL_COVERAGE + (1 + np.arange(len(assets))) / MATERIAL_DEPTH_STEPS
    crowd, loops = count[assets] > _CROWD, kernels.loaded()
    if loops is None:
        records, low, high = _surfaces(view, scene, rows, tiled, asset_number, material_depth, crowd)
    else:
        objects, bounds = scene.objects, scene.bounds
        numbers, low, high = loops.surfaces(
            rows=rows,
            tiled=tiled,
            position=objects.position,
            rotation=objects.rotation,
            scale=objects.scale,
            asset=objects.asset,
            centre=bounds.centre,
            bounding_radius=bounds.bounding_radius,
            asset_number=asset_number,
            material_depth=material_depth,
            crowd=crowd,
            eye=view.position,
            axes=view.axes,
            tangent=np.array(view.half_extent),
            shear=np.array(view.shear),
            near=view.depth_range[0],
        )
        records = numbers.view(SURFACE_RECORD)[:, 0]
    half_pixel = 1 / np.array(view.size)  # how far a pixel's samples may be from its middle
    return MaterialRecords(
        records=records, assets=assets, material_depth=material_depth, low=low - half_pixel, high=high + half_pixel
    )


def _surfaces(
    view: View,
    scene: SceneArrays,
    rows: Rows,
    tiled: Mask,
    asset_number: Rows,
    material_depth: Array,
    crowd: Mask,
) -> tuple[NDArray[np.void], Array, Array]:
    """Return records (1 + n,) and the corners (k, 2) of the part of the picture in which each of k assets may be.

    asset_number: (a,) the number of an asset among the k. material_depth, crowd: (k,) the depth of each, and whether it
    has too many objects for their bounds to be computed.
    """
    objects = scene.objects.take(rows)
    number = asset_number[objects.asset]
    viewer = viewer_in_object(view, objects.position, objects.rotation, objects.scale)
    records = np.zeros(1 + len(objects), SURFACE_RECORD)
    records["viewer"][1:] = np.column_stack([viewer, objects.scale])
    records["rotation"][1:] = objects.rotation
    records["material_depth"][0, 0] = 1
    records["material_depth"][1:, :2] = np.column_stack([material_depth[number], tiled])
    low, high = np.ones((len(crowd), 2)), -np.ones((len(crowd), 2))
    low[crowd], high[crowd] = -1, 1
    few = np.flatnonzero(~crowd[number])
    few_low, few_high = extents(view, scene.bounds.take(rows[few]))
    np.minimum.at(low, number[few], few_low)
    np.maximum.at(high, number[few], few_high)
    return records, low, high


def least_footprints(view: View, asset: Rows, materials: MaterialRecords, table: AssetTable) -> Array:
    """Return the smallest length that a pixel covers on any object of each asset.

    Parameters
    ----------
    view : the view of the picture.
    asset : (n,) numbers in `CookedParts` of the assets of the objects that `materials` was made of.
    materials : the records of these objects.
    table : the bounds of the assets.

    Returns
    -------
    (a,) metres, object frames; 0 where the viewer is within an object's cylinder.
    """
    nearest = table.nearest(asset, materials.records["viewer"][1:, :3].astype(np.float64))
    footprint = np.full(len(materials.assets), np.inf)
    np.minimum.at(footprint, np.searchsorted(materials.assets, asset), nearest / view.detail_pixels)
    return footprint / math.sqrt(greatest_stretch(view))  # as shaders/material_resolve/ takes the distance there
