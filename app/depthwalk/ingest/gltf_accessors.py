"""Read and add the numbers of glTF files: accessors, with strides, sparse values and normalised integers."""

import base64
import struct
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

DTYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}  # by component type
_COMPONENT_TYPES = {np.dtype(name): number for number, name in DTYPES.items()}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_TYPES = {width: name for name, width in WIDTHS.items()}

Numbers = NDArray[Any]  # (count, width) of any type of number


def is_converted(accessor: dict[str, Any], *, keeps_bytes: bool = False) -> bool:
    """Return whether `trimesh` would misread an accessor: it is sparse, or an integer that stands for a fraction.

    With `keeps_bytes` normalised bytes do not count, which trimesh reads as colours.
    """
    fraction = accessor.get("normalized", False) and not (keeps_bytes and accessor["componentType"] == 5121)
    return "sparse" in accessor or bool(fraction)


class Accessors:
    """Read the accessors of a glTF file, and add further ones to its header.

    Everything in the header is untrusted: wrong values raise ValueError, TypeError or LookupError, as damaged data do
    in trimesh.

    Attributes
    ----------
    added
        The contents of the buffers that are added or replaced, by their URIs, which no file has as its name.
    """

    def __init__(self, header: dict[str, Any], data: bytes, read: Callable[[str], bytes]) -> None:
        """Prepare to read from a file.

        Parameters
        ----------
        header
            The JSON header, to which buffers, views and accessors are added.
        data
            The contents of the file, of which only a GLB's binary chunk is used.
        read
            Returns the contents of the file that a URI names.
        """
        self._header = header
        self._data = data
        self._read = read
        self._buffers: dict[int, memoryview] = {}
        self.added: dict[str, bytes] = {}

    def read(self, number: int, count: int | None = None) -> Numbers:
        """Return the values (N, width) of an accessor; normalised integers as float32 from −1 or 0 to 1.

        Parameters
        ----------
        number
            Its number in the header.
        count
            How many values it must have; None: any number, which must have been checked before.
        """
        values = self.stored(number, count)
        if self._header["accessors"][number].get("normalized", False) and values.dtype.kind != "f":
            return np.maximum(values / np.float32(np.iinfo(values.dtype).max), np.float32(-1.0)).astype(np.float32)
        return values

    def stored(self, number: int, count: int | None = None) -> Numbers:
        """Return the values (N, width) of an accessor as they are stored, sparse ones put in place; see `read`."""
        accessor = self._header["accessors"][whole(number)]
        rows, width = whole(accessor["count"]), WIDTHS[accessor["type"]]
        if count is not None and rows != count:
            raise ValueError(f"accessors[{number}] has {rows} values instead of {count}")
        dtype = np.dtype(DTYPES[accessor["componentType"]])
        has_data = "bufferView" in accessor
        values = self._rows(accessor, rows, dtype, width) if has_data else np.zeros((rows, width), dtype)
        if "sparse" in accessor:
            values = values.copy()
            replaced = accessor["sparse"]
            some = min(whole(replaced["count"]), rows)
            index_type = np.dtype(DTYPES[replaced["indices"]["componentType"]])
            indices = self._rows(replaced["indices"], some, index_type, 1)[:, 0].astype(np.int64)
            values[indices] = self._rows(replaced["values"], some, dtype, width)
        return values

    def view(self, number: int) -> bytes:
        """Return the bytes of a bufferView, such as a picture."""
        return self.part(self._header["bufferViews"][whole(number)])

    def part(self, place: dict[str, Any]) -> bytes:
        """Return the bytes of a buffer that an object names as bufferViews do, as far as there are any."""
        start, length = whole(place.get("byteOffset", 0)), whole(place["byteLength"])
        return bytes(self._buffer(whole(place["buffer"]))[start : start + length])

    def picture(self, image: dict[str, Any]) -> bytes:
        """Return the bytes of an image of the header; what is in another file, as its reader does or fails to."""
        if "bufferView" in image:
            return self.view(image["bufferView"])
        uri: str = image["uri"]
        return _embedded(uri) if uri.startswith("data:") else self._read(uri)

    def add(self, values: Numbers) -> int:
        """Add an accessor for `values` (N, width), float32 or uint32, to the header and return its number."""
        self._header["accessors"].append({})
        number = len(self._header["accessors"]) - 1
        self.fill(number, values)
        return number

    def fill(self, number: int, values: Numbers) -> None:
        """Give an accessor `values` (N, width) of one of glTF's types in place of its own; it stays normalised or not.

        Bounds that it may have are left as they are.
        """
        view = self.add_view(np.ascontiguousarray(values).tobytes())
        accessor = self._header["accessors"][number]
        for key in ("byteOffset", "sparse"):
            accessor.pop(key, None)
        accessor |= {
            "bufferView": view,
            "componentType": _COMPONENT_TYPES[values.dtype],
            "count": len(values),
            "type": _TYPES[values.shape[1]],
        }

    def add_view(self, data: bytes) -> int:
        """Add a bufferView with these contents, and return its number."""
        views = self._header.setdefault("bufferViews", [])
        views.append({})
        self.replace_view(len(views) - 1, data)
        return len(views) - 1

    def replace_view(self, number: int, data: bytes) -> None:
        """Give a bufferView these contents, in a further buffer; it keeps its stride and its target."""
        buffers, view = self._header.setdefault("buffers", []), self._header["bufferViews"][number]
        kept = {key: view[key] for key in ("byteStride", "target") if key in view}
        self._header["bufferViews"][number] = kept | {"buffer": len(buffers), "byteOffset": 0, "byteLength": len(data)}
        buffers.append({})
        self.replace_buffer(buffers[-1], data)

    def replace_buffer(self, buffer: dict[str, Any], data: bytes) -> None:
        """Give a buffer of the header these contents, and nothing else."""
        uri = f"\0added-{len(self.added)}"
        self.added[uri] = data
        buffer.clear()
        buffer |= {"uri": uri, "byteLength": len(data)}

    def _rows(self, place: dict[str, Any], rows: int, dtype: np.dtype[Any], width: int) -> Numbers:
        """Return the values (rows, width) that begin at the `byteOffset` of `place` in its `bufferView`."""
        view = self._header["bufferViews"][whole(place["bufferView"])]
        size = dtype.itemsize * width
        offset, length = whole(place.get("byteOffset", 0)), whole(view["byteLength"])
        stride = whole(view.get("byteStride", size))
        needed = (rows - 1) * stride + size
        if rows < 1 or stride < size or offset + needed > length:
            raise ValueError("an accessor reaches beyond its bufferView")
        start = whole(view.get("byteOffset", 0)) + offset
        raw = np.frombuffer(self._buffer(whole(view["buffer"])), np.uint8, needed, start)
        strided = np.lib.stride_tricks.as_strided(raw, (rows, size), (stride, 1))
        return np.ascontiguousarray(strided).view(dtype)

    def _buffer(self, number: int) -> memoryview:
        """Return the contents of a buffer."""
        if number not in self._buffers:
            uri = self._header["buffers"][number].get("uri")
            if uri is None:
                start = 28 + struct.unpack_from("<I", self._data, 12)[0]
                content: bytes | memoryview = memoryview(self._data)[start:]  # the chunk after the header's
            elif uri in self.added:
                content = self.added[uri]
            elif uri.startswith("data:"):
                content = _embedded(uri)
            else:
                content = self._read(uri)
            self._buffers[number] = memoryview(content)
        return self._buffers[number]


def _embedded(uri: str) -> bytes:
    """Return what a data URI contains."""
    return base64.b64decode(uri.partition("base64,")[2])


def whole(value: Any) -> int:
    """Return `value` if it is a whole number, 0 or more; raise ValueError otherwise."""
    if not isinstance(value, int) or value < 0:
        raise ValueError(f"{str(value)[:40]} is no number of items or bytes")
    return value
