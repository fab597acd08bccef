"""Boxes, sheets and rooms as colliders, and a walker among them, without a renderer."""

from collections.abc import Sequence

import numpy as np
from pyglm import glm

from depthwalk.types import Array
from depthwalk.walk.collision.collider import Collider, collider
from depthwalk.walk.collision.obstacles import Obstacles
from depthwalk.walk.collision.placed_collider import PlacedCollider
from depthwalk.walk.controls import Move, Walker

_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
_QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]  # outward
_FACES = np.array([face for a, b, c, d in _QUADS for face in ((a, b, c), (a, c, d))])


def box(low: Sequence[float], high: Sequence[float], inward: bool = False) -> Collider:
    """A closed box; `inward`: a room, whose walls face its inside."""
    return collider(np.array(low) + _CORNERS * np.subtract(high, low), _FACES[:, ::-1] if inward else _FACES)


def sheet(*points: Sequence[float]) -> Collider:
    """An open quadrilateral."""
    return collider(np.array(points, float), np.array([(0, 1, 2), (0, 2, 3)]))


def place(
    surface: Collider,
    position: Sequence[float] = (0, 0, 0),
    yaw: float = 0.0,
    scale: float = 1.0,
    row: int = 0,
    roll: float = 0.0,
) -> PlacedCollider:
    """A surface at a place, turned about z by `roll` and then about the upright axis by `yaw`, radians."""
    (cos, sin), (cos_roll, sin_roll) = ((np.cos(angle), np.sin(angle)) for angle in (yaw, roll))
    about_y = np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]])
    turn = about_y @ [[cos_roll, -sin_roll, 0], [sin_roll, cos_roll, 0], [0, 0, 1]]
    return PlacedCollider(row=row, collider=surface, position=np.array(position, float), rotation=turn, scale=scale)


class Barriers:
    """Knows all of its objects, near or not."""

    def __init__(self, *surfaces: Collider | PlacedCollider) -> None:
        self.placed = [place(each) if isinstance(each, Collider) else each for each in surfaces]
        self.changes = 0
        self.is_waiting = False
        self.asked = 0

    @property
    def version(self) -> tuple[int, ...]:
        return (self.changes,)

    def near(self, low: Array, high: Array) -> list[PlacedCollider] | None:
        self.asked += 1
        return [
            PlacedCollider(
                row=row, collider=each.collider, position=each.position, rotation=each.rotation, scale=each.scale
            )
            for row, each in enumerate(self.placed)
        ]


def walker(x: float = 0.0, z: float = 0.0, toward: float = 0.0, speed: float = 1.5, feet: float = 0.0) -> Walker:
    """A viewer on the ground who looks along −z, or turned to the right by `toward` degrees."""
    position = glm.dvec3(x, feet + 1.7, z)
    return Walker(position, -np.radians(toward), 0.0, 1.0, speed=speed, walking=True)


def go(among: Obstacles, who: Walker, seconds: float, *, rate: float = 60.0, fast: bool = False) -> list[glm.dvec3]:
    """Walks ahead, and returns where the viewer was after each frame."""
    way = []
    for _ in range(round(seconds * rate)):
        among.walk(who, {Move.FORWARD: 1 / rate}, 1 / rate, fast=fast)
        way.append(glm.dvec3(who.position))
    return way


def among(*surfaces: Collider | PlacedCollider, ground: float | None = 0.0) -> Obstacles:
    """What stops a viewer between these surfaces."""
    return Obstacles(Barriers(*surfaces), ground)
