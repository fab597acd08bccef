"""What the HUD says of pixels: asked once a second, read some frames later."""

from typing import Self, cast

import numpy as np

from depthwalk.render.renderer import Renderer
from depthwalk.types import Rows
from depthwalk.walk.hud_rows import count_rows
from depthwalk.walk.shares import LateShares


class CountingRenderer:
    """Notes when it is asked, and when its answer is read."""

    def __init__(self) -> None:
        self.frame = 0
        self.asked: list[int] = []
        self.read: list[int] = []

    def sample_shares(self) -> Self:
        self.asked.append(self.frame)
        return self

    def count(self) -> Rows:
        self.read.append(self.frame)
        return np.array([3, 0, 1, 0, 0])


def test_an_answer_is_read_later_and_asked_for_once_a_second() -> None:
    renderer, late = CountingRenderer(), LateShares()
    for renderer.frame in range(29):
        late.update(cast(Renderer, renderer), 0.125)
        assert bool(late.latest) == (renderer.frame >= 6)  # the first picture does not wait for the question's shader
    assert (renderer.asked, renderer.read) == ([3, 14, 25], [6, 17, 28])
    assert late.latest.pop("share_captured") == 0.0
    assert late.latest == {"share_dpci": 0.75, "share_dmesh": 0.0, "share_mesh": 0.25, "share_height_fields": 0.0}


def test_the_hud_tells_shares_of_what_is_there() -> None:
    names = ("objects", "full_triangles", "occluded", "dpci", "warped", "warped_triangles", "assets")
    counts: dict[str, float] = dict.fromkeys(names, 0) | {"gpu_mb": 0.0, "atlas_used": 0.0, "tile_resolution": 1.0}
    assert "pixels" not in dict(count_rows(counts))
    shown = dict(count_rows(counts | {"share_dpci": 0.444, "share_dmesh": 0.0, "share_mesh": 0.556}))
    assert shown["pixels"] == "dpci 44%, mesh 56%"
