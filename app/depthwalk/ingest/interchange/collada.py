"""Read COLLADA files (.dae, 1.4 and 1.5): nodes of the visual scene, turned and scaled as the file says."""

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError, quoted
from depthwalk.ingest.interchange.collada_geometry import Meshes
from depthwalk.ingest.interchange.collada_materials import read_materials
from depthwalk.ingest.interchange.model import Model, Placed, PlacingBudget, Polygons, posed, unread_parts
from depthwalk.ingest.interchange.xml_tree import Element, parse_tree

_Matrix = NDArray[np.float64]
_DEPTH = 128  # nodes within nodes
_UP: dict[str, tuple[tuple[float, float, float], ...]] = {  # rows: x, y and z of the result
    "X_UP": ((0, -1, 0), (1, 0, 0), (0, 0, 1)),
    "Y_UP": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "Z_UP": ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
}


def parse_collada(data: bytes, path: Path, geometry: bool) -> Model:
    """Parse a COLLADA file, see `reader.parse`."""
    root = parse_tree(data, path, "COLLADA")
    materials, names = read_materials(root)
    unread = _unread(root)
    if not geometry:
        return Model(materials=materials, unread=unread)
    scene = _Scene(root, names, PlacingBudget(data, path), path)
    scene.place_all()
    return Model(placed=scene.placed, materials=materials, unread=unread)


def _unread(root: Element) -> tuple[str, ...]:
    moves = any(library.find("animation") is not None for library in root.all("library_animations"))
    clips = sum(len(list(library.all("animation_clip"))) for library in root.all("library_animation_clips"))
    return unread_parts(
        animations=max(clips, 1) if moves else 0,
        cameras=len(list(_every(root, "instance_camera"))),
        lamps=len(list(_every(root, "instance_light"))),
        shapes=sum(controller.find("morph") is not None for controller in _every(root, "controller")),
    )


def target(reference: str | None) -> str:
    """Return the ID that a reference within the file points to."""
    return (reference or "").rsplit("#", 1)[-1]


class _Scene:
    """Place the meshes of a file by its nodes."""

    def __init__(self, root: Element, names: dict[str, str], budget: PlacingBudget, path: Path) -> None:
        self._root, self._names, self._budget, self._path = root, names, budget, path
        self._meshes = Meshes(root)
        self._nodes = {node.attributes["id"]: node for node in _every(root, "node") if "id" in node.attributes}
        self._controllers = {
            each.attributes.get("id", ""): each
            for library in root.all("library_controllers")
            for each in library.all("controller")
        }
        self._worlds: dict[int, _Matrix] = {}  # of the nodes in sight, by the identity of the element
        self._skins: list[tuple[Element, _Matrix]] = []  # controllers, placed once all joints are
        self.placed: list[Placed] = []

    def place_all(self) -> None:
        """Place all meshes of the scene; those of a file without one stand as they are."""
        frame = _frame(self._root)
        scene = self._visual_scene()
        if scene is None:
            for mesh in self._meshes.all():
                self._add(mesh, {}, frame)
            return
        for node in scene.all("node"):
            self._place(node, frame, ())
        for use, matrix in self._skins:
            self._add_skinned(use, matrix, frame)

    def _visual_scene(self) -> Element | None:
        scenes = [each for library in self._root.all("library_visual_scenes") for each in library.all("visual_scene")]
        use = self._root.find("scene", "instance_visual_scene")
        named = target(use.attributes.get("url")) if use is not None else ""
        found = [each for each in scenes if each.attributes.get("id") == named]
        return next(iter(found or scenes), None)

    def _place(self, node: Element, above: _Matrix, parents: tuple[int, ...]) -> None:
        """Place what a node shows, and the nodes in it. Raises InputError for nodes that place themselves."""
        self._budget.step()
        if id(node) in parents or len(parents) > _DEPTH:
            raise InputError(
                f"{self._path}: node {quoted(node.attributes.get('id', ''))} is within itself, or too deep"
            )
        matrix = self._worlds[id(node)] = above @ _local(node)
        inner = (*parents, id(node))
        for child in node.children:
            match child.tag:
                case "skew":
                    raise InputError(f"{self._path}: a node has a 'skew', which is not read; bake it into a 'matrix'")
                case "node":
                    self._place(child, matrix, inner)
                case "instance_node":
                    if (other := self._nodes.get(target(child.attributes.get("url")))) is not None:
                        self._place(other, matrix, inner)
                case "instance_geometry":
                    for mesh in self._meshes.of(target(child.attributes.get("url"))):
                        self._add(mesh, _bound(child), matrix)
                case "instance_controller":
                    self._skins.append((child, matrix))

    def _add(self, mesh: Polygons, bound: dict[str, str], matrix: _Matrix) -> None:
        """Place a mesh, whose symbols of materials are `bound` to materials by their IDs."""
        self._budget.place(mesh)
        names = tuple(None if each is None else self._names.get(bound.get(each, each)) for each in mesh.names)
        self.placed.append(Placed(polygons=replace(mesh, names=names), matrix=matrix))

    def _add_skinned(self, use: Element, matrix: _Matrix, frame: _Matrix) -> None:
        """Place the mesh of a controller as its joints stand, or as its node does if it has none."""
        controller = self._controllers.get(target(use.attributes.get("url")))
        for _ in range(8):  # controllers of controllers: shape keys of a skin
            inner = None
            if controller is not None:
                skin, morph = controller.find("skin"), controller.find("morph")
                inner = skin if skin is not None else morph
            if controller is None or inner is None:
                return
            source = target(inner.attributes.get("source"))
            meshes = self._meshes.of(source)
            if inner.tag == "skin" and meshes:
                held = _Skin(inner, self._joints(use))
                for mesh in meshes:
                    self._budget.pose()
                    moved = held.posed(mesh, frame)
                    self._add(moved or mesh, _bound(use), np.eye(4) if moved else matrix)
                return
            for mesh in meshes:
                self._add(mesh, _bound(use), matrix)
            if meshes:
                return
            controller = self._controllers.get(source)

    def _joints(self, use: Element) -> dict[str, _Matrix]:
        """Return the matrices of the nodes that a controller may name, by SID, ID and name; SIDs come first."""
        roots = [
            node for skeleton in use.all("skeleton") if (node := self._nodes.get(target(skeleton.text))) is not None
        ] or list(self._nodes.values())
        found: dict[str, _Matrix] = {}
        nodes = [node for root in roots for node in (root, *_every(root, "node"))]
        for key in ("sid", "id", "name"):
            for node in nodes:
                if key in node.attributes and id(node) in self._worlds:
                    found.setdefault(node.attributes[key], self._worlds[id(node)])
        return found


class _Skin:
    """Pose the mesh of a skin."""

    def __init__(self, skin: Element, joints: dict[str, _Matrix]) -> None:
        self._skin, self._joints = skin, joints
        self._sources = {each.attributes.get("id", ""): each for each in skin.all("source")}

    def posed(self, mesh: Polygons, frame: _Matrix) -> Polygons | None:
        """Return the polygons of a mesh in metres, y upward; None if joints are missing."""
        joints, influences = self._skin.find("joints"), self._skin.find("vertex_weights")
        shape = self._skin.find("bind_shape_matrix")
        if joints is None or influences is None:
            return None
        bind = np.eye(4) if shape is None else shape.numbers().reshape(4, 4)
        names = self._input(joints, "JOINT")
        inverse = self._input(joints, "INV_BIND_MATRIX")
        weights = self._input(influences, "WEIGHT")
        counts, pairs = influences.find("vcount"), influences.find("v")
        if names is None or inverse is None or weights is None or counts is None or pairs is None:
            return None
        words = _words(names)
        if not words or not all(word in self._joints for word in words):
            return None
        inverses = _floats(inverse).reshape(-1, 4, 4)
        matrices = np.stack([self._joints[word] @ inverses[row] @ bind for row, word in enumerate(words)])[:, :3]
        offsets = {each.attributes["semantic"]: int(each.attributes["offset"]) for each in influences.all("input")}
        step = max(offsets.values()) + 1
        per_pair = pairs.integers().reshape(-1, step)
        vertices = np.repeat(np.arange(len(counts.integers())), counts.integers())
        joint = per_pair[:, offsets["JOINT"]]
        if len(vertices) != len(per_pair):
            raise ValueError("weights of vertices that are missing")
        held = joint >= 0  # -1: the vertex stays where the skin is bound
        parts = _floats(weights)[per_pair[:, offsets["WEIGHT"]]]
        return posed(mesh, vertices[held], matrices[joint[held]], parts[held], frame @ bind)

    def _input(self, element: Element, semantic: str) -> Element | None:
        use = next((each for each in element.all("input") if each.attributes.get("semantic") == semantic), None)
        return None if use is None else self._sources.get(target(use.attributes.get("source")))


def _words(source: Element) -> list[str]:
    for tag in ("Name_array", "IDREF_array"):
        if (found := source.find(tag)) is not None:
            return found.text.split()
    return []


def _floats(source: Element) -> NDArray[np.float64]:
    found = source.find("float_array")
    return np.zeros(0) if found is None else found.numbers()


def _every(element: Element, tag: str) -> Iterator[Element]:
    """Yield all descendants with a tag, those in the file first that come first."""
    waiting = list(reversed(element.children))
    while waiting:
        found = waiting.pop()
        if found.tag == tag:
            yield found
        waiting += reversed(found.children)


def _bound(use: Element) -> dict[str, str]:
    """Return the materials by their IDs that a use of a geometry binds to symbols."""
    common = use.find("bind_material", "technique_common")
    return {
        each.attributes.get("symbol", ""): target(each.attributes.get("target"))
        for each in (common.all("instance_material") if common is not None else ())
    }


def _frame(root: Element) -> _Matrix:
    """Return the matrix (4, 4) to metres and y upward."""
    unit, up = root.find("asset", "unit"), root.find("asset", "up_axis")
    metres = float(unit.attributes.get("meter", "1").replace(",", ".")) if unit is not None else 1.0
    matrix = np.eye(4)
    matrix[:3, :3] = np.array(_UP.get(up.text if up is not None else "Y_UP", _UP["Y_UP"]))
    matrix[:3] *= metres if math.isfinite(metres) and metres > 0 else 1.0
    return matrix


def _local(node: Element) -> _Matrix:
    """Return the parent_from_node matrix (4, 4): all transforms of a node, the first of them outermost."""
    matrix = np.eye(4)
    for child in node.children:
        match child.tag:
            case "matrix":
                matrix = matrix @ child.numbers().reshape(4, 4)
            case "translate":
                step = np.eye(4)
                step[:3, 3] = child.numbers()
                matrix = matrix @ step
            case "scale":
                x, y, z = child.numbers()
                matrix = matrix @ np.diag([x, y, z, 1.0])
            case "rotate":
                *axis, angle = child.numbers()
                matrix = matrix @ _turn(np.array(axis), math.radians(angle))
            case "lookat":
                matrix = matrix @ _look(child.numbers().reshape(3, 3))
    return matrix


def _turn(axis: NDArray[np.float64], angle: float) -> _Matrix:
    """Return the matrix (4, 4) of a rotation about an axis, by Rodrigues' formula."""
    length = float(np.linalg.norm(axis))
    matrix = np.eye(4)
    if length > 0 and math.isfinite(length):
        x, y, z = axis / length
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        matrix[:3, :3] += math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    return matrix


def _look(rows: NDArray[np.float64]) -> _Matrix:
    """Return the matrix (4, 4) of an eye, what it looks at, and the direction upward (COLLADA 1.4, lookat)."""
    eye, at, up = rows
    back = (eye - at) / np.linalg.norm(eye - at)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :] = np.stack([right, np.cross(back, right), back, eye], axis=1)
    return matrix
