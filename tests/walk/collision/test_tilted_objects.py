"""Walks against objects of a scene that have fallen or lean, as the renderer places them."""

import time
from pathlib import Path

import numpy as np
import pytest

import shapes
from barriers import go, walker
from depthwalk.assets.library import SceneLibrary
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.scene.loader import load_scene
from depthwalk.walk.collision.body import RADIUS
from depthwalk.walk.collision.collider_store import ColliderStore
from depthwalk.walk.collision.near_objects import NearObjects
from depthwalk.walk.collision.obstacles import Obstacles
from files import write_ply

pytestmark = [pytest.mark.gl, pytest.mark.usefixtures("gl_device")]
SIZE = 32, 24
SCENE = """
version: 1
assets: {{column: {{mesh: column.ply, dpci: {{resolution: 64, layers: 1}}}}}}
objects:
  - {{asset: column, position: [2, 0.4, -3], roll: 90, representation: {representation}}}
  - group:
      position: [0, 6, -6]
      pitch: 180
      objects: [{{asset: column, representation: {representation}}}]
environment: {{ground: {{}}}}
camera: {{position: [0, 1.7, 4], target: [0, 1, -3]}}
"""


@pytest.mark.parametrize("representation", ["mesh", "dpci"])
def test_a_fallen_column_stops_and_one_that_hangs_does_not(tmp_path: Path, representation: str) -> None:
    """The one lies from x = 2 to −2; the other hangs from a height of 6 m down to 2 m."""
    write_ply(tmp_path / "column.ply", shapes.box(0.8, 4.0, 0.8, (0.0, 2.0, 0.0)))
    (tmp_path / "scene.yaml").write_text(SCENE.format(representation=representation))
    scene = load_scene(tmp_path / "scene.yaml")
    library = SceneLibrary(scene.assets)
    store = ColliderStore(library)
    with HeadlessRenderer(scene, library, SIZE) as headless:
        assert scene.camera is not None
        headless.draw(View(scene.camera, SIZE))
        near = NearObjects(headless.renderer, store)
        try:
            end = time.monotonic() + 60
            while near.near(np.array([-3.0, 0, -7]), np.array([3.0, 2, 0])) is None or near.is_waiting:
                assert near.version and time.monotonic() < end, "colliders are not made"
                time.sleep(0.01)
            against, beside, under = walker(x=-1.5), walker(x=3.0), walker(z=-4.5)
            for who in (against, beside, under):
                go(Obstacles(near, 0.0), who, 4.0)
        finally:
            store.close()
    assert against.position.z == pytest.approx(-3 + 0.4 + RADIUS, abs=0.03)
    assert beside.position.z < -5 and under.position.z < -9
