"""The viewer for whom index buffers are sorted; the pictures are tested with the order itself."""

import numpy as np
import pytest

from depthwalk.geometry.bounding_hull import prism_corners
from depthwalk.render.impostors.tile_records import WARP_RECORD
from depthwalk.render.impostors.warp_planes import Volumes, choose_planes
from depthwalk.render.paper.ordered_indices import viewer_of


@pytest.mark.gl
def test_records_hold_the_viewer() -> None:
    rng = np.random.default_rng(8)
    one = np.ones(50)
    viewer = rng.normal(size=(50, 3)) * 4
    planes = choose_planes(
        viewer,
        Volumes(
            radius=0.5 * one,
            bottom=0 * one,
            top=one,
            hull=np.tile(prism_corners(np.full(4, 0.5), 0, 1), (50, 1, 1)),
            has_side=one > 0,
        ),
    )
    records = np.zeros(50, WARP_RECORD)
    records["right"] = np.column_stack([planes.right, planes.epipole[:, 0]])
    records["up"] = np.column_stack([planes.up, planes.epipole[:, 1]])
    records["normal"] = np.column_stack([planes.normal, planes.offset])
    records["depths"][:, 0] = planes.distance
    np.testing.assert_allclose([viewer_of(record) for record in records], viewer, atol=1e-5)
