"""Read what the scene of a glTF file shows: its models, where they stand, its cameras and lamps.

`read_soup` makes one mesh of all that. Here copies stay copies: a tree that a thousand nodes show is one model with a
thousand placements, as is a car of fifty meshes that was copied with all its nodes.
"""

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError, quoted
from depthwalk.geometry.quaternions import matrices
from depthwalk.ingest import gltf
from depthwalk.ingest.gltf_accessors import Accessors
from depthwalk.ingest.gltf_copies import first_of_same
from depthwalk.ingest.gltf_lights import PlacedCamera, PlacedLight, cameras, lights
from depthwalk.ingest.gltf_pose import is_posed, local_matrix, pose, posed_size, top_nodes, world_matrices
from depthwalk.ingest.soup import check_mesh_memory
from depthwalk.ingest.sources import Sources, find
from depthwalk.limits import MAX_INSTANCES

_MOST_MESHES = 256  # of a model: copied groups of more are no single things
_REPEATS = 2.0  # triangles of a model, over those of its distinct meshes: a group that repeats more is no single thing
_FARTHEST = 1e12  # in matrices: products of a few such numbers are finite
_TURN_BITS, _SHIFT_BITS = 13, 20  # to which matrices of copies are the same, of their largest number

Header = dict[str, Any]
_Matrices = NDArray[np.float64]  # (…, 4, 4)


@dataclass(frozen=True, kw_only=True)
class PlacedModel:
    """Hold meshes that stand together, and where the scene places them.

    Attributes
    ----------
    name
        The name of the mesh or, of several, of their node; "" if it has none.
    meshes
        The numbers of the k meshes in the header; a mesh may occur more than once.
    matrices : (k, 4, 4) float64
        Model from mesh, for column vectors.
    placements : (n, 4, 4) float64
        Scene from model.
    names
        n names of nodes, "" for those without.
    triangles
        How many triangles the model has, at most.
    """

    name: str
    meshes: tuple[int, ...]
    matrices: _Matrices
    placements: _Matrices
    names: tuple[str, ...]
    triangles: int


@dataclass(frozen=True, kw_only=True)
class GltfScene:
    """Hold the scene of a glTF file.

    Attributes
    ----------
    header
        The JSON header, in which skinned and morphed meshes are replaced by those of their pose.
    accessors
        Reads the header's accessors.
    models, cameras, lights
        What the scene shows, in the order of the file.
    """

    header: Header
    accessors: Accessors
    models: tuple[PlacedModel, ...]
    cameras: tuple[PlacedCamera, ...]
    lights: tuple[PlacedLight, ...]


def read_gltf_scene(path: Path, sources: Sources) -> GltfScene:
    """Read the default scene of a glTF or GLB file; of a file without scenes, all of its nodes.

    Only the header is read, and where meshes are posed or instanced, what this takes. Meshes stay in the file until
    `gltf_subset` writes them to others. Instances of `EXT_mesh_gpu_instancing` are placements like others.

    Parameters
    ----------
    path
        The file.
    sources
        Reads files and keeps their bytes.

    Returns
    -------
    GltfScene
        The scene.

    Raises
    ------
    InputError
        `path: defect`.
    """
    data = sources.read(path)
    header = gltf.read_header(data, path)

    def read(uri: str) -> bytes:
        if (file := find(uri, [path.parent], sources)) is None:
            raise InputError(f"{path}: buffer {quoted(uri)} is missing or outside the folder")
        return sources.read(file)

    with damaged(path):
        gltf.check_header(header, path, known=gltf.INSTANCING)
        if is_posed(header):
            check_mesh_memory(*posed_size(header), path)
        accessors = Accessors(header, data, read)
        return _read(header, accessors, len(data))


@contextmanager
def damaged(path: Path) -> Iterator[None]:
    """Report wrong types and values in the header of the file `path`, met in a `with` block, as an InputError."""
    try:
        yield
    except (ValueError, TypeError, LookupError, AttributeError, OverflowError, RecursionError) as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:100]
        raise InputError(f"{path}: damaged, truncated or an unsupported kind of glTF ({reason})") from error


def _read(header: Header, accessors: Accessors, length: int) -> GltfScene:
    """Return the scene of a checked header, in a file of so many bytes.

    Raises ValueError, TypeError or LookupError for damaged data.
    """
    nodes = header.setdefault("nodes", [])
    if not header.get("scenes"):
        header["scenes"] = [{"nodes": top_nodes(nodes)}]
        header["scene"] = 0
    if is_posed(header):
        pose(header, accessors)
    first = first_of_same(header, accessors, length + sum(map(_length, header.get("buffers", []))))
    for node in nodes:
        if "mesh" in node:
            node["mesh"] = first[_index(node["mesh"], first)]
    roots = header["scenes"][header.get("scene", 0)].get("nodes", [])
    world = world_matrices(nodes, roots)
    _check_forest(nodes, roots, world)
    return GltfScene(
        header=header,
        accessors=accessors,
        models=tuple(_Models(header, accessors, world).found(roots)),
        cameras=tuple(cameras(header, world)),
        lights=tuple(lights(header, world)),
    )


def _length(buffer: Header) -> int:
    """Return how many bytes a buffer has that is a file of its own."""
    return int(buffer["byteLength"]) if "uri" in buffer else 0


def _check_forest(nodes: list[Header], roots: list[int], world: dict[int, _Matrices]) -> None:
    """Raise ValueError if nodes of the scene hang from several parents, or their matrices have too large numbers."""
    parents = Counter(child for number in world for child in nodes[number].get("children", [])) + Counter(roots)
    if twice := [number for number, count in parents.items() if count > 1]:
        raise ValueError(f"node {twice[0]} hangs from {parents[twice[0]]} nodes")
    for number, matrix in world.items():
        if not (np.abs(matrix) < _FARTHEST).all():
            raise ValueError(f"node {number} is out of reach")


class _Models:
    """Find the models of a scene, and collect their placements."""

    def __init__(self, header: Header, accessors: Accessors, world: dict[int, _Matrices]) -> None:
        self._header, self._accessors, self._world = header, accessors, world
        self._nodes: list[Header] = header["nodes"]
        self._triangles = [
            gltf.mesh_size(header, {"primitives": gltf.surfaces(mesh)})[1] for mesh in header.get("meshes", [])
        ]
        self._kind, self._size = self._subtrees()
        self._copies = Counter(self._kind.values())
        self._contents: dict[int, tuple[tuple[int, ...], _Matrices] | None] = {}

    def found(self, roots: list[int]) -> Iterator[PlacedModel]:
        """Yield the models, by their first placement."""
        placed: dict[tuple[str, int], list[int]] = {}
        ends = list(reversed(roots))
        while ends:
            number = ends.pop()
            if not self._size[number]:
                continue
            if self._content(number) is not None:
                placed.setdefault(("nodes", self._kind[number]), []).append(number)
                continue
            if (mesh := self._mesh(number)) is not None:
                placed.setdefault(("mesh", mesh), []).append(number)
            ends += reversed(self._nodes[number].get("children", []))
        instances = sum(map(self._instance_count, self._world))
        if instances > MAX_INSTANCES:
            raise ValueError(f"{instances} instances, more than {MAX_INSTANCES}")
        for (kind, number), at in placed.items():
            yield self._model(number if kind == "mesh" else None, at)

    def _model(self, mesh: int | None, at: list[int]) -> PlacedModel:
        """Return the model of the mesh, or of what hangs from each of the nodes `at`."""
        node = self._nodes[at[0]]
        if mesh is None:
            found = self._contents[self._kind[at[0]]]
            assert found is not None
            meshes, inside = found
            name = node.get("name")
        else:
            meshes, inside = (mesh,), np.eye(4)[None]
            name = self._header["meshes"][mesh].get("name", node.get("name"))
        placements = [self._world[number] @ self._instances(number) for number in at]
        named = [self._nodes[number].get("name", "") for number in at]
        single = all(len(each) == 1 for each in placements)
        every = np.concatenate(placements)
        if not (np.abs(every) < _FARTHEST).all():
            raise ValueError("instances are out of reach")
        return PlacedModel(
            name=name if isinstance(name, str) else "",
            meshes=meshes,
            matrices=inside,
            placements=every,
            names=tuple(text if isinstance(text, str) else "" for text in named) if single else ("",) * len(every),
            triangles=sum(self._triangles[number] for number in meshes),
        )

    def _mesh(self, number: int) -> int | None:
        """Return which mesh a node shows that has triangles; None if none."""
        mesh = self._nodes[number].get("mesh")
        return mesh if mesh is not None and self._triangles[_index(mesh, self._triangles)] else None

    def _subtrees(self) -> tuple[dict[int, int], dict[int, int]]:
        """Return for each node the number of the kind of what hangs from it, and how many meshes that has.

        Nodes are of one kind if they show the same meshes at the same places, seen from the node.
        """
        places = _rounded({number: local_matrix(self._nodes[number]) for number in self._world})
        kind: dict[int, int] = {}
        size: dict[int, int] = {}
        known: dict[object, int] = {}
        for number in reversed(self._world):  # children come after their parents
            children = [child for child in self._nodes[number].get("children", []) if size[child]]
            own = self._mesh(number)
            size[number] = (own is not None) + sum(size[child] for child in children)
            alone = number if self._instancing(number) else None  # no other is like a node of instances
            looks = own, alone, tuple(sorted((kind[child], places[child]) for child in children))
            kind[number] = known.setdefault(looks, len(known))
        return kind, size

    def _content(self, number: int) -> tuple[tuple[int, ...], _Matrices] | None:
        """Return the meshes (k,) that hang from a node, and their places (k, 4, 4); None if they are no single thing.

        They are if the same meshes hang from other nodes too, and are not many copies of few.
        """
        kind = self._kind[number]
        if self._copies[kind] < 2 or not 1 < self._size[number] <= _MOST_MESHES:
            return None
        if kind not in self._contents:
            meshes, inside = zip(*self._below(number), strict=True)
            triangles = sum(self._triangles[mesh] for mesh in meshes)
            distinct = sum(self._triangles[mesh] for mesh in set(meshes))
            self._contents[kind] = (meshes, np.array(inside)) if triangles <= _REPEATS * distinct else None
        return self._contents[kind]

    def _below(self, top: int) -> Iterator[tuple[int, _Matrices]]:
        """Yield each mesh that hangs from a node, and its place (4, 4), seen from the node."""
        ends = [(top, np.eye(4))]
        while ends:
            number, place = ends.pop()
            if (mesh := self._mesh(number)) is not None:
                yield mesh, place
            ends += [
                (child, place @ local_matrix(self._nodes[child]))
                for child in reversed(self._nodes[number].get("children", []))
                if self._size[child]
            ]

    def _instancing(self, number: int) -> Header:
        """Return the accessors of a node's instances by name; none if it has none."""
        extension = gltf.object_under(gltf.object_under(self._nodes[number], "extensions"), gltf.INSTANCING)
        return gltf.object_under(extension, "attributes")

    def _instance_count(self, number: int) -> int:
        listed = self._instancing(number)
        return max((int(self._header["accessors"][accessor]["count"]) for accessor in listed.values()), default=0)

    def _instances(self, number: int) -> _Matrices:
        """Return the places (n, 4, 4) of a node's instances in its frame; a single one if it is shown once."""
        listed, count = self._instancing(number), self._instance_count(number)
        every = np.tile(np.eye(4), (max(count, 1), 1, 1))
        if "ROTATION" in listed:
            turn = self._accessors.read(listed["ROTATION"], count).astype(np.float64)
            every[:, :3, :3] = matrices(turn / np.maximum(np.linalg.norm(turn, axis=1, keepdims=True), 1e-12))
        if "SCALE" in listed:
            every[:, :3, :3] *= self._accessors.read(listed["SCALE"], count)[:, None, :]
        if "TRANSLATION" in listed:
            every[:, :3, 3] = self._accessors.read(listed["TRANSLATION"], count)
        return every


def _index(number: object, listed: list[Any]) -> int:
    """Return a number of an item of a list. Raises ValueError if it has none of this number."""
    if not isinstance(number, int) or not 0 <= number < len(listed):
        raise ValueError(f"there is no mesh {str(number)[:40]}")
    return number


def _rounded(local: dict[int, _Matrices]) -> dict[int, bytes]:
    """Return each matrix (4, 4) as bytes, which are the same for copies that an exporter has computed separately."""
    stacked = np.array(list(local.values())).reshape(-1, 4, 4)
    linear, shift = stacked[:, :3, :3].reshape(-1, 9), stacked[:, :3, 3]
    numbers = [_mantissas(linear, _TURN_BITS), _mantissas(shift, _SHIFT_BITS)]
    return dict(zip(local, map(bytes, np.concatenate(numbers, 1)), strict=True))


def _mantissas(values: NDArray[np.float64], bits: int) -> NDArray[np.int32]:
    """Return rows of numbers (n, w) as whole ones (n, w + 1), relative to the largest of the row, and its exponent."""
    _, exponent = np.frexp(np.abs(values).max(axis=1))
    whole = np.rint(np.ldexp(values, bits - exponent[:, None])).astype(np.int32)
    return np.concatenate([whole, exponent[:, None].astype(np.int32)], axis=1)
