"""Tiles of the atlas are emptied before they are drawn, and only those."""

from types import SimpleNamespace

import numpy as np

from alone import MakeAlone
from depthwalk.render.draw.draw_lists import DrawList
from depthwalk.render.impostors.tile_records import WARP_RECORD
from depthwalk.render.passes.warp import WarpPass
from depthwalk.scene.object_settings import WarpParams


def test_slots_are_emptied_and_others_stay(alone: MakeAlone) -> None:
    warp = alone(WarpPass())
    targets = warp.targets
    targets.atlas.clear(depth=0.5)
    slots = np.array([[4, 8, 16, 12], [100, 50, 10, 20]], np.float32)  # x, y, width, height
    plan = SimpleNamespace(cleared=slots, warp=DrawList(records=np.zeros(0, WARP_RECORD)))
    warp.draw(WarpParams(), plan=plan)
    depth = np.frombuffer(targets.atlas_depth.read(), np.float32).reshape(targets.atlas_size[::-1])
    expected = np.full_like(depth, 0.5)
    for x, y, width, height in slots.astype(int).tolist():
        expected[y : y + height, x : x + width] = 1.0
    np.testing.assert_allclose(depth, expected, atol=1e-6)
