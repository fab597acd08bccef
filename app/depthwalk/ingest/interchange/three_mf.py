"""Read 3D Manufacturing Format files (.3mf): a ZIP archive with models in XML.

Read are the core specification, the colours and textures of the materials extension, and models in several parts of the
production extension. Millimetres, the default unit, become metres, and the z axis, which points upward, y.
"""

import io
import posixpath
import re
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from depthwalk.budget import check_memory
from depthwalk.colour import linear_colour
from depthwalk.errors import InputError, quoted
from depthwalk.ingest.interchange.model import Y_FROM_Z, Model, Placed, PlacingBudget, Polygons
from depthwalk.ingest.interchange.xml_tree import run_expat
from depthwalk.ingest.mtl import MtlMaterial
from depthwalk.types import Ints

_ROOT = "3D/3dmodel.model"
_METRES = {
    "micron": 1e-6, "millimeter": 1e-3, "centimeter": 1e-2, "inch": 0.0254, "foot": 0.3048, "meter": 1.0,
}  # fmt: skip
_COLOUR = re.compile(r"#[0-9a-fA-F]{6}(?:[0-9a-fA-F]{2})?")
_MOST_PARTS = 4096  # models in a file
_XML_BYTES = 12  # memory per byte of XML: an element of 50 bytes is a row of numbers
_DEPTH = 64  # components within components

_Attributes = Mapping[str, str]
_Properties = tuple[str | None, int, int, int]  # a group, and its row for each corner
_T = TypeVar("_T")


@dataclass
class _Group:
    """Hold colours, or texture coordinates in a picture, to which vertices of triangles refer."""

    colours: list[tuple[float, float, float, float]] = field(default_factory=list)  # sRGB, alpha; 0 to 1
    uv: list[tuple[float, float]] = field(default_factory=list)
    texture: str | None = None
    is_material: bool = False  # of one colour for each triangle


@dataclass
class _Object:
    """Hold an object: a mesh, or components, which are other objects with matrices."""

    kind: str = "model"
    group: str | None = None
    row: int = 0
    vertices: list[tuple[float, float, float]] = field(default_factory=list)
    corners: list[tuple[int, int, int]] = field(default_factory=list)
    properties: list[_Properties] = field(default_factory=list)
    components: list[tuple[str, str, NDArray[np.float64]]] = field(default_factory=list)


@dataclass
class _Part:
    """Hold one model of the archive."""

    unit: float = 1e-3
    objects: dict[str, _Object] = field(default_factory=dict)
    groups: dict[str, _Group] = field(default_factory=dict)
    textures: dict[str, str] = field(default_factory=dict)  # paths of pictures in the archive
    items: list[tuple[str, str, NDArray[np.float64]]] = field(default_factory=list)


def parse_three_mf(data: bytes, path: Path, geometry: bool) -> Model:
    """Parse a 3MF file, see `reader.parse`."""
    archive = _Archive(data, path)
    root = archive.part(archive.root)
    budget = PlacingBudget(data, path)
    budget.decoded(archive.unpacked)
    scene = _Scene(archive, budget, geometry)
    scale = np.diag([root.unit, root.unit, root.unit, 1.0])
    for part, number, matrix in root.items:
        scene.place(part or archive.root, number, Y_FROM_Z @ scale @ matrix, ())
    return Model(placed=scene.placed, materials=scene.materials, embedded=archive.pictures)


class _Archive:
    """Read the parts of an archive, each once, as long as they take memory that is there."""

    def __init__(self, data: bytes, path: Path) -> None:
        self._path = path
        try:
            self._zip = zipfile.ZipFile(io.BytesIO(data))
        except (zipfile.BadZipFile, ValueError, NotImplementedError):
            raise InputError(f"{path}: not a ZIP archive, as 3MF files are, or truncated") from None
        self._names = {name.lower(): name for name in self._zip.namelist()}
        self._parts: dict[str, _Part] = {}
        self.pictures: dict[str, bytes] = {}
        self.unpacked = 0
        self.root = self._root()

    def _root(self) -> str:
        """Return the name of the model that the relations of the archive name, or of the usual one."""
        found = [""]
        if "_rels/.rels" in self._names:

            def start(tag: str, attributes: dict[str, str]) -> None:
                if attributes.get("Type", "").endswith("/3dmodel"):
                    found.append(attributes.get("Target", ""))

            run_expat(self.read("_rels/.rels"), self._path, start, lambda tag: None)
        return next((name.lstrip("/") for name in found if name), _ROOT)

    def read(self, name: str) -> bytes:
        """Return a file of the archive. Raises InputError if it is missing, damaged or too large."""
        stored = self._names.get(posixpath.normpath(name).lstrip("/").lower())
        if stored is None:
            raise InputError(f"{self._path}: {quoted(name)} is missing in the archive")
        entry = self._zip.getinfo(stored)
        self.unpacked += entry.file_size
        check_memory(self._path, _XML_BYTES * self.unpacked, f"{self.unpacked} bytes that are compressed")
        try:
            with self._zip.open(entry) as file:
                return file.read(entry.file_size)
        except Exception as error:  # zipfile raises nearly anything for damaged or encrypted data
            reason = " ".join(str(error).split())[:80]
            raise InputError(f"{self._path}: {quoted(name)} in the archive is damaged ({reason})") from None

    def part(self, name: str) -> _Part:
        """Return a model of the archive, by its name."""
        name = posixpath.normpath(name).lstrip("/")
        if name not in self._parts:
            if len(self._parts) == _MOST_PARTS:
                raise InputError(f"{self._path}: more than {_MOST_PARTS} models")
            self._parts[name] = _parse_part(self.read(name), self._path)
        return self._parts[name]

    def picture(self, name: str) -> str:
        """Take a picture of the archive into `pictures`; return its name there."""
        if name not in self.pictures:
            self.pictures[name] = self.read(name)
        return name


def _parse_part(data: bytes, path: Path) -> _Part:
    """Parse a model. Attributes are those of the element alone, so that a damaged file breaks none but its own."""
    part = _Part()
    drawn: list[_Object] = []  # the object in which the parser is
    groups: list[_Group] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        name = tag.rsplit(":", 1)[-1]
        if name == "vertex":
            drawn[-1].vertices.append((float(attributes["x"]), float(attributes["y"]), float(attributes["z"])))
        elif name == "triangle":
            _triangle(drawn[-1], attributes)
        elif name == "object":
            made = _Object(attributes.get("type", "model"), attributes.get("pid"), int(attributes.get("pindex", 0)))
            drawn.append(made)
            part.objects[attributes["id"]] = made
        elif name in ("component", "item"):
            use = _path(attributes), attributes["objectid"], _matrix(attributes.get("transform"), path)
            (part.items if name == "item" else drawn[-1].components).append(use)
        elif name in ("basematerials", "colorgroup", "texture2dgroup"):
            groups.append(_Group(texture=attributes.get("texid"), is_material=name == "basematerials"))
            part.groups[attributes["id"]] = groups[-1]
        elif name in ("base", "color"):
            groups[-1].colours.append(_colour(attributes.get("displaycolor") or attributes.get("color", "")))
        elif name == "tex2coord":
            groups[-1].uv.append((float(attributes["u"]), float(attributes["v"])))
        elif name == "texture2d":
            part.textures[attributes["id"]] = attributes["path"]
        elif name == "model":
            part.unit = _METRES.get(attributes.get("unit", "millimeter"), 1e-3)

    run_expat(data, path, start, lambda tag: None)
    return part


def _triangle(drawn: _Object, attributes: _Attributes) -> None:
    drawn.corners.append((int(attributes["v1"]), int(attributes["v2"]), int(attributes["v3"])))
    if "p1" not in attributes:
        drawn.properties.append((None, -1, -1, -1))
        return
    first = int(attributes["p1"])
    others = int(attributes.get("p2", first)), int(attributes.get("p3", first))
    drawn.properties.append((attributes.get("pid") or drawn.group, first, *others))


def _path(attributes: _Attributes) -> str:
    """Return the part of the archive in which a component's object is; "" for the same."""
    return next((value for key, value in attributes.items() if key.rsplit(":", 1)[-1] == "path"), "")


def _matrix(text: str | None, path: Path) -> NDArray[np.float64]:
    """Return a matrix (4, 4) that multiplies columns; the format's multiply rows from the left."""
    matrix = np.eye(4)
    if text:
        numbers = text.split()
        if len(numbers) != 12:
            raise InputError(f"{path}: a transform of {len(numbers)} numbers, not 12")
        matrix[:3] = np.array(numbers, np.float64).reshape(4, 3).T
    return matrix


def _colour(text: str) -> tuple[float, float, float, float]:
    if not _COLOUR.fullmatch(text):
        return (1.0, 1.0, 1.0, 1.0)
    red, green, blue, alpha = bytes.fromhex(text[1:].ljust(8, "f"))
    return red / 255, green / 255, blue / 255, alpha / 255


class _Scene:
    """Place objects, and name the materials that they use."""

    def __init__(self, archive: _Archive, budget: PlacingBudget, geometry: bool) -> None:
        self._archive, self._budget, self._geometry = archive, budget, geometry
        self._meshes: dict[tuple[str, str], Polygons | None] = {}
        self.placed: list[Placed] = []
        self.materials: dict[str, MtlMaterial] = {}

    def place(self, part: str, number: str, matrix: NDArray[np.float64], above: tuple[tuple[str, str], ...]) -> None:
        """Place an object of a part, and its components; `above` are those that it is a component of."""
        self._budget.step()
        key = part, number
        path = self._archive._path
        if key in above or len(above) > _DEPTH:
            raise InputError(f"{path}: object {quoted(number)} is a component of itself")
        drawn = self._archive.part(part).objects.get(number)
        if drawn is None:
            raise InputError(f"{path}: object {quoted(number)} is missing")
        if drawn.kind == "support":
            return
        if key not in self._meshes:
            self._meshes[key] = self._polygons(drawn, self._archive.part(part))
        if (polygons := self._meshes[key]) is not None and self._geometry:
            self._budget.place(polygons)
            self.placed.append(Placed(polygons=polygons, matrix=matrix))
        for other, inner, placing in drawn.components:
            self.place(other or part, inner, matrix @ placing, (*above, key))

    def _polygons(self, drawn: _Object, part: _Part) -> Polygons | None:
        """Return the triangles of an object, with colours or texture coordinates; None if it has none."""
        if not drawn.corners:
            return None
        count = len(drawn.corners)
        names: dict[str | None, int] = {}
        material = np.zeros(count, np.int64)
        colours, uv = np.full((count, 3, 3), 255, np.uint8), np.zeros((count, 3, 2))
        coloured = False
        default = (drawn.group, drawn.row, drawn.row, drawn.row)
        for properties, rows in _distinct(drawn.properties).items():
            number, *indices = default if properties[0] is None else properties
            group = part.groups.get(number or "")
            name = None
            if group is not None and group.texture is not None:
                name = self._texture(group.texture, part)
                uv[rows] = [_at(group.uv, index, (0.0, 0.0)) for index in indices]
            elif group is not None:
                found = [_at(group.colours, index, (1.0, 1.0, 1.0, 1.0)) for index in indices]
                name = self._plain(found[0][3])
                colours[rows] = np.round(np.array(found)[:, :3] * 255)
                coloured = True
            material[rows] = names.setdefault(name, len(names))
        return Polygons(
            positions=np.array(drawn.vertices, np.float64).reshape(-1, 3),
            vertex=np.array(drawn.corners, np.int64).ravel(),
            sizes=np.full(count, 3),
            uv=uv.reshape(-1, 2) if any(name in self._archive.pictures for name in names) else None,
            colours=colours.reshape(-1, 3) if coloured else None,
            material=material,
            names=tuple(names),
        )

    def _plain(self, alpha: float) -> str:
        """Return the name of the white material that colours of triangles multiply, with an opacity."""
        name = f"#{round(alpha * 255):02x}"
        white = list(map(float, linear_colour((1.0, 1.0, 1.0))))
        self.materials[name] = MtlMaterial(terms={"kd": white, "d": alpha})
        return name

    def _texture(self, number: str, part: _Part) -> str | None:
        """Return the name of the material that shows a picture; None if it is missing."""
        if number not in part.textures:
            return None
        picture = self._archive.picture(part.textures[number])
        self.materials[picture] = MtlMaterial(image=picture)
        return picture


def _distinct(properties: list[_Properties]) -> dict[_Properties, Ints]:
    """Return the rows of each distinct tuple."""
    rows: dict[_Properties, list[int]] = {}
    for row, each in enumerate(properties):
        rows.setdefault(each, []).append(row)
    return {each: np.array(found, np.int64) for each, found in rows.items()}


def _at(rows: list[_T], index: int, default: _T) -> _T:
    return rows[index] if 0 <= index < len(rows) else default
