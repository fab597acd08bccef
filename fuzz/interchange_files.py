"""Write small scenes as FBX, COLLADA, 3D Studio, 3MF and OBJ files, for fuzzing and for tests."""

import base64
import io
import math
import struct
import zipfile
import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.colour import srgb8_from_linear
from fuzz.case import Files

Vector = tuple[float, float, float]
_Node = tuple[str, list[Any], "list[_Node]"]
_Y_FROM_Z = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])


@dataclass(frozen=True, kw_only=True)
class Paint:
    """A material: linear colour, or a picture by its name."""

    name: str
    colour: Vector = (0.8, 0.8, 0.8)
    picture: str | None = None
    opacity: float = 1.0
    specular: float = 0.0
    exponent: float = 32.0
    emission: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class Shape:
    """A mesh: vertices (V, 3), polygons of their numbers, and what their corners (C) have, one after the other."""

    positions: NDArray[np.float64]
    polygons: list[list[int]]
    normals: NDArray[np.float64] | None = None
    uv: NDArray[np.float64] | None = None
    colours: NDArray[np.float64] | None = None

    @property
    def vertex(self) -> NDArray[np.int64]:
        """Return the vertex of each corner (C,)."""
        return np.concatenate([np.array(each, np.int64) for each in self.polygons])

    @property
    def sizes(self) -> list[int]:
        """Return the number of corners of each polygon."""
        return [len(each) for each in self.polygons]


@dataclass(frozen=True, kw_only=True)
class Use:
    """A node that shows a mesh: scaled, then turned about x, y and z, in degrees, then moved."""

    name: str
    shape: Shape
    paint: Paint
    moved: Vector = (0, 0, 0)
    turned: Vector = (0, 0, 0)
    scaled: Vector = (1, 1, 1)

    @property
    def matrix(self) -> NDArray[np.float64]:
        """Return the scene_from_mesh matrix (4, 4)."""
        matrix = np.diag([*self.scaled, 1.0])
        for axis, degrees in enumerate(self.turned):
            turn, one, two = np.eye(4), (axis + 1) % 3, (axis + 2) % 3
            cosine, sine = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
            turn[one, one] = turn[two, two] = cosine
            turn[one, two], turn[two, one] = -sine, sine
            matrix = turn @ matrix
        matrix[:3, 3] = self.moved
        return matrix


def cube() -> Shape:
    """Return a cube from −1 to 1 of quadrangles, each with the whole picture, and colours by the place."""
    positions = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)
    polygons = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    normals = np.repeat(np.array([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1.0]]), 4, axis=0)
    uv = np.tile([[0, 0], [1, 0], [1, 1], [0, 1.0]], (6, 1))
    corners = np.concatenate([np.array(each) for each in polygons])
    return Shape(positions=positions, polygons=polygons, normals=normals, uv=uv, colours=positions[corners] / 2 + 0.5)


def _distinct(uses: list[Use]) -> tuple[list[Shape], list[Paint]]:
    shapes = list({id(use.shape): use.shape for use in uses}.values())
    return shapes, list({use.paint.name: use.paint for use in uses}.values())


def _words(values: Any) -> str:
    return " ".join(f"{value:.9g}" for value in np.asarray(values).ravel().tolist())


def obj(uses: list[Use], pictures: Files) -> Files:
    """Return an OBJ file with its library and pictures; nodes are applied."""
    lines, base, corner = ["mtllib scene.mtl"], 1, 1
    for use in uses:
        shape, linear = use.shape, use.matrix[:3, :3]
        lines += [f"v {_words(place)}" for place in shape.positions @ linear.T + use.matrix[:3, 3]]
        assert shape.normals is not None and shape.uv is not None
        lines += [f"vn {_words(normal)}" for normal in shape.normals @ np.linalg.inv(linear)]
        lines += [f"vt {_words(place)}" for place in shape.uv]
        lines.append(f"usemtl {use.paint.name}")
        for polygon in shape.polygons:
            words = [f"{vertex + base}/{corner + k}/{corner + k}" for k, vertex in enumerate(polygon)]
            turned = words if np.linalg.det(linear) > 0 else [words[0], *reversed(words[1:])]  # the same diagonal
            lines.append("f " + " ".join(turned))
            corner += len(polygon)
        base += len(shape.positions)
    library = []
    for paint in _distinct(uses)[1]:
        library += [
            f"newmtl {paint.name}",
            f"Kd {_words((1, 1, 1) if paint.picture else paint.colour)}",
            f"d {paint.opacity}",
        ]
        library += [f"Ks {_words([paint.specular] * 3)}", f"Ns {paint.exponent}", f"Ke {_words(paint.emission)}"]
        library += [f"map_Kd {paint.picture}"] if paint.picture else []
    return {"scene.obj": "\n".join(lines).encode(), "scene.mtl": "\n".join(library).encode(), **pictures}


def dae(uses: list[Use], pictures: Files, *, up: str = "Y_UP", metre: float = 1.0) -> Files:
    """Return a COLLADA file with its pictures; places are those of its own axes and unit."""
    shapes, paints = _distinct(uses)
    images = "".join(f'<image id="{name}"><init_from>{name}</init_from></image>' for name in pictures)
    effects, materials, geometries, nodes = "", "", "", ""
    for paint in paints:
        diffuse = f"<color>{_words(paint.colour)} 1</color>"
        parameters = ""
        if paint.picture:
            parameters = (
                f'<newparam sid="f"><surface type="2D"><init_from>{paint.picture}</init_from></surface></newparam>'
                '<newparam sid="s"><sampler2D><source>f</source></sampler2D></newparam>'
            )
            diffuse = '<texture texture="s" texcoord="UV"/>'
        effects += (
            f'<effect id="{paint.name}-fx"><profile_COMMON>{parameters}<technique sid="t"><phong>'
            f"<emission><color>{_words(paint.emission)} 1</color></emission><diffuse>{diffuse}</diffuse>"
            f"<specular><color>{_words([paint.specular] * 3)} 1</color></specular>"
            f"<shininess><float>{paint.exponent}</float></shininess>"
            f"<transparency><float>{paint.opacity}</float></transparency></phong></technique></profile_COMMON></effect>"
        )
        materials += f'<material id="{paint.name}-m"><instance_effect url="#{paint.name}-fx"/></material>'
    for number, shape in enumerate(shapes):
        geometries += _dae_geometry(f"g{number}", shape)
    numbers = {id(shape): number for number, shape in enumerate(shapes)}
    for use in uses:
        turns = "".join(
            f"<rotate>{' '.join('1' if k == axis else '0' for k in range(3))} {use.turned[axis]}</rotate>"
            for axis in (2, 1, 0)
        )
        nodes += (
            f'<node name="{use.name}"><translate>{_words(use.moved)}</translate>{turns}'
            f'<scale>{_words(use.scaled)}</scale><instance_geometry url="#g{numbers[id(use.shape)]}"><bind_material>'
            f'<technique_common><instance_material symbol="a" target="#{use.paint.name}-m"/></technique_common>'
            "</bind_material></instance_geometry></node>"
        )
    text = (
        '<?xml version="1.0" encoding="utf-8"?>\n<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" '
        f'version="1.4.1"><asset><unit meter="{metre}"/><up_axis>{up}</up_axis></asset>\n'
        f"<library_images>{images}</library_images>\n<library_effects>{effects}</library_effects>\n"
        f"<library_materials>{materials}</library_materials>\n<library_geometries>{geometries}</library_geometries>\n"
        f'<library_visual_scenes><visual_scene id="v">{nodes}</visual_scene></library_visual_scenes>\n'
        '<scene><instance_visual_scene url="#v"/></scene></COLLADA>'
    )
    return {"scene.dae": text.replace("><", ">\n<").encode(), **pictures}


def _dae_geometry(name: str, shape: Shape) -> str:
    sources, inputs, columns = "", "", [shape.vertex]
    layers = [("POSITION", shape.positions, "XYZ")]
    layers += [("NORMAL", shape.normals, "XYZ")] if shape.normals is not None else []
    layers += [("TEXCOORD", shape.uv, "ST")] if shape.uv is not None else []
    layers += [("COLOR", shape.colours, "RGB")] if shape.colours is not None else []
    for semantic, values, parameters in layers:
        sources += (
            f'<source id="{name}-{semantic}"><float_array id="{name}-{semantic}-a" count="{values.size}">'
            f'{_words(values)}</float_array><technique_common><accessor source="#{name}-{semantic}-a" '
            f'count="{len(values)}" stride="{values.shape[1]}">'
            + "".join(f'<param name="{each}" type="float"/>' for each in parameters)
            + "</accessor></technique_common></source>"
        )
        if semantic != "POSITION":
            inputs += f'<input semantic="{semantic}" source="#{name}-{semantic}" offset="{len(columns)}"/>'
            columns.append(np.arange(len(shape.vertex)))
    return (
        f'<geometry id="{name}"><mesh>{sources}<vertices id="{name}-v"><input semantic="POSITION" '
        f'source="#{name}-POSITION"/></vertices><polylist material="a" count="{len(shape.polygons)}">'
        f'<input semantic="VERTEX" source="#{name}-v" offset="0"/>{inputs}<vcount>{_words(shape.sizes)}</vcount>'
        f"<p>{_words(np.stack(columns, axis=1))}</p></polylist></mesh></geometry>"
    )


def fbx(
    uses: list[Use],
    pictures: Files,
    *,
    text: bool = False,
    embedded: bool = False,
    z_up: bool = False,
    centimetres: float = 100.0,
    version: int = 7400,
) -> Files:
    """Return an FBX file, binary or of text, with its pictures beside it or embedded."""
    root = _fbx_nodes(uses, pictures if embedded else {}, z_up=z_up, centimetres=centimetres, version=version)
    data = _fbx_text(root) if text else _fbx_binary(root, version)
    return {"scene.fbx": data, **({} if embedded else pictures)}


def _fbx_nodes(uses: list[Use], embedded: Files, *, z_up: bool, centimetres: float, version: int) -> list[_Node]:
    shapes, paints = _distinct(uses)
    kept = {paint.name: paint for paint in paints}
    numbers = {id(each): 1000 + k for k, each in enumerate((*shapes, *paints, *uses))}
    objects: list[_Node] = []
    links: list[_Node] = []

    def link(kind: str, *ends: Any) -> None:
        links.append(("C", [kind, *ends], []))

    objects += [_fbx_geometry(numbers[id(shape)], shape) for shape in shapes]
    for paint in paints:
        number = numbers[id(paint)]
        properties = [
            _property("DiffuseColor", "Color", paint.colour),
            _property("SpecularColor", "Color", [paint.specular] * 3),
            _property("ShininessExponent", "Number", [paint.exponent]),
            _property("EmissiveColor", "Color", paint.emission),
            _property("Opacity", "double", [paint.opacity]),
        ]
        parts: list[_Node] = [("ShadingModel", ["phong"], []), ("Properties70", [], properties)]
        objects.append(("Material", [number, f"{paint.name}\0\1Material", ""], parts))
        if paint.picture:
            names: list[_Node] = [
                ("FileName", [f"C:\\work\\{paint.picture}"], []),
                ("RelativeFilename", [paint.picture], []),
            ]
            objects.append(("Texture", [number + 5000, f"{paint.name}\0\1Texture", ""], names))
            link("OP", number + 5000, number, "DiffuseColor")
            if paint.picture in embedded:
                content: _Node = ("Content", [embedded[paint.picture]], [])
                objects.append(("Video", [number + 6000, f"{paint.name}\0\1Video", "Clip"], [*names[1:], content]))
                link("OO", number + 6000, number + 5000)
    for use in uses:
        placing = [
            _property("Lcl Translation", "Lcl Translation", use.moved),
            _property("Lcl Rotation", "Lcl Rotation", use.turned),
            _property("Lcl Scaling", "Lcl Scaling", use.scaled),
        ]
        objects.append(("Model", [numbers[id(use)], f"{use.name}\0\1Model", "Mesh"], [("Properties70", [], placing)]))
        link("OO", numbers[id(use)], 0)
        link("OO", numbers[id(use.shape)], numbers[id(use)])
        link("OO", numbers[id(kept[use.paint.name])], numbers[id(use)])
    axes = (
        {"UpAxis": (2, 1), "FrontAxis": (1, -1), "CoordAxis": (0, 1)}
        if z_up
        else {"UpAxis": (1, 1), "FrontAxis": (2, 1), "CoordAxis": (0, 1)}
    )
    settings = [
        _property(name, "int", [value])
        for axis, (number, sign) in axes.items()
        for name, value in ((axis, number), (f"{axis}Sign", sign))
    ]
    settings.append(_property("UnitScaleFactor", "double", [centimetres]))
    return [
        ("FBXHeaderExtension", [], [("FBXVersion", [version], [])]),
        ("GlobalSettings", [], [("Properties70", [], settings)]),
        ("Objects", [], objects),
        ("Connections", [], links),
    ]


def _property(name: str, kind: str, values: Any) -> _Node:
    numbers = [int(each) if kind == "int" else float(each) for each in values]
    return "P", [name, kind, "", "A", *numbers], []


def _fbx_geometry(number: int, shape: Shape) -> _Node:
    ends = np.cumsum(shape.sizes) - 1
    indices = shape.vertex.copy()
    indices[ends] = ~indices[ends]
    corners = np.arange(len(indices), dtype=np.int32)
    parts: list[_Node] = [
        ("Vertices", [shape.positions.ravel()], []),
        ("PolygonVertexIndex", [indices.astype(np.int32)], []),
    ]
    for layer, name, values, indexed in (
        ("LayerElementNormal", "Normals", shape.normals, False),
        ("LayerElementUV", "UV", shape.uv, True),
        ("LayerElementColor", "Colors", shape.colours, True),
    ):
        if values is None:
            continue
        if name == "Colors":
            values = np.column_stack([values, np.ones(len(values))])
        reference = "IndexToDirect" if indexed else "Direct"
        inner: list[_Node] = [
            ("MappingInformationType", ["ByPolygonVertex"], []),
            ("ReferenceInformationType", [reference], []),
            (name, [values.ravel()], []),
        ]
        inner += [({"UV": "UVIndex", "Colors": "ColorIndex"}[name], [corners], [])] if indexed else []
        parts.append((layer, [0], inner))
    material: list[_Node] = [
        ("MappingInformationType", ["AllSame"], []),
        ("ReferenceInformationType", ["IndexToDirect"], []),
        ("Materials", [np.zeros(1, np.int32)], []),
    ]
    parts.append(("LayerElementMaterial", [0], material))
    return "Geometry", [number, "\0\1Geometry", "Mesh"], parts


def _fbx_binary(nodes: list[_Node], version: int) -> bytes:
    head = "<QQQB" if version >= 7500 else "<IIIB"
    empty = bytes(struct.calcsize(head))

    def written(node: _Node, start: int) -> bytes:
        name, properties, children = node
        packed = b"".join(_fbx_property(each) for each in properties)
        data = b""
        first = start + len(empty) + len(name) + len(packed)
        for child in children:
            data += written(child, first + len(data))
        data += empty if children else b""
        end = first + len(data)
        return struct.pack(head, end, len(properties), len(packed), len(name)) + name.encode() + packed + data

    data = b"Kaydara FBX Binary  \x00\x1a\x00" + struct.pack("<I", version)
    for node in nodes:
        data += written(node, len(data))
    return data + empty


def _fbx_property(value: Any) -> bytes:
    match value:
        case np.ndarray():
            kind = {"f": b"d", "i": b"i"}[value.dtype.kind]
            raw = value.astype("<f8" if kind == b"d" else "<i4").tobytes()
            if value.size < 16:
                return kind + struct.pack("<III", value.size, 0, len(raw)) + raw
            packed = zlib.compress(raw)
            return kind + struct.pack("<III", value.size, 1, len(packed)) + packed
        case bytes():
            return b"R" + struct.pack("<I", len(value)) + value
        case str():
            return b"S" + struct.pack("<I", len(value.encode())) + value.encode()
        case int():
            return b"L" + struct.pack("<q", value)
    return b"D" + struct.pack("<d", value)


def _fbx_text(nodes: list[_Node]) -> bytes:
    def written(node: _Node, blanks: str) -> str:
        name, properties, children = node
        words, block = [], ""
        for value in properties:
            if isinstance(value, np.ndarray):
                words.append(f"*{value.size}")
                block = f" {{\n{blanks}\ta: {','.join(f'{each:.9g}' for each in value.tolist())}\n{blanks}}}"
            elif isinstance(value, bytes):
                words.append(f'\n{blanks}\t"{base64.b64encode(value).decode()}"')
            elif isinstance(value, str):
                plain, _, kind = value.partition("\0\1")
                words.append(f'"{kind}::{plain}"' if kind else f'"{value}"')
            else:
                words.append(str(value))
        if children:
            block = " {\n" + "".join(written(child, blanks + "\t") for child in children) + f"{blanks}}}"
        return f"{blanks}{name}: {', '.join(words)}{block}\n"

    return ("; FBX 7.4.0 project file\n\n" + "".join(written(node, "") for node in nodes)).encode()


def three_ds(uses: list[Use], pictures: Files) -> Files:
    """Return a 3D Studio file with its pictures: triangles, their vertices divided; nodes are applied; z is up."""
    objects = b"".join(_ds_material(paint) for paint in _distinct(uses)[1])
    for number, use in enumerate(uses):
        objects += _chunk(0x4000, f"node{number}\0".encode() + _chunk(0x4100, _ds_mesh(use)))
    main = _chunk(0x4D4D, _chunk(0x0002, struct.pack("<I", 3)) + _chunk(0x3D3D, objects))
    return {"scene.3ds": main, **pictures}


def _chunk(kind: int, content: bytes) -> bytes:
    return struct.pack("<HI", kind, 6 + len(content)) + content


def _ds_material(paint: Paint) -> bytes:
    def colour(kind: int, linear: Any) -> bytes:
        return _chunk(kind, _chunk(0x0011, bytes(srgb8_from_linear(np.array(linear)).tolist())))

    def percent(kind: int, part: float) -> bytes:
        return _chunk(kind, _chunk(0x0030, struct.pack("<h", round(100 * part))))

    content = _chunk(0xA000, paint.name.encode() + b"\0") + colour(0xA020, paint.colour)
    content += colour(0xA030, [paint.specular] * 3) + percent(0xA040, math.log2(paint.exponent) / 10)
    content += percent(0xA041, 1.0) + percent(0xA050, 1 - paint.opacity)
    if paint.picture:
        content += _chunk(0xA200, percent(0, 1)[6:] + _chunk(0xA300, paint.picture.encode() + b"\0"))
    return _chunk(0xAFFF, content)


def _ds_mesh(use: Use) -> bytes:
    shape, matrix = use.shape, np.linalg.inv(_Y_FROM_Z) @ use.matrix
    corners = shape.positions[shape.vertex]
    if (turn := np.linalg.det(matrix[:3, :3])) < 0:  # stored as if it were not mirrored
        corners = corners * [-1, 1, 1]
    places = corners @ matrix[:3, :3].T + matrix[:3, 3]
    faces = _fans(shape)
    content = _chunk(0x4110, struct.pack("<H", len(places)) + places.astype("<f4").tobytes())
    if shape.uv is not None:
        content += _chunk(0x4140, struct.pack("<H", len(places)) + shape.uv.astype("<f4").tobytes())
    content += _chunk(0x4160, matrix[:3].T.astype("<f4").tobytes())
    rows = np.column_stack([faces if turn > 0 else faces[:, ::-1], np.full(len(faces), 7)]).astype("<u2")
    group = (
        use.paint.name.encode() + b"\0" + struct.pack("<H", len(faces)) + np.arange(len(faces), dtype="<u2").tobytes()
    )
    return content + _chunk(0x4120, struct.pack("<H", len(faces)) + rows.tobytes() + _chunk(0x4130, group))


def _fans(shape: Shape) -> NDArray[np.int64]:
    starts = np.cumsum(shape.sizes) - shape.sizes
    return np.array(
        [
            (start, start + k, start + k + 1)
            for start, size in zip(starts, shape.sizes, strict=True)
            for k in range(1, size - 1)
        ]
    )


def three_mf(uses: list[Use], pictures: Files, *, unit: str = "meter", parts: bool = False) -> Files:
    """Return a 3MF file with its pictures in it; z is up. With `parts`, each object is a model of its own."""
    paints = _distinct(uses)[1]
    resources = "".join(
        f'<m:texture2d id="{100 + k}" path="/3D/Textures/{name}" contenttype="image/png"/>'
        for k, name in enumerate(pictures)
    )
    bases = "".join(
        f'<base name="{paint.name}" displaycolor="#{bytes(srgb8_from_linear(np.array(paint.colour)).tolist()).hex()}'
        f'{round(paint.opacity * 255):02x}"/>'
        for paint in paints
    )
    resources += f'<basematerials id="50">{bases}</basematerials>'
    files: Files = {}
    items = ""
    for number, use in enumerate(uses):
        paint, shape = use.paint, use.shape
        group = ""
        at = f'pid="50" pindex="{paints.index(paint)}"'
        if paint.picture and shape.uv is not None:
            picture = 100 + list(pictures).index(paint.picture)
            rows = "".join(f'<m:tex2coord u="{u:.9g}" v="{v:.9g}"/>' for u, v in shape.uv.tolist())
            group = f'<m:texture2dgroup id="{200 + number}" texid="{picture}">{rows}</m:texture2dgroup>'
            at = f'pid="{200 + number}" pindex="0"'
        vertices = "".join(f'<vertex x="{x:.9g}" y="{y:.9g}" z="{z:.9g}"/>' for x, y, z in shape.positions.tolist())
        vertex = shape.vertex
        triangles = "".join(
            f'<triangle v1="{vertex[a]}" v2="{vertex[b]}" v3="{vertex[c]}" p1="{a}" p2="{b}" p3="{c}"/>'
            if group
            else f'<triangle v1="{vertex[a]}" v2="{vertex[b]}" v3="{vertex[c]}"/>'
            for a, b, c in _fans(shape).tolist()
        )
        drawn = (
            f'{group}<object id="{number + 1}" {at}><mesh><vertices>{vertices}</vertices>'
            f"<triangles>{triangles}</triangles></mesh></object>"
        )
        place = f'transform="{_words((np.linalg.inv(_Y_FROM_Z) @ use.matrix)[:3].T)}"'
        if parts:
            files[f"3D/Objects/{number}.model"] = _mf_model(unit, resources + drawn, "")
            inner = f'<component p:path="/3D/Objects/{number}.model" objectid="{number + 1}" {place}/>'
            resources += f'<object id="{number + 1}"><components>{inner}</components></object>'
            items += f'<item objectid="{number + 1}"/>'
        else:
            resources += drawn
            items += f'<item objectid="{number + 1}" {place}/>'
    relation = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
    files["_rels/.rels"] = (
        '<?xml version="1.0"?><Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
        f'<Relationship Target="/3D/3dmodel.model" Id="r" Type="{relation}"/></Relationships>'
    ).encode()
    files["3D/3dmodel.model"] = _mf_model(unit, resources, items)
    files |= {f"3D/Textures/{name}": data for name, data in pictures.items()}
    return {"scene.3mf": zipped(files)}


def _mf_model(unit: str, resources: str, items: str) -> bytes:
    spaces = (
        'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" '
        'xmlns:m="http://schemas.microsoft.com/3dmanufacturing/material/2015/02" '
        'xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06"'
    )
    text = (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<model unit="{unit}" {spaces}>\n<resources>{resources}</resources>\n'
        f"<build>{items}</build></model>"
    )
    return text.replace("><", ">\n<").encode()


def zipped(files: Files) -> bytes:
    """Return a ZIP archive of files, the same for the same files."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(zipfile.ZipInfo(name, (2020, 1, 1, 0, 0, 0)), data, zipfile.ZIP_DEFLATED)
    return packed.getvalue()


def skinned_dae() -> bytes:
    """Return a COLLADA file of a square, half of which a joint moves upward by two from where it is bound."""
    return b"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="12">0 0 0 1 0 0 1 1 0 0 1 0</float_array>
<technique_common><accessor source="#pa" count="4" stride="3"/></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<polygons count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2 3</p></polygons>
</mesh></geometry></library_geometries>
<library_controllers><controller id="c"><skin source="#g">
<bind_shape_matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</bind_shape_matrix>
<source id="j"><Name_array id="ja" count="2">still up</Name_array></source>
<source id="i"><float_array id="ia" count="32">1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1
1 0 0 0 0 1 0 -1 0 0 1 0 0 0 0 1</float_array></source>
<source id="w"><float_array id="wa" count="2">1 0.5</float_array></source>
<joints><input semantic="JOINT" source="#j"/><input semantic="INV_BIND_MATRIX" source="#i"/></joints>
<vertex_weights count="4"><input semantic="JOINT" source="#j" offset="0"/>
<input semantic="WEIGHT" source="#w" offset="1"/>
<vcount>1 1 1 2</vcount><v>0 0 0 0 1 0 0 1 1 1</v></vertex_weights></skin></controller></library_controllers>
<library_visual_scenes><visual_scene id="s">
<node id="root" sid="still" type="JOINT"><node sid="up" type="JOINT"><translate>0 3 0</translate></node></node>
<node><translate>9 9 9</translate><instance_controller url="#c"><skeleton>#root</skeleton></instance_controller></node>
</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>
"""


def skinned_fbx() -> bytes:
    """Return an FBX file of the same square, in metres, with the same joints."""
    identity = "1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1"
    return f"""; FBX 7.4.0 project file
FBXHeaderExtension: {{
	FBXVersion: 7400
}}
GlobalSettings: {{
	Properties70: {{
		P: "UnitScaleFactor", "double", "Number", "",100
	}}
}}
Objects: {{
	Geometry: 1, "Geometry::", "Mesh" {{
		Vertices: *12 {{
			a: 0,0,0,1,0,0,1,1,0,0,1,0
		}}
		PolygonVertexIndex: *4 {{
			a: 0,1,2,-4
		}}
	}}
	Model: 2, "Model::square", "Mesh" {{
		Properties70: {{
			P: "Lcl Translation", "Lcl Translation", "", "A",9,9,9
		}}
	}}
	Model: 3, "Model::still", "LimbNode" {{
	}}
	Model: 4, "Model::up", "LimbNode" {{
		Properties70: {{
			P: "Lcl Translation", "Lcl Translation", "", "A",0,3,0
		}}
	}}
	Deformer: 5, "Deformer::", "Skin" {{
	}}
	Deformer: 6, "SubDeformer::", "Cluster" {{
		Indexes: *3 {{
			a: 0,1,3
		}}
		Weights: *3 {{
			a: 1,1,0.5
		}}
		Transform: *16 {{
			a: {identity}
		}}
	}}
	Deformer: 7, "SubDeformer::", "Cluster" {{
		Indexes: *2 {{
			a: 2,3
		}}
		Weights: *2 {{
			a: 1,0.5
		}}
		Transform: *16 {{
			a: 1,0,0,0,0,1,0,0,0,0,1,0,0,-1,0,1
		}}
	}}
}}
Connections: {{
	C: "OO",2,0
	C: "OO",3,0
	C: "OO",4,3
	C: "OO",1,2
	C: "OO",5,1
	C: "OO",6,5
	C: "OO",7,5
	C: "OO",3,6
	C: "OO",4,7
}}
""".encode()
