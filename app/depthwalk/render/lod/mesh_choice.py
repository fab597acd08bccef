"""Choose for each object whether its mesh or its depth images are drawn.

Near by, where a texel would cover more than a pixel, depth images would only be magnified, and the mesh is drawn, at a
level that has few triangles for its pixels, unless that is less accurate than the depth images. Objects drawn by `auto`
also show their mesh where that is quicker. A mesh costs by its triangles, depth images by the pixels they cover. Both
costs are nearly linear, as the curves of `depthwalk tables` show, so that the mesh is quicker where

    triangles ≤ TRIANGLES_PER_PIXEL · pixels + FREE_TRIANGLES,

with the pixels of the rectangle about the object. The first number is how much more a pixel of an impostor costs than a
pixel of a mesh, the second the fixed cost of an object's impostor, both divided by the cost of a triangle. Where
`depthwalk advise` has measured an asset, its result replaces this model. The triangles are those of the coarsest level
of the mesh that `render.mesh.error` allows. How many these are is not known before the mesh is read, so the levels of
light meshes are read as soon as their objects are in sight.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.lod.fallback_rule import MeshFallbackRule
from depthwalk.render.lod.mesh_fallback import MeshFallbacks
from depthwalk.render.lod.mesh_lod import MOST_LIGHT, MeshLevels
from depthwalk.render.view.view import View
from depthwalk.scene.advice import Advice
from depthwalk.scene.arrays import Objects
from depthwalk.types import Array, Mask, Rows

# Measured on walks through crowds on Mesa llvmpipe, where most impostors are reused from earlier frames, and many share
# the cost of a draw call. The first is also what magnified depth images of a single object cost when they are warped in
# every frame (docs/measurements.md, "When the mesh is slower"), and so limits the triangles of a mesh near by, too.
TRIANGLES_PER_PIXEL = 0.8
FREE_TRIANGLES = 60.0
# Where the level that a pixel allows has more, a coarser one is drawn if it is off by so many texels at most. Of the
# models measured, all look better than their depth images up to .34 texels, and some worse from .57 on
# (docs/experiments.md, "Meshes nearer by").
MESH_TEXELS = 0.5

BINS_PER_OCTAVE, BINS = 4, 56  # of sizes on the screen, from 1 to 16,384 pixels
UNKNOWN, AS_IMAGES, AS_MESH = -1, 0, 1


@dataclass(frozen=True, kw_only=True, eq=False)
class MeshChoice:
    """Hold which objects of a scene choose, and the advice measured for their assets.

    Attributes
    ----------
    chooses : (n,) whether each row is drawn by `auto`.
    advised : (a, BINS) int8 by number in `CookedParts` and by size: `AS_MESH`, `AS_IMAGES`, or `UNKNOWN` where nothing
        was measured.
    """

    chooses: Mask
    advised: NDArray[np.int8]

    @cached_property
    def has_advice(self) -> bool:
        """Return whether anything was measured."""
        return bool((self.advised != UNKNOWN).any())


def advice_bins(advice: Advice) -> NDArray[np.int8]:
    """Return a row (BINS,) of `MeshChoice.advised`: for each size, the advice at the nearest size, by its logarithm."""
    sizes = np.log2(advice.pixels)
    middle = (np.arange(BINS) + 0.5) / BINS_PER_OCTAVE
    nearest = np.abs(middle[:, None] - sizes).argmin(1)
    return np.where(np.asarray(advice.mesh)[nearest], AS_MESH, AS_IMAGES).astype(np.int8)


def advised_table(count: int, names: Mapping[int, str], advice: Mapping[str, Advice]) -> NDArray[np.int8]:
    """Return `MeshChoice.advised` for `count` numbers. names: the asset's name by number of the depth object."""
    table = np.full((count, BINS), UNKNOWN, np.int8)
    for number, name in names.items():
        if name in advice:
            table[number] = advice_bins(advice[name])
    return table


def mesh_is_quicker(triangles: Array, pixels: Array) -> Mask:
    """Return for which of n objects the cost model prefers the mesh.

    Parameters
    ----------
    triangles : (n,) of the mesh.
    pixels : (n,) of the rectangle about the object.

    Returns
    -------
    (n,) whether the mesh is to be drawn.
    """
    return np.asarray(triangles <= TRIANGLES_PER_PIXEL * pixels + FREE_TRIANGLES)


def advised_at(advised: NDArray[np.int8], size: Array) -> NDArray[np.int8]:
    """Return what was advised for n objects.

    Parameters
    ----------
    advised : (n, BINS) of the assets of the objects.
    size : (n,) larger of height and width, pixels.

    Returns
    -------
    (n,) int8, see `MeshChoice.advised`.
    """
    place = np.floor(BINS_PER_OCTAVE * np.log2(np.maximum(size, 1.0))).astype(np.int64)
    return np.asarray(advised[np.arange(len(size)), np.minimum(place, BINS - 1)])


def farthest_as_mesh(
    view: View, fallbacks: MeshFallbacks, triangles: Array, advised: NDArray[np.int8] | None, magnification: float
) -> Array:
    """Return up to what distance a mesh may replace objects, by the number of the depth object.

    Parameters
    ----------
    view : the view of the picture.
    fallbacks : which meshes show the same as which depth objects.
    triangles : (a,) of the mesh of each depth object; +inf where that is not known.
    advised : (a, BINS) see `MeshChoice`; None where nothing chooses.
    magnification : how many pixels a texel of the depth images may cover, above 0.

    Returns
    -------
    (a,) metres, object frames, from the viewer to the cylinder that encloses the asset; +inf: at any distance.
    """
    reach = view.detail_pixels / magnification * fallbacks.texel
    if advised is None:
        return np.asarray(reach)
    area = 4 * fallbacks.cylinder_radius * fallbacks.half_height
    with np.errstate(divide="ignore", invalid="ignore"):
        pixels = (triangles - FREE_TRIANGLES) / TRIANGLES_PER_PIXEL  # from this many on
        quicker = view.detail_pixels * np.sqrt(area / pixels) - fallbacks.cylinder_radius
    quicker = np.where(pixels > math.prod(view.whole_size), 0.0, np.where(pixels > 0, quicker, np.inf))
    quicker = np.where(triangles <= MOST_LIGHT, np.inf, quicker)  # by a simplified level, wherever it is
    has_advice = advised[:, 0] != UNKNOWN  # advice of an asset holds for all sizes
    quicker = np.where(has_advice, np.where((advised == AS_MESH).any(1), np.inf, 0.0), quicker)
    return np.asarray(np.maximum(reach, quicker))


def _drawn_triangles(
    number: Rows, pixel_length: Array, fallbacks: MeshFallbacks, levels: MeshLevels, rule: MeshFallbackRule, asked: Mask
) -> Array:
    """Return how many triangles (m,) would be drawn if meshes replaced the depth objects numbered `number` (m,).

    For light meshes these are the triangles of the level to be drawn, once it is read; where `asked` (m,), this starts
    reading it. For other meshes they are all triangles, read or not, so that pictures do not depend on what was read.
    pixel_length: (m,) that a pixel covers at the nearest point of each object, metres in its frame.
    """
    mesh = fallbacks.mesh[number]
    triangles = fallbacks.triangles[mesh]
    light = np.flatnonzero(asked & (triangles <= MOST_LIGHT))
    if len(light):
        light = light[rule.is_resident(mesh[light])]
        triangles[light] = levels.drawn(mesh[light], rule.error * pixel_length[light])
    return triangles


class MeshChooser:
    """Choose meshes for each frame, and keep from frame to frame how far away they may be."""

    def __init__(self) -> None:
        self._farthest: Array = np.zeros(0)
        self._farthest_for: tuple[object, ...] = ()  # what `_farthest` was computed from

    def as_meshes(
        self,
        view: View,
        objects: Objects,
        rows: Rows,
        *,
        choice: MeshChoice | None,
        fallbacks: MeshFallbacks,
        levels: MeshLevels,
        rule: MeshFallbackRule,
    ) -> Rows:
        """Return which of the objects `rows` are replaced by their meshes.

        Of the depth objects that show one asset in one place, all are replaced or none.

        Parameters
        ----------
        view : the view of the picture.
        objects : all objects of the scene.
        rows : (m,) rows of the objects that the view shows, nearest first.
        choice : which objects choose, and what was measured; None where none does.
        fallbacks : which meshes show the same as which depth objects.
        levels : the levels of detail of the meshes that are loaded.
        rule : how near objects must be, and which meshes are resident; the others begin to be read.

        Returns
        -------
        (k,) indices into `rows`, rising.
        """
        if not rule.magnification:
            return np.zeros(0, np.int64)
        near, nearest = fallbacks.nearer_than(
            view, objects, rows, self._farthest_as_mesh(view, choice, fallbacks, rule.magnification)
        )
        if not len(near):  # as in most phases
            return near
        number, pixel_length = objects.asset[rows[near]], nearest / view.detail_pixels
        middle, pixels = fallbacks.seen(view, number, nearest)
        quicker = None
        if choice is not None:
            advised = np.full(len(number), UNKNOWN, np.int8)
            if choice.has_advice:
                size = 2 * np.maximum(fallbacks.cylinder_radius[number], fallbacks.half_height[number]) / middle
                advised = advised_at(choice.advised[number], size)
            drawn = _drawn_triangles(number, pixel_length, fallbacks, levels, rule, advised == UNKNOWN)
            modelled = mesh_is_quicker(drawn, pixels)
            quicker = choice.chooses[rows[near]] & np.where(advised == UNKNOWN, modelled, advised == AS_MESH)
        found = rule.allowed(
            fallbacks, levels, number=number, pixel_length=pixel_length, pixels=pixels, quicker=quicker
        )
        return near[found]

    def _farthest_as_mesh(
        self, view: View, choice: MeshChoice | None, fallbacks: MeshFallbacks, magnification: float
    ) -> Array:
        """Return the result of `farthest_as_mesh`, cached until lens, picture size or tables change."""
        made_for = choice, fallbacks, view.detail_pixels, view.whole_size, magnification
        if self._farthest_for != made_for:
            advised = None if choice is None else choice.advised
            triangles = fallbacks.triangles[fallbacks.mesh]
            self._farthest = farthest_as_mesh(view, fallbacks, triangles, advised, magnification)
            self._farthest_for = made_for
        return self._farthest
