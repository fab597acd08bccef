"""Read the meshes of FBX files, with the layers of normals, texture coordinates, colours and materials."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.ingest.interchange.fbx_scene import FbxScene
from depthwalk.ingest.interchange.fbx_tree import Node
from depthwalk.ingest.interchange.model import Polygons, posed
from depthwalk.types import Ints


def read_polygons(node: Node) -> Polygons | None:
    """Return the polygons of a geometry, without the names of their materials, which its models have; None if none.

    Raises ValueError and others for damaged data.
    """
    vertices, indices = node.array("Vertices"), node.array("PolygonVertexIndex")
    if vertices is None or indices is None or not len(indices):
        return None
    corners = indices.astype(np.int64)
    is_last = corners < 0  # of its polygon: stored as its complement
    if not is_last[-1]:
        raise ValueError("the last polygon does not end")
    vertex = np.where(is_last, ~corners, corners)
    ends = np.flatnonzero(is_last) + 1
    sizes = np.diff(ends, prepend=0)
    layers = _Layers(node, vertex, sizes)
    colours = layers.rows("LayerElementColor", "Colors", "ColorIndex", 4)
    material = layers.rows("LayerElementMaterial", "", "Materials", 1)
    of_polygons = np.zeros(len(sizes), np.int64)
    if material is not None:
        of_polygons = np.nan_to_num(material[ends - sizes, 0], nan=-1.0).astype(np.int64)
    return Polygons(
        positions=vertices.astype(np.float64).reshape(-1, 3),
        vertex=vertex,
        sizes=sizes,
        normals=layers.rows("LayerElementNormal", "Normals", "NormalsIndex", 3),
        uv=layers.rows("LayerElementUV", "UV", "UVIndex", 2),
        colours=None if colours is None else _srgb8(colours[:, :3]),
        material=of_polygons,
        names=(None,),
    )


class _Layers:
    """Read the layers of a geometry, a row for each corner."""

    def __init__(self, node: Node, vertex: Ints, sizes: Ints) -> None:
        self._node, self._vertex, self._sizes = node, vertex, sizes

    def rows(self, layer: str, name: str, index_name: str, width: int) -> NDArray[np.float64] | None:
        """Return the values (C, width) of the first layer of a kind; None if there is none.

        Without a `name`, the index itself is the value.
        """
        found = min(self._node.all(layer), key=_number, default=None)
        if found is None:
            return None
        index = found.array(index_name)
        corners = self._corners(str(found.first("MappingInformationType", "")))
        if corners is None:
            return None
        if not name:
            return None if index is None else _taken(index[:, None], corners, width)
        values = found.array(name)
        if values is None or not len(values):
            return None
        if str(found.first("ReferenceInformationType", "")) != "Direct" and index is not None:
            corners = _taken(index.astype(np.int64)[:, None], corners, 1)[:, 0].astype(np.int64)
        return _taken(values.reshape(-1, width), corners, width)

    def _corners(self, mapping: str) -> Ints | None:
        """Return which row of a layer each corner has; None for a mapping that is not known."""
        match mapping:
            case "ByPolygonVertex":
                return np.arange(len(self._vertex))
            case "ByVertice" | "ByVertex":
                return self._vertex
            case "ByPolygon":
                return np.repeat(np.arange(len(self._sizes)), self._sizes)
            case "AllSame":
                return np.zeros(len(self._vertex), np.int64)
        return None


def _number(layer: Node) -> int:
    return layer.properties[0] if layer.properties and isinstance(layer.properties[0], int) else 0


def _taken(values: NDArray[Any], rows: Ints, width: int) -> NDArray[np.float64]:
    """Return rows of values as (n, width); NaN for those that are missing, as some exporters write −1."""
    with_none = np.vstack([values.astype(np.float64), np.full((1, width), np.nan)])
    return with_none[np.where((rows >= 0) & (rows < len(values)), rows, len(values))]


def _srgb8(colours: NDArray[np.float64]) -> NDArray[np.uint8]:
    return np.round(np.clip(np.nan_to_num(colours, nan=1.0), 0, 1) * 255).astype(np.uint8)


def skinned(scene: FbxScene, geometry: int, polygons: Polygons, rest: NDArray[np.float64]) -> Polygons | None:
    """Return the polygons of a geometry in the scene, as its joints stand; None if it has no joints.

    `rest` (4, 4) places the vertices that no joint holds.
    """
    rows, matrices, weights = [], [], []
    for skin in scene.connected(geometry, "Deformer"):
        for cluster in scene.connected(skin, "Deformer"):
            joints = scene.connected(cluster, "Model")
            node = scene.objects[cluster]
            index, weight, placing = (node.array(name) for name in ("Indexes", "Weights", "Transform"))
            if not joints or index is None or weight is None or placing is None or len(index) != len(weight):
                continue
            joint_from_mesh = placing.astype(np.float64).reshape(4, 4).T
            rows.append(index.astype(np.int64))
            weights.append(weight.astype(np.float64))
            matrix = (scene.world(joints[0]) @ joint_from_mesh)[:3]
            matrices.append(np.broadcast_to(matrix, (len(index), 3, 4)))
    if not rows:
        return None
    return posed(polygons, np.concatenate(rows), np.concatenate(matrices), np.concatenate(weights), rest)
