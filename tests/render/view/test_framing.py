"""Cameras that see all objects, and are no farther away than that takes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pyglm import glm

from depthwalk.geometry.quaternions import rotate
from depthwalk.render.view.bounds import Bounds
from depthwalk.render.view.framing import FRONT_RIGHT, camera_on, facing
from depthwalk.render.view.view import View
from depthwalk.scene.arrays import Camera, Objects, Representation
from depthwalk.types import Array

FOV = math.pi / 3
SHAPES = [
    np.array([[x, y, z] for x in (-2.0, 2.0) for y in (-0.5, 0.5) for z in (-0.1, 0.1)]),  # wide and flat
    np.array([[0.0, -1.0, 0.0], [0.0, 5.0, 0.0]]),  # a pole
    np.array([[-1.0, 0.0, -3.0], [1.0, 0.0, -3.0], [0.0, 0.0, 9.0]]),  # level, deep
]


def objects_of(numbers: list[int], seed: int) -> Objects:
    rng = np.random.default_rng(seed)
    turns = rng.normal(size=(len(numbers), 4))
    return Objects(
        asset=np.array(numbers),
        position=rng.uniform(-30, 30, (len(numbers), 3)).astype(np.float32),
        rotation=(turns / np.linalg.norm(turns, axis=1, keepdims=True)).astype(np.float32),
        scale=rng.uniform(0.2, 3, len(numbers)).astype(np.float32),
        representation=np.full(len(numbers), Representation.MESH),
    )


def on_screen(objects: Objects, camera: Camera, aspect: float) -> Array:
    """Where all points of the objects are in the picture, (n, 2) from -1 to 1; +inf behind the camera."""
    points = np.concatenate(
        [
            rotate(turn[None].astype(float), SHAPES[asset] * scale) + place
            for asset, turn, scale, place in zip(
                objects.asset, objects.rotation, objects.scale, objects.position, strict=True
            )
        ]
    )
    view = View(camera, (round(300 * aspect), 300))
    right, up, ahead = ((points - view.position) @ view.axes.T).T
    assert (ahead > 0).all()
    return np.stack([right, up], 1) / ahead[:, None] / view.half_extent


@pytest.mark.parametrize("aspect", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("away", [FRONT_RIGHT, glm.dvec3(3, 1, -2), glm.dvec3(0, 1, 0), glm.dvec3(0, -2, 1)])
@pytest.mark.parametrize("numbers", [[0], [1], [2], [0, 1, 2] * 40])
def test_what_is_framed_fills_the_picture(numbers: list[int], away: glm.dvec3, aspect: float) -> None:
    """All is seen, and reaches over nine tenths of the width or height, with as much room on either side.

    Poles that are seen end on fill less: no camera comes that near.
    """
    objects = objects_of(numbers, 7)
    radius = np.array([np.linalg.norm(shape, axis=1).max() for shape in SHAPES])
    bounds = Bounds(objects.position, (radius[objects.asset] * objects.scale).astype(np.float32))
    camera = camera_on(objects, bounds, SHAPES.__getitem__, aspect=aspect, fov=FOV, away=away)
    places = on_screen(objects, camera, aspect)
    assert np.abs(places).max() <= 0.9001
    filled = np.ptp(places, axis=0) / 2
    assert filled.max() > 0.899 or (len(numbers) == 1 and filled.max() > 0.2)
    if filled.max() > 0.899:
        assert np.abs(places[:, filled.argmax()]).max() == pytest.approx(0.9, abs=1e-3)
    assert glm.dot(glm.normalize(camera.look), glm.normalize(away)) == pytest.approx(-1)
    assert camera.fov == FOV


@pytest.mark.parametrize(
    ("size", "expected"),
    [
        ((3, 0, 2), (0, 1, 0.6)),
        ((3, 0.1, 2), (0, 1, 0.6)),
        ((0, 3, 2), (1, 0.25, 0)),
        ((3, 2, 0), (0, 0.25, 1)),
        ((3, 0.3, 2), (0.5, 0.4, 0.87)),  # not flat
        ((0.1, 3, 0.1), (0.5, 0.4, 0.87)),  # a pole
    ],
)
def test_a_flat_object_is_seen_from_its_broad_side(
    size: tuple[float, float, float], expected: tuple[float, float, float]
) -> None:
    points = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * size
    objects = replace(objects_of([0], 0), rotation=np.array([[0, 0, 0, 1]], np.float32))
    radius = np.linalg.norm(points, axis=1).max().astype(np.float32) * objects.scale
    direction = facing(objects, Bounds(objects.position, radius), lambda asset: points)
    assert tuple(direction) == expected


def test_a_flat_scene_is_seen_from_in_front_on_the_right() -> None:
    objects = objects_of([0, 0], 0)
    assert facing(objects, Bounds(objects.position, objects.scale), lambda asset: np.zeros((1, 3))) == FRONT_RIGHT


def test_without_objects_there_is_a_camera_all_the_same() -> None:
    nothing = objects_of([], 0)
    camera = camera_on(
        nothing, Bounds(np.zeros((0, 3)), np.zeros(0)), SHAPES.__getitem__, aspect=1.0, fov=FOV, away=FRONT_RIGHT
    )
    assert camera.position != camera.target
