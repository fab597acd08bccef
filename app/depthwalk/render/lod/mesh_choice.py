"""Choose for each object that is drawn by `auto` whether its mesh or its depth images are quicker.

A mesh costs by its triangles, depth images by the pixels they cover. Measured as the curves of `depthwalk tables`, both
are nearly linear, so that the mesh is quicker where

    triangles ≤ TRIANGLES_PER_PIXEL · pixels + FREE_TRIANGLES,

with the pixels of the rectangle about the object. The first number is what a pixel of an impostor costs more than a
pixel of a mesh, the second what an object's impostor costs however small it is, both over what a triangle costs. Where
`depthwalk advise` has measured an asset, its result takes the place of this model. The mesh that is drawn may be as
coarse as a mesh fallback, `render.mesh.error`.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.render.lod.mesh_fallback import TRIANGLES_PER_PIXEL, IsResident, MeshFallbacks
from depthwalk.render.lod.mesh_lod import MeshLevels
from depthwalk.render.view.view import View
from depthwalk.scene.advice import Advice
from depthwalk.scene.arrays import Objects
from depthwalk.types import Array, Mask, Rows

# Measured as `TRIANGLES_PER_PIXEL` was.
FREE_TRIANGLES = 3000.0

HYSTERESIS = 1.2  # an object changes where the other way is by so much quicker; sizes likewise
BINS_PER_OCTAVE, BINS = 4, 56  # of sizes on the screen, from 1 to 16,384 pixels
UNKNOWN, AS_IMAGES, AS_MESH = -1, 0, 1


@dataclass(frozen=True, kw_only=True)
class MeshChoice:
    """Say which objects of a scene choose, and what is known of their assets.

    Attributes
    ----------
    chooses : (n,) whether each row is drawn by `auto`.
    advised : (a, BINS) int8 by number in `CookedParts` and by size: `AS_MESH`, `AS_IMAGES`, or `UNKNOWN` where nothing
        was measured.
    """

    chooses: Mask
    advised: NDArray[np.int8]


def advice_bins(advice: Advice) -> NDArray[np.int8]:
    """Return a row (BINS,) of `MeshChoice.advised`: what was advised at the size that is nearest, by its logarithm."""
    sizes = np.log2(advice.pixels)
    middle = (np.arange(BINS) + 0.5) / BINS_PER_OCTAVE
    nearest = np.abs(middle[:, None] - sizes).argmin(1)
    return np.where(np.asarray(advice.mesh)[nearest], AS_MESH, AS_IMAGES).astype(np.int8)


def advised_table(count: int, names: Mapping[int, str], advice: Mapping[str, Advice]) -> NDArray[np.int8]:
    """Return `MeshChoice.advised` of `count` numbers, given the asset's name of each depth object by its number."""
    table = np.full((count, BINS), UNKNOWN, np.int8)
    for number, name in names.items():
        if name in advice:
            table[number] = advice_bins(advice[name])
    return table


def mesh_is_quicker(triangles: Array, pixels: Array, was_mesh: Mask) -> Mask:
    """Return for which of n objects the cost model prefers the mesh.

    Parameters
    ----------
    triangles : (n,) of the mesh.
    pixels : (n,) of the rectangle about the object.
    was_mesh : (n,) whether the mesh was drawn before, which is kept unless depth images are by `HYSTERESIS` quicker.

    Returns
    -------
    (n,) whether the mesh is to be drawn.
    """
    bias = np.where(was_mesh, HYSTERESIS, 1 / HYSTERESIS)
    return np.asarray(triangles <= bias * (TRIANGLES_PER_PIXEL * pixels + FREE_TRIANGLES))


def advised_at(advised: NDArray[np.int8], size: Array, was_mesh: Mask) -> NDArray[np.int8]:
    """Return what was advised for n objects, of which those near a change of advice stay as they are.

    Parameters
    ----------
    advised : (n, BINS) of the assets of the objects.
    size : (n,) larger of height and width, pixels.
    was_mesh : (n,) whether the mesh was drawn before.

    Returns
    -------
    (n,) int8, see `MeshChoice.advised`.
    """
    rows = np.arange(len(size))

    def at(scale: float) -> NDArray[np.int8]:
        place = np.floor(BINS_PER_OCTAVE * np.log2(np.maximum(scale * size, 1.0))).astype(np.int64)
        return np.asarray(advised[rows, np.minimum(place, BINS - 1)])

    low, high = at(1 / HYSTERESIS), at(HYSTERESIS)
    before = np.where(was_mesh, AS_MESH, AS_IMAGES).astype(np.int8)
    return np.where(low == high, low, np.where((low == before) | (high == before), before, low))


class MeshChooser:
    """Choose, frame by frame, and remember for how long the choice should stay as it is."""

    def __init__(self) -> None:
        self._was_mesh = np.zeros(0, bool)
        self._made_for: object = None

    def quicker_as_mesh(
        self,
        view: View,
        objects: Objects,
        rows: Rows,
        choice: MeshChoice,
        fallbacks: MeshFallbacks,
        levels: MeshLevels,
        is_resident: IsResident,
    ) -> Rows:
        """Return which of some objects are drawn as meshes because that is quicker.

        All depth objects that show one asset in one place are, or none.

        Parameters
        ----------
        view : the view of the picture.
        objects : all objects of the scene.
        rows : (m,) rows of the objects that the view shows, nearest first.
        choice : which objects choose, and what was measured.
        fallbacks : which meshes show the same as which depth objects.
        levels : the triangles of the meshes that are loaded.
        is_resident : returns which meshes are on the GPU; the others begin to be read.

        Returns
        -------
        (k,) numbers of the objects among the m, rising.
        """
        if self._made_for is not choice:  # other objects, or other assets
            self._made_for, self._was_mesh = choice, np.zeros(len(objects), bool)
        number = objects.asset[rows]
        able = (choice.chooses[rows] & (fallbacks.mesh[number] >= 0)).nonzero()[0]
        first = rows[able] - fallbacks.part[number[able]]
        number = objects.asset[first]
        size, pixels = _on_screen(view, objects, first, number, fallbacks)
        advised = advised_at(choice.advised[number], size, self._was_mesh[first])
        asked = (advised != AS_IMAGES).nonzero()[0]
        mesh = fallbacks.mesh[number[asked]]
        triangles = np.where(is_resident(mesh), levels.triangles[mesh, 0], np.inf)
        modelled = mesh_is_quicker(triangles, pixels[asked], self._was_mesh[first[asked]])
        found = asked[np.isfinite(triangles) & (modelled | (advised[asked] == AS_MESH))]
        self._was_mesh[first] = False
        self._was_mesh[first[found]] = True
        return np.asarray(able[found])


def _on_screen(
    view: View, objects: Objects, first: Rows, number: Rows, fallbacks: MeshFallbacks
) -> tuple[Array, Array]:
    """Return how large the assets of depth objects are on the screen: (k,) pixels along, and (k,) of the rectangle.

    first : (k,) rows of the depth objects; those of parts, of the first part.
    number : (k,) their numbers in `CookedParts`.
    """
    radius, half = fallbacks.cylinder_radius[number], fallbacks.half_height[number]
    reach = np.hypot(radius, half) * objects.scale[first]
    distance = np.linalg.norm(objects.position[first] - view.position, axis=1)
    per_metre = view.detail_pixels * objects.scale[first] / np.maximum(distance, reach)
    area = np.minimum(4 * radius * half * per_metre**2, math.prod(view.whole_size))
    return 2 * np.maximum(radius, half) * per_metre, area
