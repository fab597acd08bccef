"""When a mesh is drawn in place of depth images, and how fine it is."""

import numpy as np
import pytest

from depthwalk.ingest.mesh import MeshLevel
from depthwalk.render.lod.fallback_rule import MeshFallbackRule
from depthwalk.render.lod.mesh_fallback import MeshFallbacks
from depthwalk.render.lod.mesh_lod import MeshLevels
from shapes import sphere


@pytest.mark.parametrize(
    ("texels", "nearest", "interior", "level"),
    [
        (0.0, 0.1, False, 0),  # none coarser than what a pixel allows
        (0.5, 0.1, False, 2),  # few enough, and within half a texel
        (0.2, 0.1, False, 1),  # still too many, but the next is not accurate
        (0.5, 0.0, True, 0),  # a room, from within
    ],
)
def test_meshes_that_stand_in_are_as_fine_as_their_pixels_allow(
    texels: float, nearest: float, interior: bool, level: int
) -> None:
    fallbacks, levels = MeshFallbacks.empty(1), MeshLevels.empty(1)
    fallbacks.texel[0], fallbacks.has_interior[0] = 1.0, interior
    levels.error[0, :4], levels.triangles[0, :4] = (0, 0.1, 0.4, 0.9), (1000, 300, 80, 20)
    rule = MeshFallbackRule(
        magnification=1.0, is_resident=lambda rows: rows == rows, error=0.5, triangles_per_pixel=1.0, texels=texels
    )
    mesh, pixels = np.zeros(1, np.int64), np.full(1, 100.0)
    found = rule.level(fallbacks, levels, mesh=mesh, pixel_length=np.full(1, nearest), pixels=pixels)
    assert found.tolist() == [level]


def test_a_mesh_stands_in_for_as_many_triangles_as_are_quicker() -> None:
    dense = sphere(0.5, columns=64, rows=32)
    of = MeshLevels.empty(2)
    of.add(0, (MeshLevel(dense, 0.0),))
    fallbacks = MeshFallbacks.empty(2)
    fallbacks.mesh[1], fallbacks.texel[1], fallbacks.triangles[0] = 0, 1.0, len(dense.faces)
    rule = MeshFallbackRule(
        magnification=1.0, is_resident=lambda rows: np.ones(len(rows), bool), error=1.0, triangles_per_pixel=0.8
    )
    pixels = np.array([0.9, 1.1]) * len(dense.faces) / rule.triangles_per_pixel
    found = rule.allowed(fallbacks, of, number=np.array([1, 1]), pixel_length=np.full(2, 0.1), pixels=pixels)
    assert found.tolist() == [False, True]
