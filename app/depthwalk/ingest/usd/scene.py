"""Translate what a USD stage shows to glTF: meshes where they stand, copies, cameras, lights and movements.

Copies stay copies: what instances (`instanceable`) and PointInstancers share is one mesh of the glTF file, with all
meshes of the prototype as its primitives.
"""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from depthwalk.ingest.gltf import placed_node
from depthwalk.ingest.usd.glb import GlbBuilder
from depthwalk.ingest.usd.layers import file_in, open_stage
from depthwalk.ingest.usd.lights import Stands
from depthwalk.ingest.usd.materials import Materials
from depthwalk.ingest.usd.meshes import MeshWriter
from depthwalk.ingest.usd.models import Model, ModelReader, Placed
from depthwalk.ingest.usd.movements import Movements
from depthwalk.ingest.usd.nodes import Copies, Nodes
from depthwalk.ingest.usd.pictures import Pictures
from depthwalk.ingest.usd.problems import Unread, UsdError
from depthwalk.limits import MAX_INSTANCES

_Matrices = NDArray[np.float64]  # (…, 4, 4), for column vectors
_Y_FROM_Z = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])


class Translation(NamedTuple):
    """Hold the GLB file that shows what a USD file shows, warnings, and the files that it is made of."""

    builder: GlbBuilder
    warnings: list[str]
    files: list[str]


def translate(path: str, root: str) -> Translation:
    """Translate a USD file.

    Parameters
    ----------
    path, root
        The file, and the folder that holds all that it may name, as `layers.open_stage` takes them.

    Returns
    -------
    Translation
        The GLB file.

    Raises
    ------
    UsdError
        For what cannot be read.
    Tf.ErrorException
        For damaged layers.
    """
    unread, warnings, builder = Unread(), list[str](), GlbBuilder()
    stage, time = open_stage(path, root, unread), Usd.TimeCode.EarliestTime()
    unit = UsdGeom.GetStageMetersPerUnit(stage)
    unit = unit if 0 < unit < 1e6 else 1.0
    turn = _Y_FROM_Z if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z else np.eye(4)
    nodes = Nodes(builder, turn @ np.diag([unit, unit, unit, 1.0]), unit)
    pictures = Pictures(builder, root, warnings)
    reader = ModelReader(Stands(builder, nodes, pictures, time, unread), time, unread)
    reader.read(stage.GetPseudoRoot())
    meshes = _Meshes(MeshWriter(builder, Materials(builder, pictures, time, unread), time, unread))
    _place_moving(reader, meshes, Movements(stage, builder, nodes, unread), builder)
    nodes.add_copies(list(_still_copies(reader, meshes)))
    if texts := unread.texts():
        builder.header.setdefault("extras", {})["unread"] = texts
    files = {file_in(layer.realPath) for layer in stage.GetUsedLayers() if layer.realPath} | pictures.files
    return Translation(builder, warnings, sorted(files))


class _Meshes:
    """Write the mesh of each model when it is first asked for."""

    def __init__(self, writer: MeshWriter) -> None:
        self._writer = writer
        self._made: dict[Model, tuple[int, int] | None] = {}

    def of(self, model: Model) -> tuple[int, int] | None:
        """Return the number and the triangles of a model's own mesh; None if it has none."""
        if model not in self._made:
            self._made[model] = self._writer.add(model.name, model.pieces)
        return self._made[model]


def _still_copies(reader: ModelReader, meshes: _Meshes) -> Iterator[Copies]:
    """Yield where the meshes of all models stand that do not move."""
    still = [placed for placed in reader.placed if placed.mover is None]
    named: dict[Model, list[str]] = defaultdict(list)
    for placed in still:
        named[placed.model].append(placed.name)
    for model, places in spread(still, reader.models):
        if (mesh := meshes.of(model)) is not None:
            names = named[model] if len(named[model]) == len(places) else [""] * len(places)
            yield Copies(mesh=mesh[0], triangles=mesh[1], places=places, names=names)


def spread(placed: Sequence[Placed], models: Sequence[Model]) -> Iterator[tuple[Model, _Matrices]]:
    """Yield where models stand, with the copies that are in others.

    Parameters
    ----------
    placed
        What stands in the scene.
    models
        All models, each after those that it has copies of.

    Yields
    ------
    A model, and its places (n, 4, 4) in the scene.

    Raises
    ------
    UsdError
        If there are more than MAX_INSTANCES of them.
    """
    places: dict[Model, list[_Matrices]] = defaultdict(list)
    for each in placed:
        places[each.model].append(each.matrix[None])
    total = 0
    for model in reversed(models):
        if model not in places:
            continue
        every = np.concatenate(places.pop(model))
        total += len(every)
        for other, inside in model.copies:
            if total + len(every) * len(inside) > MAX_INSTANCES:
                raise UsdError(f"{model.where}: its copies make more than {MAX_INSTANCES} objects")
            places[other].append((every[:, None] @ inside).reshape(-1, 4, 4))
        yield model, every


def _place_moving(reader: ModelReader, meshes: _Meshes, movements: Movements, builder: GlbBuilder) -> None:
    """Write what moves: a node for each, with nodes for the meshes below it."""
    for placed in reader.placed:
        if placed.mover is None:
            continue
        node = movements.add(placed.mover)
        still = Placed(model=placed.model, matrix=np.eye(4), name=placed.name)
        for model, inside in spread([still], reader.models):
            if (mesh := meshes.of(model)) is not None:
                children = [placed_node({"mesh": mesh[0], "name": placed.name}, matrix) for matrix in inside]
                builder.header["nodes"][node]["children"] += [builder.add("nodes", child) for child in children]
    movements.finish()
