"""Measure the cost of an object by triangles, number of objects and pixels: curves that the paper does not show.

The object is the Venus of table 1, 67,170 triangles. Its simplified levels have fewer triangles; for more, each
triangle is divided into equal parts, so that the surface stays the same.
"""

import hashlib
import math
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from depthwalk.assets.library import SceneLibrary
from depthwalk.assets.mesh_library import Report
from depthwalk.bench.object_cost import COMPARED, ObjectCosts, crossings, frame_costs, row_of
from depthwalk.bench.tables.table import Cell, Curves, Table
from depthwalk.bench.tables.walks import past
from depthwalk.cook import kernels as building
from depthwalk.ingest.mesh import Mesh
from depthwalk.render import kernels
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.resources import scene_root
from depthwalk.scene.arrays import Representation
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import Scene
from depthwalk.types import Ints

SIZE = 1024, 768
FRAMES = 8
TRIANGLES = 1_100_000  # largest number in the curve over triangles
HEIGHTS = 600, 300, 150, 75, 38, 19, 9  # pixels
MIDDLE = 200  # pixels, height of the object while the number of triangles varies
COUNTS = 1, 10, 100, 1000, 10_000, 100_000
SPACING = 2.5  # metres between objects, while their number varies
SLOW = 1500.0  # milliseconds: slower ways are not measured with more objects or triangles
_CLUSTERED = 1_100_000  # triangles; without compiled loops, building clusters of more takes minutes
_SIDES = ((0, 1), (1, 2), (2, 0))  # corners of a triangle
_SOURCE = "Not in the paper, which compares two heads of fixed size"
_TIMES = (
    "With a software rasteriser, processor time of all threads; otherwise wall-clock time. Means over the frames of a "
    "walk, in which all representations alternate, minus the time of a frame without objects."
)


def over_triangles(report: Report, most: int = TRIANGLES) -> Table:
    """Measure the cost of an object by the number of its triangles.

    Parameters
    ----------
    report
        Called with a name and the stage that begins.
    most
        The largest number of triangles.

    Returns
    -------
    Table
        A row for each number of triangles, from about 1000 on.

    Raises
    ------
    GpuError
        If no OpenGL 3.3 context can be created.
    """
    kernels.load()
    scene = _scene()
    meshes = _series(SceneLibrary(scene.assets, report), most)
    x, columns, slow = [], _empty_columns(), set[Representation]()
    for mesh in meshes:
        count = len(mesh.faces)
        report("venus", f"{count:,} triangles")
        library = SceneLibrary(scene.assets, report)
        library.take_mesh(0, mesh, hashlib.sha256(mesh.positions.tobytes()).hexdigest())
        left = [kind for kind in COMPARED if kind not in slow]
        if count > _CLUSTERED and not building.load():
            left = [kind for kind in left if kind is not Representation.MESH_CLUSTERS]
        found = ObjectCosts(scene, 0, library, SIZE, left, judged=False).measured(MIDDLE, FRAMES).by
        x.append(float(count))
        for kind in COMPARED:
            cost = found[kind].milliseconds if kind in found else None
            columns[kind.label].append(cost)
            if cost is not None and cost > SLOW:
                slow.add(kind)
    return _table(
        "triangles", "Time per object, by the triangles of its mesh", "triangles", x, columns, "ms per object"
    )


def over_objects(report: Report, counts: Sequence[int] = COUNTS) -> Table:
    """Measure the cost of a frame by its number of objects, in a square that a visitor walks along.

    `report` is called with a name and the stage that begins; `counts` are the numbers of objects.
    """
    kernels.load()
    scene = _scene()
    x, columns, slow = [], _empty_columns(), set[Representation]()
    cameras = past((0.0, 0.9, -2.0), 4.0)[:FRAMES]
    for count in counts:
        report("venus", f"{count:,} objects")
        crowd = _square(scene, count)
        with ExitStack() as opened:
            library = SceneLibrary(scene.assets, report)
            empty = replace(crowd, objects=crowd.objects.take(slice(0)))
            drawn = {"": opened.enter_context(HeadlessRenderer(empty, library, SIZE, Representation.MESH))}
            for kind in COMPARED:
                if kind not in slow:
                    drawn[kind.label] = opened.enter_context(HeadlessRenderer(crowd, library, SIZE, kind))
                    drawn[kind.label].renderer.remembers = True
            times = frame_costs(drawn, cameras)
        x.append(float(count))
        for kind in COMPARED:
            cost = float(np.mean(times[kind.label] - times[""])) if kind.label in times else None
            columns[kind.label].append(cost)
            if cost is not None and cost > SLOW:
                slow.add(kind)
    return _table("objects", "Time per frame, by the number of objects", "objects", x, columns, "ms per frame")


def over_pixels(report: Report, heights: Sequence[float] = HEIGHTS) -> Table:
    """Measure the cost and the quality of an object by the number of pixels that it covers.

    `report` is called with a name and the stage that begins; `heights` are those of the object, pixels, descending.
    """
    kernels.load()
    scene = _scene()
    costs = ObjectCosts(scene, 0, SceneLibrary(scene.assets, report), SIZE)
    x, columns, flips = [], _empty_columns(), _empty_columns()
    for height in reversed(heights):
        report("venus", f"{height} pixels high")
        found = costs.measured(height, FRAMES)
        assert found.covered is not None  # it is judged
        x.append(round(found.covered))
        for kind, cost in found.by.items():
            columns[kind.label].append(cost.milliseconds)
            flips[kind.label].append(cost.flip)
    table = _table("pixels", "Time per object, by the pixels that it covers", "pixels", x, columns, "ms per object")
    return replace(
        table,
        columns=(*table.columns, *(f"{name}: FLIP" for name in flips)),
        rows=tuple((*row, *(column[k] for column in flips.values())) for k, row in enumerate(table.rows)),
        notes=(
            *table.notes,
            "FLIP: compared with the mesh at 16 samples per pixel, where either shows the object.",
        ),
    )


def _scene() -> Scene:
    """Return the scene of table 1, of which only the first asset is used."""
    scene = load_scene(scene_root() / "paper" / "table-1-heads.yaml")
    return replace(scene, assets=scene.assets[:1])


def _square(scene: Scene, count: int) -> Scene:
    """Return the scene with `count` copies of its asset in a square that begins at the origin and goes toward −z."""
    row = row_of(scene, 0, count, 1.0)
    side = int(np.ceil(np.sqrt(count)))
    number = np.arange(count)
    position = np.zeros((count, 3), np.float32)
    position[:, 0], position[:, 2] = (number % side - (side - 1) / 2) * SPACING, -(number // side) * SPACING
    return replace(row, objects=replace(row.objects, position=position))


def _series(library: SceneLibrary, most: int) -> list[Mesh]:
    """Return the mesh, its simplified levels of about 1000 triangles and more, and finer ones; the coarsest first."""
    mesh, *levels = (level.mesh for level in library.mesh_levels(0))
    meshes = [level for level in reversed(levels) if 1000 <= len(level.faces) <= most]
    if len(mesh.faces) <= most:
        meshes.append(mesh)
        meshes += [subdivided(mesh, parts) for parts in _parts(math.isqrt(most // len(mesh.faces)))]
    return meshes


def _parts(most: int) -> list[int]:
    """Return numbers of parts into which to divide edges: 2, 4, 8 and so on, and `most` if that is not larger."""
    doubled = [2**power for power in range(1, most.bit_length())]
    return sorted({*doubled, most} - {0, 1})


def subdivided(mesh: Mesh, parts: int = 2) -> Mesh:
    """Divide the edges of a mesh into equal parts, and so each triangle into `parts`², without changing the surface.

    Triangles that share an edge share the vertices on it: otherwise every edge would be a seam, which cannot be
    simplified. The mesh may have at most 2³² vertices.
    """
    corner, inner = _lattice(parts)
    ends = np.sort(mesh.faces[:, _SIDES].astype(np.uint64), axis=2)
    edges, edge = np.unique(ends[..., 0] << np.uint64(32) | ends[..., 1], return_inverse=True)
    starts, stops = (edges >> np.uint64(32)).astype(np.intp), (edges & np.uint64(2**32 - 1)).astype(np.intp)
    along = np.arange(1, parts) / parts

    def divided(values: NDArray[np.generic]) -> NDArray[np.float32]:
        own = values.astype(np.float32)
        on_edges = own[starts, None] * (1 - along)[:, None] + own[stops, None] * along[:, None]
        within = np.einsum("kc,fcd->fkd", inner / parts, own[mesh.faces])
        return np.concatenate([own, *(some.reshape(-1, own.shape[1]) for some in (on_edges, within))], dtype=np.float32)

    normals, count = divided(mesh.normals), parts**2
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return replace(
        mesh,
        positions=divided(mesh.positions),
        normals=normals / np.maximum(length, np.float32(1e-20)),
        colours=divided(mesh.colours).round().astype(np.uint8),
        uv=divided(mesh.uv),
        faces=_lattice_vertices(mesh, edge.reshape(-1, 3), parts, len(inner))[:, corner].reshape(-1, 3),
        parts=tuple(
            replace(part, first_face=count * part.first_face, face_count=count * part.face_count) for part in mesh.parts
        ),
    )


def _lattice(parts: int) -> tuple[Ints, Ints]:
    """Divide a triangle into parts² equal ones.

    Returns their corners, (parts², 3), as rows of the triangle's own corners, the points on its three sides and those
    inside; and of the latter `parts` times their barycentric coordinates (n, 3).
    """
    own = [tuple(parts * (k == corner) for k in range(3)) for corner in range(3)]
    sides = [
        tuple((parts - step) * (k == one) + step * (k == other) for k in range(3))
        for one, other in _SIDES
        for step in range(1, parts)
    ]
    inner = [(parts - i - j, i, j) for i in range(1, parts) for j in range(1, parts - i)]
    number = {place: row for row, place in enumerate([*own, *sides, *inner])}

    def row(i: int, j: int) -> int:
        return number[parts - i - j, i, j]

    upward = [(row(i, j), row(i + 1, j), row(i, j + 1)) for i in range(parts) for j in range(parts - i)]
    downward = [(row(i + 1, j), row(i + 1, j + 1), row(i, j + 1)) for i in range(parts) for j in range(parts - i - 1)]
    return np.array(upward + downward), np.array(inner, np.int64).reshape(-1, 3)


def _lattice_vertices(mesh: Mesh, edge: Ints, parts: int, inner: int) -> NDArray[np.int32]:
    """Return the vertices (f, n) of the lattice in each triangle of a mesh, in the order of `_lattice`.

    edge: (f, 3) number of the edge at each side of `_SIDES`; inner: points within each triangle.
    """
    faces, step = mesh.faces, np.arange(parts - 1)
    backward = faces[:, [one for one, _ in _SIDES]] > faces[:, [other for _, other in _SIDES]]
    on_edge = np.where(backward[..., None], step[::-1], step) + (len(mesh.positions) + (parts - 1) * edge)[..., None]
    first = len(mesh.positions) + (parts - 1) * (int(edge.max()) + 1)
    within = first + np.arange(inner * len(faces)).reshape(len(faces), inner)
    return np.concatenate([faces, on_edge.reshape(len(faces), -1), within], axis=1).astype(np.int32)


def _empty_columns() -> dict[str, list[float | None]]:
    return {kind.label: [] for kind in COMPARED}


def _table(
    name: str, title: str, unit: str, x: Sequence[float], columns: Mapping[str, Sequence[float | None]], of: str
) -> Table:
    """Return a table of (n,) `columns` over `x`, with the crossings of depth images and meshes as notes."""
    rows: list[tuple[Cell, ...]] = [
        (f"{value:,.0f}", *(column[k] for column in columns.values())) for k, value in enumerate(x)
    ]
    return Table(
        name=name,
        title=title,
        source=_SOURCE,
        columns=(unit, *(f"{label}, {of}" for label in columns)),
        rows=tuple(rows),
        notes=(_TIMES, *_crossing_notes(unit, x, columns)),
        curves=Curves(
            label=unit,
            x=tuple(x),
            columns={label: tuple(value or None for value in column) for label, column in columns.items()},
        ),
    )


def _crossing_notes(unit: str, x: Sequence[float], columns: Mapping[str, Sequence[float | None]]) -> list[str]:
    """Return a line for each representation that states where it costs as much as depth images."""
    values = {label: np.array([value or np.nan for value in column], np.float64) for label, column in columns.items()}
    own = Representation.DPCI.label
    notes = []
    for label in values:
        if label != own:
            found = ", ".join(f"{place:,.0f}" for place in crossings(x, values[own], values[label]))
            where = f"cost the same at {found} {unit}" if found else "never cost the same"
            notes.append(f"{own} and {label} {where}.")
    return notes
