"""How far a shadow map may lie from where it should, while a newer one is drawn (`ShadowMap.follows`)."""

import numpy as np
import pytest

from depthwalk.render.draw.draw_lists import DrawList
from depthwalk.render.resources.placed_records import PLACED_RECORD
from depthwalk.render.shadows.cascades import DEPTH, Cascade, light_axes
from depthwalk.render.shadows.casters import LightView, ShadowMap
from depthwalk.render.shadows.spot_maps import Spot

AXES = light_axes(np.array([0.4, 0.8, -0.3]))
NOTHING = DrawList(records=np.zeros(0, PLACED_RECORD))
HALF = 10.0  # metres


def map_of(view: LightView) -> ShadowMap:
    return ShadowMap(view=view, grids=NOTHING, meshes=NOTHING)


def cascade(right: float = 0.0, up: float = 0.0, toward: float = 0.0, half: float = HALF) -> Cascade:
    """A map of the sun whose middle is moved by so many metres along its axes."""
    x, y, z = (np.array([right, up, toward]) @ AXES).tolist()
    return Cascade(centre=(x, y, z), half=half, axes=AXES, resolution=64)


@pytest.mark.parametrize(
    ("right", "up", "toward", "expected"),
    [
        (0.9 * HALF, -0.9 * HALF, 0, True),
        (1.1 * HALF, 0, 0, False),
        (0, -1.1 * HALF, 0, False),
        (0, 0, 0.9 * DEPTH * HALF, True),
        (0, 0, -1.1 * DEPTH * HALF, False),
    ],
)
def test_a_map_may_lag_behind_by_half_its_size(right: float, up: float, toward: float, expected: bool) -> None:
    """Else the viewer has left what it shows, and stands where nothing has a shadow until it is drawn again."""
    before, now = map_of(cascade()), map_of(cascade(right, up, toward))
    assert now.follows(before) is expected
    assert now.follows(before, from_afar=True)  # where the next map reaches him


def test_a_map_of_another_sun_size_or_lamp_is_never_shown_instead() -> None:
    """Else shadows point elsewhere, or are cut off, for some frames."""
    now = map_of(cascade())
    turned = Cascade(centre=(0.0, 0.0, 0.0), half=HALF, axes=light_axes(np.array([0.4, 0.8, 0.3])), resolution=64)
    lamp = Spot(centre=(0.0, 3.0, 0.0), axes=AXES, angle=0.7, reach=9.0, resolution=64)
    for before in (turned, cascade(half=2 * HALF), lamp):
        assert not now.follows(map_of(before), from_afar=True)
    assert not map_of(lamp).follows(map_of(lamp), from_afar=True)
