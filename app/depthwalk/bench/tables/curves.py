"""Measure the curves that the paper could not draw: what an object costs by triangles, by number and by pixels.

The object is the Venus of table 1, 67,170 triangles. Fewer triangles are its simplified levels, more come of dividing
each into four, so that the surface stays the same.
"""

import hashlib
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from depthwalk.assets.library import Report, SceneLibrary
from depthwalk.bench.object_cost import COMPARED, ObjectCosts, crossings, frame_costs, row_of
from depthwalk.bench.tables.table import Cell, Curves, Table
from depthwalk.bench.tables.walks import past
from depthwalk.ingest.mesh import Mesh
from depthwalk.render import kernels
from depthwalk.render.headless import HeadlessRenderer
from depthwalk.resources import scene_root
from depthwalk.scene.arrays import Representation
from depthwalk.scene.loader import load_scene
from depthwalk.scene.scene import Scene

SIZE = 1024, 768
FRAMES = 8
TRIANGLES = 1_100_000  # to which the curve over triangles goes
HEIGHTS = 600, 300, 150, 75, 38, 19, 9  # pixels
MIDDLE = 200  # pixels that the object is high where triangles vary
COUNTS = 1, 10, 100, 1000, 10_000, 100_000
SPACING = 2.5  # metres from object to object, where their number varies
SLOW = 1500.0  # milliseconds: what takes longer is not measured with more objects or triangles
_CLUSTERED = 100_000  # triangles; building clusters of more takes a minute and longer
_SOURCE = "Not in the paper: it compares two heads of fixed size"
_TIMES = (
    "Processor time of all threads on a software rasteriser, else time by the clock; means over frames of a walk, in "
    "turn, less what a frame without objects takes."
)


def over_triangles(report: Report, most: int = TRIANGLES) -> Table:
    """Measure what an object costs by how many triangles its mesh has.

    Parameters
    ----------
    report
        Called with a name and what is being done.
    most
        The largest number of triangles.

    Returns
    -------
    Table
        A row for each number of triangles, from about 1000 on.

    Raises
    ------
    GpuError
        Where no OpenGL 3.3 context can be created.
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
        left = [kind for kind in left if kind is not Representation.MESH_CLUSTERS or count <= _CLUSTERED]
        found = ObjectCosts(scene, 0, library, SIZE, left, judged=False).measured(MIDDLE, FRAMES).by
        x.append(float(count))
        for kind in COMPARED:
            cost = found[kind].milliseconds if kind in found else None
            columns[kind.label].append(cost)
            if cost is not None and cost > SLOW:
                slow.add(kind)
    return _table("triangles", "Time of an object by triangles of its mesh", "triangles", x, columns, "ms each")


def over_objects(report: Report, counts: Sequence[int] = COUNTS) -> Table:
    """Measure what a frame costs by its number of objects, in a square that a visitor walks along.

    `report` is called with a name and what is being done; `counts` are the numbers of objects.
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
    return _table("objects", "Time of a frame by number of objects", "objects", x, columns, "ms a frame")


def over_pixels(report: Report, heights: Sequence[float] = HEIGHTS) -> Table:
    """Measure what an object costs by how many pixels it covers, and how good it looks.

    `report` is called with a name and what is being done; `heights` are those of the object, pixels, falling.
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
    table = _table("pixels", "Time of an object by pixels that it covers", "pixels", x, columns, "ms each")
    return replace(
        table,
        columns=(*table.columns, *(f"{name}: FLIP" for name in flips)),
        rows=tuple((*row, *(column[k] for column in flips.values())) for k, row in enumerate(table.rows)),
        notes=(*table.notes, "FLIP: against the mesh with 16 samples a pixel, where either shows the object."),
    )


def _scene() -> Scene:
    """Return the scene of table 1, of whose assets only the first is used."""
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
    levels = [level.mesh for level in library.mesh_levels(0)]
    meshes = [mesh for mesh in reversed(levels) if 1000 <= len(mesh.faces) <= most]
    while meshes and 4 * len(meshes[-1].faces) <= most:
        meshes.append(subdivided(meshes[-1]))
    return meshes


def subdivided(mesh: Mesh) -> Mesh:
    """Return a mesh with each triangle divided into four at the middles of its edges, its surface unchanged.

    Each of the new triangles has three vertices of its own.
    """
    normals = _quartered(mesh.normals[mesh.faces])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return replace(
        mesh,
        positions=_quartered(mesh.positions[mesh.faces]),
        normals=normals / np.maximum(length, np.float32(1e-20)),
        colours=_quartered(mesh.colours[mesh.faces].astype(np.float32)).round().astype(np.uint8),
        uv=_quartered(mesh.uv[mesh.faces]),
        faces=np.arange(12 * len(mesh.faces), dtype=np.int32).reshape(-1, 3),
        parts=tuple(
            replace(part, first_face=4 * part.first_face, face_count=4 * part.face_count) for part in mesh.parts
        ),
    )


def _quartered(corners: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return values (12 n, k) at the corners of the quarters of n triangles from those at their corners (n, 3, k)."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    return np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], 1).reshape(-1, corners.shape[-1])


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
    """Return a line for each representation that says where it costs as much as depth images."""
    values = {label: np.array([value or np.nan for value in column], np.float64) for label, column in columns.items()}
    own = Representation.DPCI.label
    notes = []
    for label in values:
        if label != own:
            found = ", ".join(f"{place:,.0f}" for place in crossings(x, values[own], values[label]))
            where = f"cost the same at {found} {unit}" if found else "never cost the same"
            notes.append(f"{own} and {label} {where}.")
    return notes
