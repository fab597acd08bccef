"""Report how a frame drew one object of the scene: its impostors, or its mesh, and at which level of detail."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.bake.images import Face
from depthwalk.cook.cases import Case, drawn_cases
from depthwalk.geometry.quaternions import rotate
from depthwalk.render.draw.draw_lists import FrameDrawLists
from depthwalk.render.draw.frame_counts import DrawnTiles
from depthwalk.render.renderer import Renderer
from depthwalk.render.view.bounds import Cylinders
from depthwalk.render.view.view import View, viewer_in_object
from depthwalk.scene.arrays import Objects, Representation
from depthwalk.types import Rows

# How far a mesh that was drawn may be from where the scene places the object, relative to its distance: fallbacks are
# placed by their depth images, in single precision.
_SAME_PLACE = 1e-3


@dataclass(frozen=True, kw_only=True)
class ImpostorReport:
    """Describe the impostor by which a part of an object was drawn.

    Attributes
    ----------
    level : the level of detail that was warped, 0 the finest.
    triangles : how many triangles that level has.
    case : which of its depth images it was warped from.
    step : the paper's Iter_step, texels of the side image per step of the grid.
    tile : x, y, width and height of its tile in the atlas, texels.
    resolution : texels along each side of the tile over those that it should have, 0 to 1.
    error : reprojection error, 1 where it is as large as allowed.
    rectangle : (4, 3) corners of the impostor, on the plane that it was warped in, around it; metres, world.
    """

    level: int
    triangles: int
    case: Case
    step: int
    tile: tuple[int, int, int, int]
    resolution: float
    error: float
    rectangle: NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class MeshReport:
    """Describe the mesh by which an object was drawn: its level of detail, 0 the whole mesh, and that level's size."""

    level: int
    triangles: int


@dataclass(frozen=True, kw_only=True)
class ObjectReport:
    """Describe one object of the scene, and how a frame drew it.

    Attributes
    ----------
    number : the object's row in `Scene.objects`.
    asset : the name of its asset in the scene file.
    node : the name of the node that holds it, or of the nearest group around that has one; "" where none has.
    distance : from the viewer to the object's bounding cylinder, metres; 0 within.
    mesh_triangles : triangles of its whole mesh; 0 where they are not known.
    images : how many depth images it has, and width and height of each; None where it is not drawn by them.
    parts : how many parts its depth images have.
    impostors : those that it was drawn by, one for each part in sight.
    other : another representation that it was drawn by, such as DMESH, its depth images straight; None: by no other.
    mesh : the mesh that it was drawn by; None where it was not.
    clustered : whether it was drawn as a member of a far cluster.
    in_view : whether its bounding spheres reach into the picture, also where others hide it.
    cylinders : the bounding cylinders of its parts, world.
    """

    number: int
    asset: str
    node: str
    distance: float
    mesh_triangles: int
    images: tuple[int, int, int] | None
    parts: int
    impostors: tuple[ImpostorReport, ...]
    other: Representation | None
    mesh: MeshReport | None
    clustered: bool
    in_view: bool
    cylinders: Cylinders


def report_object(renderer: Renderer, number: int) -> ObjectReport | None:
    """Report how the frame drawn last drew an object.

    Parameters
    ----------
    renderer : the renderer, which has just finished a frame.
    number : the object's row in `Scene.objects`.

    Returns
    -------
    The report; None before the first frame, and where nothing of the object is loaded yet.
    """
    plan, view, scene = renderer.plan, renderer.view, renderer.scene
    rows = np.flatnonzero(renderer.world.owners() == number)
    if plan is None or view is None or not len(rows):
        return None
    objects = renderer.world.objects().take(rows)
    drawn_as = plan.drawn_as[np.isin(plan.object_rows, rows)]
    impostors = _impostors(renderer, plan, rows)
    return ObjectReport(
        number=number,
        asset=scene.assets[int(scene.objects.asset[number])].name,
        node=_node_name(renderer, number),
        distance=_distance(view, renderer, objects),
        mesh_triangles=_mesh_triangles(renderer, objects),
        images=_images(renderer, objects),
        parts=len(rows),
        impostors=impostors,
        other=_other(plan, rows, drawn_as),
        mesh=_mesh(renderer, plan, view, number),
        clustered=bool((drawn_as == Representation.DPCI).any()) and not impostors,
        in_view=len(renderer.world.bounds().take(rows).seen(view)[0]) > 0,
        cylinders=renderer.world.cylinders(rows),
    )


def _other(plan: FrameDrawLists, rows: Rows, drawn_as: NDArray[np.uint8]) -> Representation | None:
    """Return `ObjectReport.other` of the objects `rows` (k,), of which those with impostors are `drawn_as` DPCI."""
    if len(others := drawn_as[drawn_as != Representation.DPCI]):
        return Representation(int(others[0]))
    captured = (kind for kind, shown in plan.captured.items() if np.isin(shown.records["row"], rows).any())
    return next(captured, None)


def _node_name(renderer: Renderer, number: int) -> str:
    """Return the name of the node that holds an object, or of the nearest group around that has a name."""
    nodes, node = renderer.scene.nodes, int(renderer.scene.owner[number])
    while node >= 0 and not nodes.name[node]:
        node = int(nodes.parent[node])
    return nodes.name[node] if node >= 0 else ""


def _distance(view: View, renderer: Renderer, objects: Objects) -> float:
    """Return the distance, metres, from the viewer to the nearest bounding cylinder of some `objects`."""
    viewer = viewer_in_object(view, objects.position, objects.rotation, objects.scale)
    return float((renderer.world.table().nearest(objects.asset, viewer) * objects.scale).min())


def _mesh_triangles(renderer: Renderer, objects: Objects) -> int:
    """Return `ObjectReport.mesh_triangles` of an object that is drawn as `objects`, parts or a mesh."""
    table, parts, first = renderer.world.table(), renderer.assets.parts, int(objects.asset[0])
    if first >= parts.first:
        return parts.cooked(first).outline.mesh_triangles or 0
    return int(table.meshes.triangles[first, 0])


def _images(renderer: Renderer, objects: Objects) -> tuple[int, int, int] | None:
    """Return how many depth images all parts have, and the size of the first; None for a mesh."""
    parts = renderer.assets.parts
    if int(objects.asset[0]) < parts.first:
        return None
    images = [image for asset in objects.asset.tolist() for image in parts.cooked(asset).outline.images]
    height, width = next((image for image in images if image.face is Face.SIDE), images[0]).depth.shape
    return len(images), width, height


def _impostors(renderer: Renderer, plan: FrameDrawLists, rows: Rows) -> tuple[ImpostorReport, ...]:
    """Return the reports of the impostors that show the objects `rows` (k,), without those of far clusters."""
    tiled, tiles = plan.object_rows[plan.tiled], plan.tiles.of_objects()
    shown = (np.isin(tiled, rows) & (tiles.members == 1)).nonzero()[0]
    pairs = zip(tiled[shown].tolist(), shown.tolist(), strict=True)
    return tuple(_impostor(renderer, plan, row, tiles.take(slice(place, place + 1))) for row, place in pairs)


def _impostor(renderer: Renderer, plan: FrameDrawLists, row: int, tile: DrawnTiles) -> ImpostorReport:
    """Return the report of the single `tile` that shows the object `row`."""
    objects, level = renderer.world.objects(), int(tile.level[0])
    record = plan.composite.records[int((plan.composite.rows == row).argmax())]
    x, y, width, height = np.rint(record["tile"]).astype(int).tolist()
    return ImpostorReport(
        level=level,
        triangles=int(renderer.world.table().triangles[objects.asset[row], level]),
        case=Case(int(drawn_cases(tile.pieces)[0])),
        step=int(tile.grid_steps[0]),
        tile=(x, y, width, height),
        resolution=float(tile.resolution[0]),
        error=float(tile.error[0]),
        rectangle=_rectangle(record, objects, row),
    )


def _rectangle(record: np.void, objects: Objects, row: int) -> NDArray[np.float64]:
    """Return the corners (4, 3), metres, world, of an impostor: the rectangle of its plane that its tile covers.

    record : the tile's COMPOSITE_RECORD, in the frame of the object `row` of all `objects`.
    """
    right, up, normal, high = (np.asarray(record[name], float) for name in ("right", "up", "normal", "high"))
    s, v = np.array([right[3], high[0], high[0], right[3]]), np.array([up[3], up[3], high[1], high[1]])
    on_plane = record["origin"][:3] - normal[3] * normal[:3]
    corners = on_plane + s[:, None] * right[:3] + v[:, None] * up[:3]
    rotation = np.broadcast_to(objects.rotation[row].astype(float), (4, 4))
    return np.asarray(objects.position[row] + objects.scale[row] * rotate(rotation, corners))


def _mesh(renderer: Renderer, plan: FrameDrawLists, view: View, number: int) -> MeshReport | None:
    """Return how an object was drawn as a mesh, found by its place, as records have no numbers; None if it was not."""
    polygons, objects = plan.polygons, renderer.scene.objects
    if not len(polygons.records):
        return None
    place = np.append(objects.position[number] - view.position, objects.rotation[number])
    offset = np.column_stack([polygons.records["origin"], polygons.records["rotation"]]) - place
    near = _SAME_PLACE * max(float(np.linalg.norm(place[:3])), 1.0)
    found: Rows = (np.abs(offset).max(1) <= near).nonzero()[0]
    for batch in polygons.batches:
        is_of_batch = (found >= batch.first) & (found < batch.first + batch.count)
        if batch.asset == objects.asset[number] and is_of_batch.any():
            triangles = renderer.world.table().meshes.triangles[batch.asset, batch.level]
            return MeshReport(level=batch.level, triangles=int(triangles))
    return None
