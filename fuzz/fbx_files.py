"""Write small scenes as FBX files, binary and of text."""

import base64
import struct
import zlib
from typing import Any

import numpy as np

from fuzz.case import Files
from fuzz.small_scenes import Shape, Use, distinct

_Node = tuple[str, list[Any], "list[_Node]"]


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
    shapes, paints = distinct(uses)
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
