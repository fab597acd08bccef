"""Make the glTF files that fuzzing begins with."""

import base64
import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fuzz.case import Files
from fuzz.container_changes import glb
from fuzz.seeds import CORNERS, FACES, HOSTILE, hostile, picture

# The tetrahedron of `_gltf`, compressed by Draco: colours, texture coordinates, normals, positions.
_DRACO = base64.b64decode(
    "RFJBQ08CAgEBAAAABAQDAwAAAS8BARD/AmZA/wJmQP8CZkAEAAAA/wAAAQAAAgAAAQICBAEAAQEACQMAAwIBAwkCAQECAQEJAwACAwEBAQEBAQFAAQD/"
    "AAAA/wAAAAEBAQADAwEQATADAFCCJJEEAAAAAP8AAAAAAAAAAAAAAAAAAAAAAIA/CAUBAQAHAwEwDwEQAwAoggj0AAIAAACAAgBxAAAAAD8AAAAAAAAA"
    "AAAAAAAAgD8GBgMBAAcDARABEAEQBwEQAwBMSFTB4z8AAAAfAAAAAwNAiYAG"
)

# Its positions, normals and faces, compressed by meshoptimizer: vertex codec 0 and 1, index codec.
_MESHOPT = [
    base64.b64decode(text)
    for text in (
        "oAAAATwAAAD//wE8AAAAfn0AAAEPAAAA//8BDwAAAH59AAABAwAAAP8BAwAAAH4AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA==",
        "ofr6+gB/gAAABAMAAAB/gAAABAMAAAB/AAAABAAAAAAAAAAAAM3MzD3NzMw9zczMPQAAAA==",
        "4f4OAhHwBAB2h1ZneKmGZYlomAFpAAA=",
    )
]

# A picture of 8 × 8 pixels (UASTC).
_KTX2 = base64.b64decode(
    "q0tUWCAyMLsNChoKAAAAAAEAAAAIAAAACAAAAAAAAAAAAAAAAQAAAAEAAAAAAAAAaAAAACwAAACUAAAALAAAAAAAAAAAAAAAAAAAAAAAAADAAAAAAAAA"
    "AEAAAAAAAAAAQAAAAAAAAAAsAAAAAAAAAAIAKACmAQIAAwMAABAAAAAAAAAAAAB/AwAAAAAAAAAA/////x8AAABLVFh3cml0ZXIAQmFzaXMgVW5pdmVy"
    "c2FsIDIuMTAAAAQAAAB/fwAA9x8A4B96AAAAAAAAAAAAABfgH+AfAg8AAAAAAAAAAAAXAOD/HwLgAQAAAAAAAAAA9///HxB87wEAAAAAAAAAAA=="
)


def _gltf(image: str, buffer: str | None) -> tuple[dict[str, Any], bytes]:
    """Return the header and the buffer of a textured tetrahedron with normals, colours and a hierarchy of nodes."""
    columns = [CORNERS, CORNERS + 0.1, CORNERS[:, :2].copy(), np.ones((4, 4), np.float32), FACES]
    views, data = [], b""
    for values in columns:
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": values.nbytes})
        data += values.tobytes()
    kinds = [("VEC3", 5126, 4), ("VEC3", 5126, 4), ("VEC2", 5126, 4), ("VEC4", 5126, 4), ("SCALAR", 5123, 12)]
    accessors = [
        {"bufferView": k, "componentType": kind, "count": count, "type": name, "byteOffset": 0}
        for k, (name, kind, count) in enumerate(kinds)
    ]
    accessors[0] |= {"min": [0, 0, 0], "max": [1, 1, 1]}
    rough = {"baseColorTexture": {"index": 0}, "baseColorFactor": [1, 0.5, 0.5, 1], "roughnessFactor": 0.5}
    attributes = {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "COLOR_0": 3}
    header: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"children": [1, 2], "translation": [0, 1, 0]}, {"mesh": 0, "scale": [1, 2, -1]},
                  {"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 2, 0, 0, 1]}],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 4, "material": 0, "mode": 4}]}],
        "materials": [{"name": "m", "pbrMetallicRoughness": rough}],
        "textures": [{"source": 0}],
        "images": [{"uri": image}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(data)} | ({} if buffer is None else {"uri": buffer})],
        "extensionsUsed": ["KHR_materials_unlit"],
        "extensionsRequired": ["KHR_materials_unlit"],
    }  # fmt: skip
    return header, data


def _posed(header: dict[str, Any]) -> dict[str, Any]:
    """Return a header of `_gltf` with a skin, a shape key, sparse values and a transformed texture."""
    posed: dict[str, Any] = json.loads(json.dumps(header))
    accessors = posed["accessors"]
    sparse = {"count": 2, "indices": {"bufferView": 4, "componentType": 5123}, "values": {"bufferView": 2}}
    accessors[2]["sparse"] = sparse
    accessors.append({"bufferView": 4, "componentType": 5121, "count": 4, "type": "VEC4"})  # joints 0 to 3
    primitive = posed["meshes"][0]["primitives"][0]
    primitive["attributes"] |= {"JOINTS_0": 5, "WEIGHTS_0": 3}
    primitive["targets"] = [{"POSITION": 1}]
    posed["meshes"][0]["weights"] = [0.5]
    posed["nodes"][1]["skin"] = 0
    posed["skins"] = [{"joints": [0, 1, 2, 0]}]
    transform = {"offset": [0.1, 0], "rotation": 0.5, "scale": [2, 1], "texCoord": 0}
    texture = posed["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
    texture["extensions"] = {"KHR_texture_transform": transform}
    return posed


def _stage(header: dict[str, Any]) -> dict[str, Any]:
    """Return a header of `_gltf` with instances, a camera and a light, and copies of a mesh and of a group."""
    stage: dict[str, Any] = json.loads(json.dumps(header))
    stage["meshes"].append(stage["meshes"][0])
    stage["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}]
    lamp = {"type": "spot", "color": [1, 0.5, 0], "intensity": 50, "range": 9, "spot": {"outerConeAngle": 0.5}}
    stage["extensions"] = {"KHR_lights_punctual": {"lights": [lamp]}}
    instances = {"attributes": {"TRANSLATION": 0, "ROTATION": 3, "SCALE": 1}}
    stage["nodes"] += [
        {"children": [4, 5], "scale": [2, 2, 2]},
        {"mesh": 0, "translation": [0, 3, 0]},
        {"mesh": 1, "rotation": [0, 0.6, 0, 0.8]},
        {"mesh": 1, "extensions": {"EXT_mesh_gpu_instancing": instances}},
        {"camera": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}},
    ]
    stage["scenes"][0]["nodes"] += [3, 6, 7]
    return stage


def _moving(header: dict[str, Any], data: bytes) -> tuple[dict[str, Any], bytes]:
    """Return a header of `_gltf`, and its buffer, with nodes that move in each way, one of them below another."""
    moving: dict[str, Any] = json.loads(json.dumps(_stage(header)))
    half = np.sqrt(0.5)
    times = np.array([0.0, 0.5, 2.0], np.float32)
    turns = np.array([(0, 0, 0, 1), (0, half, 0, half), (0, 1, 0, 0)], np.float32)
    splined = np.array([((0, 0, 0), (0, row, 1), (1, 0, 0)) for row in range(3)], np.float32).reshape(9, 3)
    whole = np.rint(turns * 32767).astype(np.int16)
    sizes = np.array([(1, 1, 1), (2, 2, 2), (0, 0, 0)], np.float32)
    first = len(moving["accessors"])
    kinds = ["SCALAR", "VEC4", "VEC3", "VEC4", "VEC3"]
    listed: list[NDArray[Any]] = [times, turns, splined, whole, sizes]
    for kind, values in zip(kinds, listed, strict=True):
        view = {"buffer": 0, "byteOffset": len(data), "byteLength": values.nbytes}
        whole_numbers = {"componentType": 5122, "normalized": True} if values.dtype == np.int16 else {}
        accessor = {"bufferView": len(moving["bufferViews"]), "componentType": 5126, "count": len(values), "type": kind}
        moving["bufferViews"].append(view)
        moving["accessors"].append(accessor | whole_numbers)
        data += values.tobytes()
    samplers = [
        {"input": first, "output": first + 1},
        {"input": first, "output": first + 2, "interpolation": "CUBICSPLINE"},
        {"input": first, "output": first + 3, "interpolation": "STEP"},
        {"input": first, "output": first + 4, "interpolation": "LINEAR"},
    ]
    targets = [(0, "rotation"), (1, "translation"), (3, "rotation"), (5, "scale"), (6, "translation")]
    channels = [
        {"sampler": sampler, "target": {"node": node, "path": path}}
        for sampler, (node, path) in zip((0, 1, 2, 3, 1), targets, strict=True)
    ]
    moving["animations"] = [{"name": "turn", "samplers": samplers, "channels": channels}]
    moving["buffers"][0]["byteLength"] = len(data)
    return moving, data


def _compressed(header: dict[str, Any], length: int) -> dict[str, Any]:
    """Return a header of `_gltf` whose accessors have their data in a Draco stream, `length` bytes into the buffer."""
    compressed: dict[str, Any] = json.loads(json.dumps(header))
    for accessor in compressed["accessors"]:
        del accessor["bufferView"], accessor["byteOffset"]
    compressed["accessors"][3] |= {"componentType": 5121, "normalized": True}
    compressed["bufferViews"] = [{"buffer": 0, "byteOffset": length, "byteLength": len(_DRACO)}]
    compressed["buffers"][0]["byteLength"] = length + len(_DRACO)
    terms = {"bufferView": 0, "attributes": {"COLOR_0": 0, "TEXCOORD_0": 1, "NORMAL": 2, "POSITION": 3}}
    compressed["meshes"][0]["primitives"][0]["extensions"] = {"KHR_draco_mesh_compression": terms}
    compressed["extensionsRequired"].append("KHR_draco_mesh_compression")
    return compressed


def _squeezed(header: dict[str, Any], data: bytes) -> tuple[dict[str, Any], bytes]:
    """Return a header and a buffer of `_gltf` of which three views are compressed by meshoptimizer."""
    squeezed: dict[str, Any] = json.loads(json.dumps(header))
    name, views = "KHR_meshopt_compression", squeezed["bufferViews"]
    for number, stride, mode, part in zip(
        (0, 1, 4), (12, 12, 2), ("ATTRIBUTES",) * 2 + ("TRIANGLES",), _MESHOPT, strict=True
    ):
        count = views[number]["byteLength"] // stride
        terms = {"byteOffset": len(data), "byteLength": len(part), "byteStride": stride, "count": count, "mode": mode}
        views[number] |= {"buffer": 1, "extensions": {name: {"buffer": 0, "filter": "NONE"} | terms}}
        data += part
    squeezed["buffers"][0]["byteLength"] = len(data)
    squeezed["buffers"].append({"byteLength": 400, "extensions": {name: {"fallback": True}}})
    squeezed["extensionsRequired"].append(name)
    return squeezed, data


def gltfs() -> list[Files]:
    header, data = _gltf("skin.png", "mesh.bin")
    beside = {"mesh.bin": data, "skin.png": picture("PNG")}
    inner, _ = _gltf("skin.png", None)
    strip = json.loads(json.dumps(inner))
    strip["meshes"][0]["primitives"][0] |= {"mode": 5, "attributes": {"POSITION": 0, "COLOR_0": 3}}
    strip["meshes"][0]["primitives"][0].pop("material")
    glass = json.loads(json.dumps(inner))
    glass["materials"][0] |= {
        "alphaMode": "BLEND",
        "emissiveFactor": [0.0, 0.5, 1.0],
        "extensions": {
            "KHR_materials_emissive_strength": {"emissiveStrength": 4.0},
            "KHR_materials_transmission": {"transmissionFactor": 0.5},
        },
    }
    relief = json.loads(json.dumps(inner))
    relief["materials"][0]["normalTexture"] = {"index": 0, "scale": 0.5, "texCoord": 0}
    moving, more = _moving(inner, data)
    squeezed, parts = _squeezed(inner, data)
    squeezed["textures"], squeezed["images"] = (
        [{"extensions": {"KHR_texture_basisu": {"source": 0}}}],
        [{"uri": "a.ktx2"}],
    )
    made = [
        {"mesh.gltf": json.dumps(header).encode()} | beside,
        {"mesh.glb": glb(json.dumps(inner).encode(), data), "skin.png": picture("PNG")},
        {"tall.glb": glb(json.dumps(strip).encode(), data)},
        {"glass.glb": glb(json.dumps(glass).encode(), data), "skin.png": picture("PNG")},
        {"relief.glb": glb(json.dumps(relief).encode(), data), "skin.png": picture("PNG")},
        {"posed.glb": glb(json.dumps(_posed(inner)).encode(), data), "skin.png": picture("PNG")},
        {"moving.glb": glb(json.dumps(moving).encode(), more), "skin.png": picture("PNG")},
        {"packed.glb": glb(json.dumps(_compressed(inner, 0)).encode(), _DRACO), "skin.png": picture("PNG")},
        {"squeezed.glb": glb(json.dumps(squeezed).encode(), parts), "a.ktx2": _KTX2},
        {"stage.glb": glb(json.dumps(_stage(inner)).encode(), data), "skin.png": picture("PNG")},
    ]
    return made + hostile("*.gl*", HOSTILE / "meshes")
