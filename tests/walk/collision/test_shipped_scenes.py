"""Walks through the shipped scenes: they stop where something is, and only there."""

import math
import random
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from pyglm import glm

from barriers import go
from depthwalk.assets.library import SceneLibrary
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.render.view.view import View
from depthwalk.resources import scene_root
from depthwalk.scene.loader import load_scene
from depthwalk.scene.path import load_path
from depthwalk.walk.collision.body import RADIUS, Body
from depthwalk.walk.collision.collider_store import ColliderStore
from depthwalk.walk.collision.near_objects import NearObjects
from depthwalk.walk.collision.obstacles import Obstacles
from depthwalk.walk.collision.surroundings import Surroundings
from depthwalk.walk.controls import Walker

pytestmark = [pytest.mark.gl, pytest.mark.slow]
SIZE = 32, 24


@contextmanager
def near_objects(name: str) -> Iterator[tuple[NearObjects, Walker, float | None]]:
    """What is near a viewer of a shipped scene, that viewer, and the height of the ground."""
    scene = load_scene(scene_root() / f"{name}.yaml")
    library = SceneLibrary(scene.assets)
    store = ColliderStore(library)
    with HeadlessRenderer(scene, library, SIZE) as headless:
        near = NearObjects(headless.renderer, store)
        assert near.is_waiting and near.near(np.zeros(3), np.ones(3)) is None  # before the first frame
        assert scene.camera is not None
        headless.draw(View(scene.camera, SIZE))
        walker = Walker.at(scene.camera)
        walker.walking, walker.eye_height = True, walker.position.y
        try:
            yield near, walker, headless.renderer.world.ground_height
        finally:
            store.close()


def wait_for(near: NearObjects, around: Surroundings, feet: glm.dvec3) -> None:
    for _ in range(1000):
        around.update(np.array([feet.x, 0, feet.z]), 1.0, Body(eye_height=1.7))
        if not near.is_waiting:
            return
        time.sleep(0.01)
    raise AssertionError("colliders are not made")


def test_nobody_leaves_the_room_or_walks_through_its_table() -> None:
    with near_objects("room") as (near, walker, ground):
        assert ground is None
        obstacles, rng = Obstacles(near, ground), random.Random(1)
        wait_for(near, Surroundings(near), walker.position)
        walker.speed = 2.0
        farthest, ways = 0.0, []
        for _ in range(60):
            walker.yaw = rng.uniform(-math.pi, math.pi)
            way = go(obstacles, walker, 1.0, rate=30)
            ways.append(glm.distance(way[0], way[-1]))
            for place in way:
                farthest = max(farthest, abs(place.x))
                assert abs(place.x) < 3.0 - RADIUS + 0.02 and abs(place.z) < 3.0
                assert abs(complex(place.x, place.z) - (0.4 - 0.4j)) > 0.4 + RADIUS - 0.02
                assert place.y == pytest.approx(1.6, abs=1e-3)
        assert farthest > 2.7 and sorted(ways)[30] > 0.5


def test_the_tour_of_the_garden_meets_nothing() -> None:
    path = load_path(scene_root() / "paths" / "garden.yaml")
    with near_objects("garden") as (near, _, ground):
        around, body = Surroundings(near), Body(eye_height=1.7)
        assert ground == 0
        for moment in np.linspace(0, path.times[-1], 40):
            x, y, z = path.sample(float(moment)).position
            wait_for(near, around, glm.dvec3(x, y, z))
            assert len(around.outlines(0.0, body).near(complex(x, z), RADIUS)[0]) == 0
        wait_for(near, around, glm.dvec3(-5.6, 0, 28))
        assert len(around.outlines(0.0, body).near(-5.6 + 28j, 0.7)[0])  # the hedge
