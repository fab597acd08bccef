"""What the HUD says of pixels: asked once a second, read some frames later."""

import numpy as np

from depthwalk.walk.hud import count_rows
from depthwalk.walk.shares import LateShares


class CountingRenderer:
    """Notes when it is asked, and when its answer is read."""

    def __init__(self):
        self.frame, self.asked, self.read = 0, [], []

    def sample_shares(self):
        self.asked.append(self.frame)
        return self

    def count(self):
        self.read.append(self.frame)
        return np.array([3, 0, 1])


def test_an_answer_is_read_later_and_asked_for_once_a_second():
    renderer, late = CountingRenderer(), LateShares()
    for renderer.frame in range(26):
        late.update(renderer, 0.125)
        assert bool(late.latest) == (renderer.frame >= 3)
    assert (renderer.asked, renderer.read) == ([0, 11, 22], [3, 14, 25])
    assert late.latest == {"share_dpci": 0.75, "share_dmesh": 0.0, "share_mesh": 0.25}


def test_the_hud_tells_shares_of_what_is_there():
    counts = dict.fromkeys(("objects", "occluded", "dpci", "warped", "warped_triangles", "assets"), 0)
    counts |= {"gpu_mb": 0.0, "atlas_used": 0.0, "tile_resolution": 1.0}
    assert "of pixels" not in dict(count_rows(counts))
    shown = dict(count_rows(counts | {"share_dpci": 0.444, "share_dmesh": 0.0, "share_mesh": 0.556}))
    assert shown["of pixels"] == "dpci 44%, mesh 56%"
