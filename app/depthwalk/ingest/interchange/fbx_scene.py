"""Connect the objects of an FBX file, and compute where its models are."""

import math
from collections import defaultdict
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from depthwalk.ingest.interchange.fbx_tree import Node

_Matrix = NDArray[np.float64]
_ORDERS = ("xyz", "xzy", "yzx", "yxz", "zxy", "zyx")  # the axis that is turned about first stands first
_DEPTH = 256  # models within models


class FbxScene:
    """Hold the objects of a file by their numbers, and what is connected to each.

    Attributes
    ----------
    objects
        The nodes of objects by their numbers.
    """

    def __init__(self, root: Node) -> None:
        """Connect the objects of the file with the nodes at the top `root`."""
        section = root.find("Objects")
        self.objects: dict[int, Node] = {}
        for node in section.children if section is not None else ():
            if node.properties and isinstance(node.properties[0], int):
                self.objects[node.properties[0]] = node
        self._sources: dict[int, list[tuple[int, str]]] = defaultdict(list)
        self.parents: dict[int, int] = {}
        connections = root.find("Connections")
        for link in connections.all("C") if connections is not None else ():
            kind, source, target, *use = [*link.properties, "", "", ""][:4]
            if not isinstance(source, int) or not isinstance(target, int):
                continue
            self._sources[target].append((source, str(use[0]) if kind == "OP" else ""))
            if kind == "OO" and (target == 0 or self.kind(target) == "Model"):
                self.parents.setdefault(source, target)
        self._templates = dict(_templates(root))
        self._worlds: dict[int, _Matrix] = {}
        self._given: dict[int, dict[str, list[Any]]] = {}
        settings = root.find("GlobalSettings")
        self.file_from_scene = _axes(_properties(settings) if settings is not None else {})

    def kind(self, number: int) -> str:
        """Return the kind of an object, such as `Model`; "" if there is none with this number."""
        return self.objects[number].name if number in self.objects else ""

    def connected(self, number: int, kind: str) -> list[int]:
        """Return the objects of a kind that are connected to an object, in the file's order."""
        return [source for source, _ in self._sources[number] if self.kind(source) == kind]

    def connected_uses(self, number: int, kinds: tuple[str, ...]) -> list[tuple[int, str]]:
        """Return the objects of some kinds that are connected to an object, each with the property that it feeds."""
        return [(source, use) for source, use in self._sources[number] if self.kind(source) in kinds]

    def value(self, number: int, *names: str) -> list[Any] | None:
        """Return the values of the first of some properties that an object has; None if it has none of them."""
        if number not in self._given:
            self._given[number] = _properties(self.objects[number])
        given = self._given[number]
        template = self._templates.get(self.kind(number), {})
        return next((table[name] for table in (given, template) for name in names if name in table), None)

    def numbers(self, number: int, name: str, default: float) -> NDArray[np.float64]:
        """Return a property of three numbers, (3,); `default` for each if the object has none."""
        found = self.value(number, name)
        if found is None or len(found) < 3:
            return np.full(3, default)
        return np.array(found[:3], np.float64)

    def scalar(self, number: int, name: str, default: float) -> float:
        """Return a property of one number; `default` if the object has none."""
        found = self.value(number, name)
        return float(found[0]) if found and isinstance(found[0], (int, float)) else default

    def world(self, number: int) -> _Matrix:
        """Return the scene_from_model matrix (4, 4) of a model, without its geometric transform.

        Raises ValueError for models that are parents of each other.
        """
        chain: list[int] = []
        at = number
        while at not in self._worlds and self.kind(at) == "Model":
            chain.append(at)
            if len(chain) > _DEPTH:
                raise ValueError("models that nest too deep")
            at = self.parents.get(at, 0)
        matrix = self._worlds.get(at, np.eye(4))
        for model in reversed(chain):
            matrix = self._worlds[model] = matrix @ self._local(model)
        return matrix

    def _local(self, model: int) -> _Matrix:
        """Return the parent_from_model matrix (4, 4), as the FBX SDK defines it by pivots and offsets."""
        three = self.numbers
        order = _ORDERS[int(self.scalar(model, "RotationOrder", 0)) % 7 % 6]
        turns: tuple[NDArray[np.float64], ...] = (np.zeros(3), np.zeros(3))
        if self.scalar(model, "RotationActive", 0):
            turns = three(model, "PreRotation", 0), three(model, "PostRotation", 0)
        else:
            order = _ORDERS[0]
        pivot, scaling_pivot = three(model, "RotationPivot", 0), three(model, "ScalingPivot", 0)
        return (
            _moved(three(model, "Lcl Translation", 0) + three(model, "RotationOffset", 0) + pivot)
            @ _turned(turns[0], "xyz")
            @ _turned(three(model, "Lcl Rotation", 0), order)
            @ _turned(turns[1], "xyz").T
            @ _moved(three(model, "ScalingOffset", 0) + scaling_pivot - pivot)
            @ np.diag([*three(model, "Lcl Scaling", 1), 1.0])
            @ _moved(-scaling_pivot)
        )

    def geometric(self, model: int) -> _Matrix:
        """Return the model_from_geometry matrix (4, 4), which models in the model do not inherit."""
        return (
            _moved(self.numbers(model, "GeometricTranslation", 0))
            @ _turned(self.numbers(model, "GeometricRotation", 0), "xyz")
            @ np.diag([*self.numbers(model, "GeometricScaling", 1), 1.0])
        )


def _properties(node: Node) -> dict[str, list[Any]]:
    """Return the values of an object's properties by their names."""
    table = node.find("Properties70")
    return {
        str(each.properties[0]): each.properties[4:]
        for each in (table.all("P") if table is not None else ())
        if len(each.properties) > 4
    }


def _templates(root: Node) -> "list[tuple[str, dict[str, list[Any]]]]":
    """Return the default properties of each kind of object."""
    section = root.find("Definitions")
    return [
        (str(kind.properties[0]), _properties(template))
        for kind in (section.all("ObjectType") if section is not None else ())
        if kind.properties and (template := kind.find("PropertyTemplate")) is not None
    ]


def _axes(settings: dict[str, list[Any]]) -> _Matrix:
    """Return the matrix (4, 4) to metres and y upward from the axes and the unit that a file says it has."""

    def whole(name: str, default: int) -> int:
        found = settings.get(name) or [default]
        return int(found[0])

    matrix = np.zeros((4, 4))
    for row, (axis, default) in enumerate((("CoordAxis", 0), ("UpAxis", 1), ("FrontAxis", 2))):
        matrix[row, whole(axis, default) % 3] = -1 if whole(f"{axis}Sign", 1) < 0 else 1
    if round(abs(float(np.linalg.det(matrix[:3, :3])))) != 1:
        matrix[:3, :3] = np.eye(3)
    centimetres = float((settings.get("UnitScaleFactor") or [1.0])[0])
    matrix[:3] *= 0.01 * (centimetres if math.isfinite(centimetres) and centimetres > 0 else 1.0)
    matrix[3, 3] = 1
    return matrix


def _moved(by: NDArray[np.float64]) -> _Matrix:
    matrix = np.eye(4)
    matrix[:3, 3] = by
    return matrix


def _turned(degrees: NDArray[np.float64], order: str) -> _Matrix:
    """Return the matrix (4, 4) of rotations about the axes, the first of `order` first."""
    matrix = np.eye(4)
    for axis in order:
        index: Literal[0, 1, 2] = "xyz".index(axis)  # type: ignore[assignment]
        if angle := math.radians(degrees[index]):
            turn = np.eye(4)
            one, two = (index + 1) % 3, (index + 2) % 3
            turn[one, one] = turn[two, two] = math.cos(angle)
            turn[one, two], turn[two, one] = -math.sin(angle), math.sin(angle)
            matrix = turn @ matrix
    return matrix
