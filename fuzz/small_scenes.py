"""Describe small scenes, which other modules write as files of several formats, for fuzzing and for tests."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fuzz.case import Files

Vector = tuple[float, float, float]

Y_FROM_Z = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])


@dataclass(frozen=True, kw_only=True)
class Paint:
    """A material: linear colour, or a picture by its name."""

    name: str
    colour: Vector = (0.8, 0.8, 0.8)
    picture: str | None = None
    opacity: float = 1.0
    specular: float = 0.0
    exponent: float = 32.0
    emission: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class Shape:
    """A mesh: vertices (V, 3), polygons of their numbers, and what their corners (C) have, one after the other."""

    positions: NDArray[np.float64]
    polygons: list[list[int]]
    normals: NDArray[np.float64] | None = None
    uv: NDArray[np.float64] | None = None
    colours: NDArray[np.float64] | None = None

    @property
    def vertex(self) -> NDArray[np.int64]:
        """Return the vertex of each corner (C,)."""
        return np.concatenate([np.array(each, np.int64) for each in self.polygons])

    @property
    def sizes(self) -> list[int]:
        """Return the number of corners of each polygon."""
        return [len(each) for each in self.polygons]


@dataclass(frozen=True, kw_only=True)
class Use:
    """A node that shows a mesh: scaled, then turned about x, y and z, in degrees, then moved."""

    name: str
    shape: Shape
    paint: Paint
    moved: Vector = (0, 0, 0)
    turned: Vector = (0, 0, 0)
    scaled: Vector = (1, 1, 1)

    @property
    def matrix(self) -> NDArray[np.float64]:
        """Return the scene_from_mesh matrix (4, 4)."""
        matrix = np.diag([*self.scaled, 1.0])
        for axis, degrees in enumerate(self.turned):
            turn, one, two = np.eye(4), (axis + 1) % 3, (axis + 2) % 3
            cosine, sine = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
            turn[one, one] = turn[two, two] = cosine
            turn[one, two], turn[two, one] = -sine, sine
            matrix = turn @ matrix
        matrix[:3, 3] = self.moved
        return matrix


def cube() -> Shape:
    """Return a cube from −1 to 1 of quadrangles, each with the whole picture, and colours by the place."""
    positions = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)
    polygons = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    normals = np.repeat(np.array([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1.0]]), 4, axis=0)
    uv = np.tile([[0, 0], [1, 0], [1, 1], [0, 1.0]], (6, 1))
    corners = np.concatenate([np.array(each) for each in polygons])
    return Shape(positions=positions, polygons=polygons, normals=normals, uv=uv, colours=positions[corners] / 2 + 0.5)


def distinct(uses: list[Use]) -> tuple[list[Shape], list[Paint]]:
    shapes = list({id(use.shape): use.shape for use in uses}.values())
    return shapes, list({use.paint.name: use.paint for use in uses}.values())


def words_of(values: Any) -> str:
    return " ".join(f"{value:.9g}" for value in np.asarray(values).ravel().tolist())


def fans(shape: Shape) -> NDArray[np.int64]:
    starts = np.cumsum(shape.sizes) - shape.sizes
    return np.array(
        [
            (start, start + k, start + k + 1)
            for start, size in zip(starts, shape.sizes, strict=True)
            for k in range(1, size - 1)
        ]
    )


def obj(uses: list[Use], pictures: Files) -> Files:
    """Return an OBJ file with its library and pictures; nodes are applied."""
    lines, base, corner = ["mtllib scene.mtl"], 1, 1
    for use in uses:
        shape, linear = use.shape, use.matrix[:3, :3]
        lines += [f"v {words_of(place)}" for place in shape.positions @ linear.T + use.matrix[:3, 3]]
        assert shape.normals is not None and shape.uv is not None
        lines += [f"vn {words_of(normal)}" for normal in shape.normals @ np.linalg.inv(linear)]
        lines += [f"vt {words_of(place)}" for place in shape.uv]
        lines.append(f"usemtl {use.paint.name}")
        for polygon in shape.polygons:
            words = [f"{vertex + base}/{corner + k}/{corner + k}" for k, vertex in enumerate(polygon)]
            turned = words if np.linalg.det(linear) > 0 else [words[0], *reversed(words[1:])]  # the same diagonal
            lines.append("f " + " ".join(turned))
            corner += len(polygon)
        base += len(shape.positions)
    library = []
    for paint in distinct(uses)[1]:
        library += [
            f"newmtl {paint.name}",
            f"Kd {words_of((1, 1, 1) if paint.picture else paint.colour)}",
            f"d {paint.opacity}",
        ]
        library += [f"Ks {words_of([paint.specular] * 3)}", f"Ns {paint.exponent}", f"Ke {words_of(paint.emission)}"]
        library += [f"map_Kd {paint.picture}"] if paint.picture else []
    return {"scene.obj": "\n".join(lines).encode(), "scene.mtl": "\n".join(library).encode(), **pictures}
