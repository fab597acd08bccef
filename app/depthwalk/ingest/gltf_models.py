"""Find the models of a glTF scene, and collect their placements.

Copies stay copies: a tree that a thousand nodes show is one model with a thousand placements, as is a car of fifty
meshes that was copied with all its nodes.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.geometry.quaternions import matrices
from depthwalk.ingest import gltf
from depthwalk.ingest.gltf_accessors import Accessors
from depthwalk.ingest.gltf_animations import Movement
from depthwalk.ingest.gltf_channels import FARTHEST, normalised
from depthwalk.ingest.gltf_pose import local_matrix
from depthwalk.limits import MAX_INSTANCES, MAX_KEYFRAMES

_MOST_MESHES = 256  # of a model: copied groups of more are no single things
_REPEATS = 2.0  # triangles of a model, over those of its distinct meshes: a group that repeats more is no single thing
_MOST_MOVING = 10_000  # placements with movements of their own
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
    movements
        n movements, None for those that stand still.
    names
        n names of nodes, "" for those without.
    triangles
        How many triangles the model has, at most.
    """

    name: str
    meshes: tuple[int, ...]
    matrices: _Matrices
    placements: _Matrices
    movements: tuple[Movement | None, ...]
    names: tuple[str, ...]
    triangles: int


class Models:
    """Find the models of a scene, and collect their placements.

    Attributes
    ----------
    stopped
        How many placements stand still since more move than a scene has keyframes for.
    """

    def __init__(
        self,
        header: Header,
        accessors: Accessors,
        world: dict[int, _Matrices],
        movements: Mapping[int, Movement],
    ) -> None:
        """Prepare to look through a scene.

        Parameters
        ----------
        header
            The JSON header.
        accessors
            Reads its accessors.
        world
            The matrix (4, 4) of each node of the scene, parents first.
        movements
            How nodes move that do, or hang from one that does.
        """
        self._header, self._accessors, self._world, self._movements = header, accessors, world, movements
        self._nodes: list[Header] = header["nodes"]
        self._triangles = [
            gltf.mesh_size(header, {"primitives": gltf.surfaces(mesh)})[1] for mesh in header.get("meshes", [])
        ]
        self._kind, self._size = self._subtrees()
        self._bends = self._bending()
        self._most_moving = min(MAX_KEYFRAMES // 2, _MOST_MOVING)  # each takes two keyframes at least
        self.stopped = 0
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
        instances = {number: self._instances(number) for number in at}
        placements = [self._world[number] @ each for number, each in instances.items()]
        named = [self._nodes[number].get("name", "") for number in at]
        single = all(len(each) == 1 for each in placements)
        every = np.concatenate(placements)
        if not (np.abs(every) < FARTHEST).all():
            raise ValueError("instances are out of reach")
        return PlacedModel(
            name=name if isinstance(name, str) else "",
            meshes=meshes,
            matrices=inside,
            placements=every,
            movements=tuple(movement for number in at for movement in self._moving(number, instances[number])),
            names=tuple(text if isinstance(text, str) else "" for text in named) if single else ("",) * len(every),
            triangles=sum(self._triangles[number] for number in meshes),
        )

    def _moving(self, number: int, instances: _Matrices) -> list[Movement | None]:
        """Return how the instances (n, 4, 4) of a node move."""
        movement = self._movements.get(number)
        if movement is None:
            return [None] * len(instances)
        moving = instances[: self._most_moving]
        self._most_moving -= len(moving)
        self.stopped += len(instances) - len(moving)
        still = [None] * (len(instances) - len(moving))
        return [movement.of(inside) for inside in moving] + still

    def _mesh(self, number: int) -> int | None:
        """Return which mesh a node shows that has triangles; None if none."""
        mesh = self._nodes[number].get("mesh")
        return mesh if mesh is not None and self._triangles[index_of(mesh, self._triangles)] else None

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

    def _bending(self) -> set[int]:
        """Return the nodes below which something moves otherwise than they do."""
        bends: set[int] = set()
        for number in reversed(self._world):
            children = [child for child in self._nodes[number].get("children", []) if self._size[child]]
            if any(child in bends or self._moves_in(child, number) for child in children):
                bends.add(number)
        return bends

    def _moves_in(self, child: int, parent: int) -> bool:
        """Return whether a node that hangs from another moves by itself."""
        ways = self._movements.get(child), self._movements.get(parent)
        joints = [0 if way is None else way.joint_count for way in ways]
        return joints[0] > joints[1]

    def _content(self, number: int) -> tuple[tuple[int, ...], _Matrices] | None:
        """Return the meshes (k,) that hang from a node, and their places (k, 4, 4); None if they are no single thing.

        They are if the same meshes hang from other nodes too, keep their places and are not many copies of few.
        """
        kind = self._kind[number]
        if self._copies[kind] < 2 or number in self._bends or not 1 < self._size[number] <= _MOST_MESHES:
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
            every[:, :3, :3] = matrices(normalised(turn))
        if "SCALE" in listed:
            every[:, :3, :3] *= self._accessors.read(listed["SCALE"], count)[:, None, :]
        if "TRANSLATION" in listed:
            every[:, :3, 3] = self._accessors.read(listed["TRANSLATION"], count)
        return every


def index_of(number: object, listed: list[Any]) -> int:
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
