"""Decide when a mesh is close enough to an object's depth images, and light enough, to be drawn in their place.

Meshes that are drawn since they are quicker are chosen by `mesh_choice`.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from depthwalk.render.lod.mesh_fallback import MeshFallbacks
from depthwalk.render.lod.mesh_lod import MOST_UNSIMPLIFIED, MeshLevels
from depthwalk.render.lod.selection import affordable_level, error_level
from depthwalk.render.view.bounds import outside
from depthwalk.render.view.view import View, viewer_in_object
from depthwalk.scene.arrays import Objects
from depthwalk.types import Array, Ints, Mask, Rows

IsResident = Callable[[Rows], Mask]
"""Returns which (n,) of the meshes (n,), numbers in `CookedParts`, are on the GPU; the others are being read."""


@dataclass(frozen=True, kw_only=True)
class MeshFallbackRule:
    """Decide when meshes are drawn in place of depth images, and at which level of detail.

    In the view of a light, a pixel is a texel of its shadow map.

    Attributes
    ----------
    magnification : how many pixels a texel of the depth images may cover before the mesh is drawn; 0: never draw it,
        not even where it is quicker.
    is_resident : returns which (n,) of the meshes (n,), numbers in `CookedParts`, can be drawn in this frame.
    error : geometric error that the mesh's level of detail may have, pixels, see `level`.
    texels : geometric error that it may have where finer levels have too many triangles, texels of the depth images;
        0: no more than `error`.
    triangles_per_pixel : how many triangles a mesh may have for each of its pixels.
    """

    magnification: float
    is_resident: IsResident
    error: float
    triangles_per_pixel: float
    texels: float = 0.0

    def allowed(
        self,
        fallbacks: MeshFallbacks,
        levels: MeshLevels,
        *,
        number: Rows,
        pixel_length: Array,
        pixels: Array,
        quicker: Mask | None = None,
    ) -> Mask:
        """Return which depth objects are replaced by a mesh that is resident.

        A mesh replaces depth objects that would be magnified, if a `level` of it has few triangles for its pixels;
        those for which it is quicker; and those that contain the viewer, if their images lack the interior.

        Parameters
        ----------
        fallbacks : which meshes show the same as which depth objects.
        levels : the levels of detail of the meshes that are loaded.
        number : (m,) numbers of the depth objects in `CookedParts`.
        pixel_length : (m,) length that a pixel covers at the nearest point of each object, metres in its frame.
        pixels : (m,) that each object covers, see `MeshFallbacks.pixels`.
        quicker : (m,) for which depth objects the mesh is quicker; None: for none.

        Returns
        -------
        (m,) whether each depth object is replaced.
        """
        found = np.zeros(len(number), bool)
        if not self.magnification:
            return found
        mesh, most = fallbacks.mesh[number], self.triangles_per_pixel * pixels
        magnified = (mesh >= 0) & (pixel_length * self.magnification < fallbacks.texel[number])
        triangles, is_read = fallbacks.triangles[mesh], levels.triangles[mesh, 0] > 0
        # Do not read a mesh that has too many triangles and no simplified levels that have fewer.
        magnified &= is_read | (triangles <= most) | (triangles > MOST_UNSIMPLIFIED)
        within = (mesh >= 0) & fallbacks.has_interior[number] & (pixel_length <= 0)
        quicker = within if quicker is None else quicker | within
        rows = np.flatnonzero(magnified | quicker)
        if not len(rows):
            return found
        rows = rows[self.is_resident(mesh[rows])]
        level = self.level(fallbacks, levels, mesh=mesh[rows], pixel_length=pixel_length[rows], pixels=pixels[rows])
        found[rows] = quicker[rows] | (levels.triangles[mesh[rows], level] <= most[rows])
        return found

    def level(
        self, fallbacks: MeshFallbacks, levels: MeshLevels, *, mesh: Rows, pixel_length: Array, pixels: Array
    ) -> Ints:
        """Return the level of detail at which each of m meshes replaces depth objects.

        That is the coarsest whose error is at most `error` pixels. If it has too many triangles, it is the finest that
        has few enough, as long as its error is at most `texels`: still more accurate than the depth images. Viewers
        within an asset see all of it.

        Parameters
        ----------
        fallbacks : which meshes show the same as which depth objects.
        levels : the levels of detail of the meshes that are loaded.
        mesh : (m,) numbers of the meshes in `CookedParts`.
        pixel_length : (m,) length that a pixel covers at the nearest point of each, metres in its frame.
        pixels : (m,) that each covers, see `MeshFallbacks.pixels`.

        Returns
        -------
        (m,) levels, 0 the finest.
        """
        level = error_level(levels.error[mesh], self.error * pixel_length)
        if not self.texels:
            return level
        accurate = error_level(levels.error[mesh], self.texels * fallbacks.texel[mesh])
        affordable = affordable_level(levels.triangles[mesh], pixels, self.triangles_per_pixel)
        coarser = np.maximum(level, np.minimum(affordable, accurate))
        return np.where(fallbacks.has_interior[mesh] & (pixel_length <= 0), level, coarser)

    def placed_levels(self, fallbacks: MeshFallbacks, levels: MeshLevels, view: View, meshes: Objects) -> Ints:
        """Return the `level` (m,) of each of m meshes that replace depth objects in a view.

        Parameters
        ----------
        fallbacks : which meshes show the same as which depth objects.
        levels : the levels of detail of the meshes that are loaded.
        view : the view of the picture.
        meshes : the meshes as objects, as `MeshFallbacks.meshes` returns them.
        """
        if not len(meshes):  # as in most frames
            return np.zeros(0, np.int64)
        mesh = meshes.asset
        viewer = viewer_in_object(view, meshes.position, meshes.rotation, meshes.scale)
        nearest = outside(viewer, fallbacks.centre[mesh], fallbacks.half_height[mesh], fallbacks.cylinder_radius[mesh])
        _, pixels = fallbacks.seen(view, mesh, nearest)
        return self.level(fallbacks, levels, mesh=mesh, pixel_length=nearest / view.detail_pixels, pixels=pixels)
