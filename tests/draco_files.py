"""Meshes compressed by Draco, in GLB files in the making; they need the extra `gltf`."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glb_files import HALVES, SQUARE, Glb

DRACO = "KHR_draco_mesh_compression"
_COMPONENT_TYPES = {"f4": 5126, "u1": 5121, "u2": 5123, "u4": 5125}
_TYPES = {2: "VEC2", 3: "VEC3", 4: "VEC4"}

Attributes = Mapping[str, NDArray[Any]]


def ids(attributes: Attributes) -> dict[str, int]:
    """The unique ID of each attribute in `stream`: from 0 on, and the positions' after all others."""
    others = [name for name in attributes if name != "POSITION"]
    return {name: number for number, name in enumerate([*others, "POSITION"])}


def stream(attributes: Attributes, corners: ArrayLike = HALVES, **options: Any) -> bytes:
    """A Draco stream; with its values and their order as they are, unless `options` of the encoder say otherwise."""
    import DracoPy

    numbers = ids(attributes)
    others = {numbers[name]: values for name, values in attributes.items() if name != "POSITION"}
    points = np.asarray(attributes.get("POSITION", SQUARE), np.float32)
    faces = np.asarray(corners, np.uint32).reshape(-1, 3)
    chosen = {"preserve_order": True, "quantization_bits": 0} | options
    return bytes(DracoPy.encode(points, faces, generic_attributes=others or None, **chosen))


def compressed(
    glb: Glb, attributes: Attributes, corners: ArrayLike = HALVES, data: bytes | None = None, **more: Any
) -> dict[str, Any]:
    """The primitive of a new mesh, compressed; its accessors hold nothing but sizes. `data`: another stream."""
    attributes = {"POSITION": SQUARE.astype(np.float32)} | dict(attributes)
    view = glb.view(stream(attributes, corners) if data is None else data)
    numbers = {name: _announced(glb, name, values) for name, values in attributes.items()}
    glb.header["accessors"].append({"componentType": 5123, "count": np.size(corners), "type": "SCALAR"})
    primitive: dict[str, Any] = {
        "attributes": numbers,
        "indices": len(glb.header["accessors"]) - 1,
        "extensions": {DRACO: {"bufferView": view, "attributes": ids(attributes)}},
    }
    glb.header["meshes"].append({"primitives": [primitive | more]})
    glb.header["extensionsUsed"] = glb.header["extensionsRequired"] = [DRACO]
    found: dict[str, Any] = glb.header["meshes"][-1]["primitives"][0]
    return found


def _announced(glb: Glb, name: str, values: NDArray[Any]) -> int:
    """The number of a new accessor without data; integers are fractions, unless they number joints."""
    kind = values.dtype.str[1:]
    accessor = {"componentType": _COMPONENT_TYPES[kind], "count": len(values), "type": _TYPES[values.shape[1]]}
    glb.header["accessors"].append(accessor | ({"normalized": True} if kind != "f4" and "JOINTS" not in name else {}))
    return len(glb.header["accessors"]) - 1
