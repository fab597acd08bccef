"""Read the meshes of COLLADA files: polygons, strips and fans with inputs of several indices."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthwalk.ingest.interchange.model import Polygons
from depthwalk.ingest.interchange.xml_tree import Element
from depthwalk.types import Ints

_KINDS = ("triangles", "polylist", "polygons", "tristrips", "trifans")
_WIDTHS = {"POSITION": 3, "NORMAL": 3, "TEXCOORD": 2, "COLOR": 3}


@dataclass(frozen=True, kw_only=True)
class _Corners:
    """Hold the corners of polygons: rows (C, offsets) of indices, and the sizes (P,) of the polygons."""

    indices: Ints
    sizes: Ints


class Meshes:
    """Read the meshes of a file, each when it is first asked for."""

    def __init__(self, root: Element) -> None:
        """Find the geometries in a file."""
        self._geometries = {
            each.attributes.get("id", ""): each
            for library in root.all("library_geometries")
            for each in library.all("geometry")
        }
        self._read: dict[str, list[Polygons]] = {}

    def of(self, number: str) -> list[Polygons]:
        """Return the meshes of a geometry by its ID, one for each run of polygons; none if it has none."""
        if number not in self._read:
            geometry = self._geometries.get(number)
            mesh = geometry.find("mesh") if geometry is not None else None
            self._read[number] = [] if mesh is None else _polygons(mesh)
        return self._read[number]

    def all(self) -> list[Polygons]:
        """Return the meshes of all geometries."""
        return [mesh for number in self._geometries for mesh in self.of(number)]


def _polygons(mesh: Element) -> list[Polygons]:
    """Return the polygons of a mesh, one for each of its elements with polygons. Raises ValueError for damaged data."""
    sources = {each.attributes.get("id", ""): each for each in mesh.all("source")}
    shared = mesh.find("vertices")
    of_vertices = list(shared.all("input")) if shared is not None else []
    values: dict[str, NDArray[np.float64]] = {}

    def rows(use: Element) -> NDArray[np.float64]:
        name = use.attributes.get("source", "").lstrip("#")
        if name not in values:
            values[name] = _accessed(sources[name], _WIDTHS[use.attributes["semantic"]])
        return values[name]

    found: list[Polygons] = []
    for element in (child for child in mesh.children if child.tag in _KINDS):
        inputs: dict[str, tuple[Element, int]] = {}
        step = 0
        for use in element.all("input"):
            offset = int(use.attributes.get("offset", 0))
            step = max(step, offset + 1)
            every = of_vertices if use.attributes.get("semantic") == "VERTEX" else [use]
            for each in sorted(every, key=_set):
                inputs.setdefault(each.attributes.get("semantic", ""), (each, offset))
        if "POSITION" not in inputs or not 0 < step <= 64:
            continue
        corners = _corners(element, step)
        if not len(corners.indices):
            continue

        def taken(
            semantic: str, inputs: dict[str, tuple[Element, int]] = inputs, corners: _Corners = corners
        ) -> NDArray[np.float64] | None:
            if semantic not in inputs:
                return None
            use, offset = inputs[semantic]
            values = rows(use)
            index = corners.indices[:, offset]
            if not len(values) or index.min() < 0 or index.max() >= len(values):
                raise ValueError(f"an index of {semantic} outside of its {len(values)} rows")
            return values[index]

        use, offset = inputs["POSITION"]
        colours = taken("COLOR")
        found.append(
            Polygons(
                positions=rows(use),
                vertex=corners.indices[:, offset],
                sizes=corners.sizes,
                normals=taken("NORMAL"),
                uv=taken("TEXCOORD"),
                colours=None if colours is None else np.round(np.clip(colours, 0, 1) * 255).astype(np.uint8),
                material=np.zeros(len(corners.sizes), np.int64),
                names=(element.attributes.get("material"),),
            )
        )
    return found


def _set(use: Element) -> int:
    return int(use.attributes.get("set", 0))


def _accessed(source: Element, width: int) -> NDArray[np.float64]:
    """Return the rows (n, width) that a source's accessor describes; components that are missing are 0."""
    array, accessor = source.find("float_array"), source.find("technique_common", "accessor")
    if array is None:
        raise ValueError("a source without numbers")
    numbers = array.numbers()
    if accessor is None:
        return numbers.reshape(-1, width)
    stride, offset = int(accessor.attributes.get("stride", 1)), int(accessor.attributes.get("offset", 0))
    count = int(accessor.attributes.get("count", 0))
    # Parameters without a name are skipped (COLLADA 1.4, accessor); some exporters name none.
    names = [each.attributes.get("name", "") for each in accessor.all("param")]
    columns = [column for column, name in enumerate(names) if name] or list(range(stride))
    if stride < 1 or offset < 0 or count < 0 or offset + stride * count > len(numbers) or max(columns) >= stride:
        raise ValueError("a source that is shorter than its accessor says")
    rows = numbers[offset : offset + stride * count].reshape(count, stride)[:, columns[:width]]
    return np.pad(rows, ((0, 0), (0, width - rows.shape[1])))


def _corners(element: Element, step: int) -> _Corners:
    """Return the corners of the polygons of an element whose inputs take `step` indices at each."""
    lists = [each.integers() for each in element.all("p")]
    for outline in element.all("ph"):  # polygons with holes: the holes are filled
        lists += [each.integers() for each in outline.all("p")]
    runs = [each[: len(each) - len(each) % step].reshape(-1, step) for each in lists]
    if not runs:
        return _Corners(indices=np.zeros((0, step), np.int64), sizes=np.zeros(0, np.int64))
    whole = np.concatenate(runs)
    if element.tag == "polylist":
        counts = element.find("vcount")
        sizes = counts.integers() if counts is not None else np.zeros(0, np.int64)
        if (sizes < 0).any() or sizes.sum() != len(whole):
            raise ValueError(f"polygons of {sizes.sum()} corners, with indices of {len(whole)}")
        return _Corners(indices=whole, sizes=sizes)
    if element.tag == "polygons":
        return _Corners(indices=whole, sizes=np.array([len(run) for run in runs], np.int64))
    if element.tag == "triangles":
        whole = whole[: len(whole) // 3 * 3]
        return _Corners(indices=whole, sizes=np.full(len(whole) // 3, 3))
    cut = _strip if element.tag == "tristrips" else _fan
    whole = np.concatenate([run[cut(len(run))] for run in runs])
    return _Corners(indices=whole, sizes=np.full(len(whole) // 3, 3))


def _strip(count: int) -> Ints:
    """Return the corners of the triangles of a strip of `count` corners; each second one is turned."""
    triangles = np.arange(max(count - 2, 0), dtype=np.int64)[:, None] + np.arange(3)
    triangles[1::2] = triangles[1::2, [1, 0, 2]]
    return triangles.ravel()


def _fan(count: int) -> Ints:
    """Return the corners of the triangles of a fan of `count` corners."""
    step: Ints = np.arange(max(count - 2, 0), dtype=np.int64)
    return np.asarray(step[:, None] * np.array([0, 1, 1]) + np.arange(3), np.int64).ravel()
