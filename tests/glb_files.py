"""GLB files of a few triangles, written by hand, with what only few exporters write."""

import io
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image

_COMPONENT_TYPES = {"f4": 5126, "u1": 5121, "u2": 5123, "u4": 5125, "i1": 5120, "i2": 5122}
_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
SQUARE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)  # counter-clockwise, in the plane z = 0
HALVES = (0, 1, 2, 0, 2, 3)


def png(texels: NDArray[np.uint8]) -> bytes:
    """The file of a picture (H, W, 3)."""
    file = io.BytesIO()
    Image.fromarray(texels).save(file, "PNG")
    return file.getvalue()


class Glb:
    """A file in the making; `header` may be changed at will before `write`."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.header: dict[str, Any] = {"asset": {"version": "2.0"}, "bufferViews": [], "accessors": [], "meshes": []}

    def view(self, data: bytes) -> int:
        """The number of a new bufferView with these contents."""
        self.data += b"\0" * (-len(self.data) % 4)
        self.header["bufferViews"].append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)})
        self.data += data
        return len(self.header["bufferViews"]) - 1

    def texture(self, texels: NDArray[np.uint8]) -> dict[str, int]:
        """The entry, in a material, of a new texture that shows a picture (H, W, 3)."""
        image = {"bufferView": self.view(png(texels)), "mimeType": "image/png"}
        self.header.setdefault("images", []).append(image)
        self.header.setdefault("textures", []).append({"source": len(self.header["images"]) - 1})
        return {"index": len(self.header["textures"]) - 1}

    def accessor(self, values: ArrayLike, kind: str = "f4", **more: Any) -> int:
        """The number of a new accessor with these values, of the component type `kind`."""
        rows: NDArray[Any] = np.ascontiguousarray(values, "<" + kind)
        rows = rows.reshape(len(rows), -1)
        found = {"componentType": _COMPONENT_TYPES[kind], "count": len(rows), "type": _TYPES[rows.shape[1]]}
        self.header["accessors"].append({"bufferView": self.view(rows.tobytes())} | found | more)
        return len(self.header["accessors"]) - 1

    def mesh(self, attributes: dict[str, int], indices: ArrayLike | None = HALVES, **more: Any) -> int:
        """The number of a new mesh of one primitive; a square, unless `attributes` has positions."""
        primitive = {"attributes": {"POSITION": attributes.get("POSITION", -1)} | attributes} | more
        if primitive["attributes"]["POSITION"] < 0:
            primitive["attributes"]["POSITION"] = self.accessor(SQUARE)
        if indices is not None:
            primitive["indices"] = self.accessor(indices, "u2")
        self.header["meshes"].append({"primitives": [primitive]})
        return len(self.header["meshes"]) - 1

    def write(self, path: Path, *nodes: dict[str, Any], roots: list[int] | None = None) -> Path:
        """Write the file with a scene of these nodes; without any, the header's own or the first mesh is shown."""
        if nodes or "nodes" not in self.header:
            self.header["nodes"] = list(nodes) or [{"mesh": 0}]
            self.header["scenes"] = [{"nodes": roots or list(range(len(self.header["nodes"])))}]
        self.header["buffers"] = [{"byteLength": len(self.data)}, *self.header.get("buffers", [])[1:]]
        text = json.dumps(self.header).encode()
        text += b" " * (-len(text) % 4)
        body = bytes(self.data) + b"\0" * (-len(self.data) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(body), b"BIN\0") + body
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
        return path
