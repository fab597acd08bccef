"""The uniforms of the sun's maps lead from the viewer to the texel that the matrix leads to."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from moderngl import Texture

from depthwalk.render.shadows.cascades import fit_cascades
from depthwalk.render.shadows.sun_uniforms import SunMaps
from depthwalk.render.view.view import View, matrix_array
from depthwalk.scene.arrays import Camera
from depthwalk.scene.effect_settings import MAX_CASCADES, ShadowParams
from depthwalk.scene.object_settings import LodParams


def test_uniforms_find_points_as_the_matrix_does() -> None:
    view = View(Camera((30.0, 2.0, -3.0), (4.0, 1.0, -2.0), 1.0), (320, 200), near=0.2, far=60.0)
    params = ShadowParams(enabled=True, cascades=3)
    cascades = fit_cascades(view, np.array([0.4, 0.8, -0.3]), params)
    texture = cast(Texture, SimpleNamespace())
    uniforms = SunMaps(texture=texture, cascades=cascades, params=params).uniforms(view, LodParams())
    assert uniforms["cascades"] == 3
    places = np.frombuffer(uniforms["places"], np.float32).reshape(MAX_CASCADES, 4)
    assert (places[3:] == 0).all()
    light_from_world = np.reshape(uniforms["light_from_world"], (3, 3)).T
    point = np.array([28.0, 1.0, -2.5])
    for place, cascade in zip(places, cascades, strict=False):
        found = light_from_world @ (point - view.position) * place[3] + place[:3]
        clip = matrix_array(cascade.clip_from_centre)[:3, :3] @ (point - cascade.centre)
        assert found[:2] == pytest.approx(clip[:2] / 2 + 0.5, abs=1e-4)
