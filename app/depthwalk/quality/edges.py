"""Measure what geometric anti-aliasing saves by skipping edges of a mesh that cannot be seen as lines.

Only silhouettes and creases are drawn, see `render.antialiasing.silhouette_lines`. The measurements are for `depthwalk
quality` and docs/anti-aliasing.md.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from depthwalk.assets.asset_files import read_mesh
from depthwalk.assets.mesh_library import Report
from depthwalk.geometry.adjacency import EdgeAdjacency, build_adjacency
from depthwalk.quality.rows import Row
from depthwalk.quality.views import FEW, Sphere, bounding_sphere, view_of
from depthwalk.render.antialiasing.silhouette_lines import silhouette_lines
from depthwalk.render.resources.placed_records import PLACED_RECORD
from depthwalk.scene.effect_settings import GpaaParams
from depthwalk.scene.scene import MeshAsset, Scene
from depthwalk.types import Array

Solid = tuple[Array, NDArray[np.intp]]
"""Vertices (v, 3), metres, and triangles (f, 3) of vertex numbers, counter-clockwise seen from outside."""

MOST_OF_CLOSED, MOST_OF_SHAPES = 0.5, 0.7  # lines drawn, relative to all edges drawn
MANY = 64  # objects of one mesh that are timed at once
REPEATS = 15  # of each timing per view, alternating; the least counts, since the rest is other load on the machine


@dataclass(frozen=True)
class Cost:
    """Hold the cost of finding the lines of a mesh: with all edges, then with the selected edges only.

    Attributes
    ----------
    lines
        (2,) float64, lines per view and object.
    outlines
        Number of lines per view and object that are silhouettes, which no selection may skip.
    milliseconds
        (2,) float64, time of one core per view: the least of `REPEATS` measurements, taken in turns.
    """

    lines: NDArray[np.float64]
    outlines: float
    milliseconds: NDArray[np.float64]


def cube() -> Solid:
    """Return a cube of edge 2 m: 8 vertices."""
    return convex(np.array(list(product((-1.0, 1.0), repeat=3))))


def wheel_cover() -> Solid:
    """Return a shallow disc, hub forward, whose rim has eight corners: 10 vertices."""
    angle = 2 * np.pi * np.arange(8) / 8
    rim = np.stack([np.cos(angle), np.sin(angle), 0 * angle], -1)
    return convex(np.concatenate([rim, [[0, 0, 0.35], [0, 0, -0.1]]]))


def wing() -> Solid:
    """Return a wing, tapered and swept back, of the section NACA 0012 with 22 points at either end: 44 vertices."""
    along = (1 - np.cos(np.pi * np.arange(12) / 11)) / 2  # denser towards both edges
    thickness = 0.6 * np.polyval([-0.1036, 0.2843, -0.3516, -0.126, 0], along) + 0.6 * 0.2969 * np.sqrt(along)
    upper, lower = (np.stack([along, side * thickness], -1) for side in (1, -1))
    section = np.concatenate([upper, lower[1:-1]])  # they share both ends
    root, tip = 2 * section - [1.5, 0], 1.1 * section - [0.1, 0]
    return convex(np.concatenate([np.insert(root, 2, -3, 1), np.insert(tip, 2, 3, 1)]))


def canopy() -> Solid:
    """Return the glass over a cockpit: half an ellipsoid three times as long as wide, closed below: 102 vertices."""
    slice_, around = np.meshgrid(np.pi * np.arange(1, 11) / 11, np.pi * np.arange(10) / 9, indexing="ij")
    across, up = 0.8 * np.sin(slice_) * np.cos(around), 0.8 * np.sin(slice_) * np.sin(around)
    dome = np.stack([across, up, 2.4 * np.cos(slice_)], -1).reshape(-1, 3)
    return convex(np.concatenate([dome, [[0, 0, 2.4], [0, 0, -2.4]]]) - [0, 0.3, 0])


def convex(positions: Array) -> Solid:
    """Return the convex solid with the vertices `positions` (v, 3), metres, around the origin, fronts outside."""
    hull = ConvexHull(positions)
    flip = np.linalg.det(positions[hull.simplices]) < 0
    return positions, np.where(flip[:, None], hull.simplices[:, ::-1], hull.simplices)


SHAPES: dict[str, Callable[[], Solid]] = {
    "cube, 8 vertices": cube,
    "wheel cover, 10": wheel_cover,
    "wing, 44": wing,
    "canopy, 102": canopy,
}
"""The models of the GPAA paper's table 1, with as many vertices."""


def examine_solids(size: tuple[int, int], report: Report) -> Iterator[Row]:
    """Measure what drawing only selected edges saves, in lines drawn and in time, for the solids in `SHAPES`.

    They are the models of the GPAA paper's table, and are measured with `MANY` objects of each at once.

    Parameters
    ----------
    size
        Width and height of the picture that lines are drawn into, pixels.
    report
        Called with the name of a solid and the stage that begins.

    Yields
    ------
    Row
        One measured value, relative to that of all edges: the lines drawn, or the time.
    """
    for name, shape in SHAPES.items():
        report(name, "edges")
        cost = shape_cost(shape, MANY, size)
        yield _drawn(name, cost, MOST_OF_SHAPES)
        _, share = _shares(cost)
        yield Row(
            subject=name,
            name=f"time, × all edges, of {MANY} objects",
            measured=share,
            goal=MOST_OF_SHAPES,
            more_is_better=False,
            digits=2,
        )


def examine(scenes: Sequence[Scene], size: tuple[int, int], report: Report) -> Iterator[Row]:
    """Measure how many lines drawing only selected edges saves, for the meshes of scenes, one by one; an `Examine`.

    Only closed meshes whose lines are drawn count. Rows hold the number of lines drawn as a part of all.
    """
    meshes = {asset.mesh: asset for scene in scenes for asset in scene.assets if isinstance(asset, MeshAsset)}
    for asset in meshes.values():
        report(asset.name, "edges")
        mesh = read_mesh(asset)
        edges = build_adjacency(mesh.positions, mesh.faces)
        if edges.open.any():
            continue
        cost = _cost(edges, bounding_sphere(mesh), 1, size)
        if cost.lines[0]:  # otherwise everything is silhouettes, and none are drawn
            yield _drawn(asset.name, cost, MOST_OF_CLOSED)


def shape_cost(shape: Callable[[], Solid], count: int, size: tuple[int, int]) -> Cost:
    """Measure the cost of the lines of a solid.

    Parameters
    ----------
    shape
        Creates the solid, one of `SHAPES`.
    count
        Number of objects that have its mesh, all at one place.
    size
        Width and height of the picture that lines are drawn into, pixels.

    Returns
    -------
    Cost
        The lines and the time for all edges and for the selected ones.
    """
    positions, triangles = shape()
    sphere = Sphere((0.0, 0.0, 0.0), float(np.linalg.norm(positions, axis=1).max()))
    return _cost(build_adjacency(positions, triangles), sphere, count, size)


def _cost(edges: EdgeAdjacency, sphere: Sphere, count: int, size: tuple[int, int]) -> Cost:
    """Measure `count` objects at one place, over the views `FEW`."""
    creases = None, float(np.radians(GpaaParams().crease_angle))
    lines, rims, seconds = np.zeros(2), 0.0, np.full((len(FEW), 2), np.inf)
    for viewpoint, least in zip(FEW, seconds, strict=True):
        view = view_of(sphere, viewpoint, size)
        placed = np.zeros(count, PLACED_RECORD)
        placed["origin"], placed["rotation"], placed["scale"] = -view.position, (0, 0, 0, 1), 1
        found = [silhouette_lines(edges, view, placed, crease, solid=True) for crease in creases]
        lines += [len(records) for records in found]
        rims += float(found[-1]["silhouette"].sum())
        for _ in range(REPEATS):
            for column, crease in enumerate(creases):
                start = time.process_time()
                silhouette_lines(edges, view, placed, crease, solid=True)
                least[column] = min(least[column], time.process_time() - start)
    pictured = len(FEW) * count
    return Cost(lines / pictured, rims / pictured, seconds.mean(0) * 1e3)


def _shares(cost: Cost) -> tuple[float, float]:
    """Return the ratio of the selected edges' lines, and time, to those of all edges."""
    return float(cost.lines[1] / cost.lines[0]), float(cost.milliseconds[1] / cost.milliseconds[0])


def _drawn(name: str, cost: Cost, goal: float) -> Row:
    share, spent = _shares(cost)
    (every, chosen), (every_ms, chosen_ms) = cost.lines.tolist(), cost.milliseconds.tolist()
    details = {"all": every, "chosen": chosen, "outlines": cost.outlines}
    details |= {"all, ms": every_ms, "chosen, ms": chosen_ms, "time, ×": spent}
    return Row(
        subject=name,
        name="lines drawn, × all edges",
        measured=share,
        goal=goal,
        more_is_better=False,
        digits=2,
        details=details,
    )
