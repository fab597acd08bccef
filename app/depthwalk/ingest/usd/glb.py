"""Collect the parts of a GLB file, and write it."""

import struct
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.ingest.gltf import glb_parts
from depthwalk.ingest.usd.problems import UsdError

_COMPONENT_TYPES = {"f4": 5126, "u4": 5125}
_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
_MOST = (1 << 32) - 1  # bytes of a GLB file
_TOO_LARGE = "it shows more than 4 GiB of meshes and pictures"

Header = dict[str, Any]


class GlbBuilder:
    """Collect the header and the data of a GLB file.

    Attributes
    ----------
    header
        The JSON header, to which lists are added as they get items.
    """

    def __init__(self) -> None:
        self.header: Header = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}]}
        self._chunks: list[bytes] = []
        self._length = 0

    def add(self, key: str, item: Header) -> int:
        """Add an item to a list of the header, and return its number."""
        self.header.setdefault(key, []).append(item)
        return len(self.header[key]) - 1

    def accessor(self, values: NDArray[Any]) -> int:
        """Add an accessor of values (N,) or (N, width), stored as float32 or, of whole numbers, as uint32."""
        kind = "f4" if values.dtype.kind == "f" else "u4"
        with np.errstate(over="ignore", invalid="ignore"):  # what is too large is reported where meshes are read
            data = np.ascontiguousarray(values, f"<{kind}").tobytes()
        view = self.view(data)
        width = 1 if values.ndim == 1 else values.shape[1]
        entry = {"bufferView": view, "componentType": _COMPONENT_TYPES[kind], "count": len(values)}
        return self.add("accessors", entry | {"type": _TYPES[width]})

    def view(self, data: bytes) -> int:
        """Add a bufferView of these bytes, and return its number. Raises UsdError if the file gets too large."""
        number = self.add("bufferViews", {"buffer": 0, "byteOffset": self._length, "byteLength": len(data)})
        padding = b"\0" * (-len(data) % 4)
        self._chunks += [data, padding]
        self._length += len(data) + len(padding)
        if self._length > _MOST:
            raise UsdError(_TOO_LARGE)
        return number

    def parts(self) -> Iterator[bytes]:
        """Yield the bytes of the file. Raises UsdError if it gets too large."""
        try:
            header = self.header | {"buffers": [{"byteLength": self._length}]}
            yield from glb_parts(header, self._chunks, self._length)
        except struct.error:
            raise UsdError(_TOO_LARGE) from None
