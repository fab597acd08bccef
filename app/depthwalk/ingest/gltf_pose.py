"""Pose the meshes of glTF files: apply shape keys (morph targets) and skins as the nodes have them at rest."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.quaternions import matrices
from depthwalk.geometry.vectors import normal_matrices
from depthwalk.ingest.gltf import mesh_size
from depthwalk.ingest.gltf_accessors import Accessors

Header = dict[str, Any]
_Matrices = NDArray[np.float64]  # (n, 4, 4)
_MOST_JOINTS = 1 << 16  # of a skin: vertices number them with 16 bits


def is_posed(header: Header) -> bool:
    """Return whether a node shows a mesh with a skin, or with a shape key whose weight is not 0."""
    return any(_is_posed(header, node) for node in header.get("nodes", []))


def _is_posed(header: Header, node: Header) -> bool:
    return "mesh" in node and ("skin" in node or any(_weights(header, node)))


def _weights(header: Header, node: Header) -> list[float]:
    """Return the weights of the shape keys of the mesh that `node` shows."""
    found = node.get("weights") or header["meshes"][node["mesh"]].get("weights") or []
    return [float(weight) for weight in found]


def posed_size(header: Header) -> tuple[int, int]:
    """Return how many vertices and triangles, at most, all posed meshes of a file have together."""
    sizes = [
        mesh_size(header, header["meshes"][node["mesh"]]) for node in header.get("nodes", []) if _is_posed(header, node)
    ]
    return sum(vertices for vertices, _ in sizes), sum(triangles for _, triangles in sizes)


def pose(header: Header, accessors: Accessors) -> bool:
    """Replace each posed mesh by what it is in its pose; joints stand where the nodes of the file put them.

    Skinned meshes are moved to the root of the scene, since only their joints place them.

    Parameters
    ----------
    header
        The JSON header, changed in place.
    accessors
        Reads the vertices, and holds the posed ones.

    Returns
    -------
    bool
        Whether any mesh was posed.

    Raises
    ------
    ValueError, TypeError, LookupError
        For damaged data.
    """
    roots = header["scenes"][header.get("scene", 0)].setdefault("nodes", [])
    nodes = header["nodes"]
    world = world_matrices(nodes, roots)
    outside = [number for number in top_nodes(nodes) if number not in world]
    everywhere = world_matrices(nodes, outside) | world
    last: tuple[int, _Matrices] | None = None  # of the skins, whose matrices may take much memory
    shown = [node for number, node in enumerate(nodes) if number in world and _is_posed(header, node)]
    for node in shown:
        skin = None
        if "skin" in node:
            number = node["skin"]
            if last is None or last[0] != number:
                try:
                    last = number, _joint_matrices(header["skins"][number], everywhere, accessors)
                except ValueError as error:
                    raise ValueError(f"skins[{number}]: {error}") from None
            skin = last[1]
        weights = _weights(header, node)
        primitives = header["meshes"][node["mesh"]]["primitives"]
        header["meshes"].append({"primitives": [_posed(each, weights, skin, accessors, header) for each in primitives]})
        if skin is None:
            node["mesh"] = len(header["meshes"]) - 1
        else:
            del node["mesh"]
            nodes.append({"mesh": len(header["meshes"]) - 1})
            roots.append(len(nodes) - 1)
    return bool(shown)


def top_nodes(nodes: list[Header]) -> list[int]:
    """Return the numbers of the nodes that are no node's children."""
    children = {child for node in nodes for child in node.get("children", [])}
    return [number for number in range(len(nodes)) if number not in children]


def world_matrices(nodes: list[Header], roots: list[int]) -> dict[int, _Matrices]:
    """Return the matrix (4, 4) of every node below `roots` that maps its frame to that of the scene."""
    world: dict[int, _Matrices] = {}
    open_ends = [(root, np.eye(4)) for root in roots]
    while open_ends:
        number, parent = open_ends.pop()
        if number not in world:
            with np.errstate(all="ignore"):
                world[number] = parent @ local_matrix(nodes[number])
            open_ends += [(child, world[number]) for child in nodes[number].get("children", [])]
    return world


def local_matrix(node: Header) -> _Matrices:
    """Return the matrix (4, 4) of a node relative to its parent."""
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    turn = np.array(node.get("rotation", (0, 0, 0, 1)), np.float64).reshape(1, 4)
    matrix = np.eye(4)
    unit = turn / max(float(np.linalg.norm(turn)), 1e-12)
    matrix[:3, :3] = matrices(unit)[0] * np.array(node.get("scale", (1, 1, 1)), np.float64)
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


def _joint_matrices(skin: Header, world: dict[int, _Matrices], accessors: Accessors) -> _Matrices:
    """Return for each joint of a skin the matrix (4, 4) from the mesh, as it was bound, to the scene."""
    numbers = skin["joints"]
    if not 0 < len(numbers) <= _MOST_JOINTS:
        raise ValueError(f"has {len(numbers)} joints, not 1 to {_MOST_JOINTS}")
    if missing := [number for number in numbers if number not in world]:
        raise ValueError(f"joint {missing[0]} is no node")
    joints = np.array([world[number] for number in numbers])
    if "inverseBindMatrices" not in skin:
        return joints
    bound = accessors.read(skin["inverseBindMatrices"], len(joints)).astype(np.float64).reshape(-1, 4, 4)
    with np.errstate(all="ignore"):
        return np.asarray(joints @ bound.transpose(0, 2, 1))


def _posed(
    primitive: Header, weights: list[float], skin: _Matrices | None, accessors: Accessors, header: Header
) -> Header:
    """Return a primitive with the positions and normals of its pose."""
    attributes = dict(primitive["attributes"])
    count = header["accessors"][attributes["POSITION"]]["count"]
    values = {
        name: accessors.read(attributes[name], count).astype(np.float64)
        for name in ("POSITION", "NORMAL")
        if name in attributes
    }
    with np.errstate(all="ignore"):
        for weight, target in zip(weights, primitive.get("targets", []), strict=False):
            for name in values.keys() & target.keys() if weight else ():
                values[name] += weight * accessors.read(target[name], count)
        if skin is not None:
            linear, offset = _blended(attributes, skin, count, accessors)
            values["POSITION"] = np.einsum("nij,nj->ni", linear, values["POSITION"]) + offset
            if "NORMAL" in values:
                values["NORMAL"] = np.einsum("nij,nj->ni", normal_matrices(linear), values["NORMAL"])
        attributes |= {name: accessors.add(value.astype(np.float32)) for name, value in values.items()}
    return {key: value for key, value in primitive.items() if key != "targets"} | {"attributes": attributes}


def _blended(
    attributes: Header, skin: _Matrices, count: int, accessors: Accessors
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the mean of the joints' matrices at each vertex by its weights: (N, 3, 3) and the offset (N, 3)."""
    whole, total = np.zeros((count, 3, 4)), np.zeros(count)
    part = 0
    while f"JOINTS_{part}" in attributes:
        joints = accessors.read(attributes[f"JOINTS_{part}"], count)
        if joints.max(initial=0) >= len(skin):
            raise ValueError(f"a vertex hangs from joint {joints.max()} of a skin with {len(skin)}")
        if f"WEIGHTS_{part}" not in attributes:
            raise ValueError(f"JOINTS_{part} has no WEIGHTS_{part}")
        weights = accessors.read(attributes[f"WEIGHTS_{part}"], count).astype(np.float64)
        for joint, weight in zip(joints.T, weights.T, strict=True):
            whole += weight[:, None, None] * skin[joint.astype(np.int64), :3]
            total += weight
        part += 1
    whole /= np.where(total > 0, total, 1)[:, None, None]
    whole[total <= 0] = np.eye(3, 4)
    return whole[..., :3], whole[..., 3]
