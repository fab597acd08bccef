"""Instanced drawing: per-instance records as vertex attributes, and one vertex array per asset."""

from collections.abc import Hashable
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.gpu.device import Scope

RECORDS_PER_ROW = 1024  # of a `RecordTexture`
_TOO_LARGE = 16  # times the room needed: drivers allocate all of a buffer anew when its contents are replaced


class InstanceStream:
    """A buffer that holds one frame's records and grows and shrinks as needed; attributes are named `in_` + field."""

    def __init__(self, scope: Scope, dtype: np.dtype[np.void]) -> None:
        self._scope = scope
        self._stride = dtype.itemsize
        self._fields = []
        fields: Any = dtype.fields
        for name in dtype.names or ():
            field, offset = fields[name][:2]
            components = int(np.prod(field.shape)) if field.shape else 1
            self._fields.append((f"in_{name}", f"{components}f", int(offset)))
        self._buffer = scope.buffer(reserve=256 * self._stride, dynamic=True)

    def upload(self, records: NDArray[np.void]) -> None:
        """Replaces what the buffer holds by `records` (n,)."""
        room = 2 * max(records.nbytes, 128 * self._stride)
        if records.nbytes > self._buffer.size or _TOO_LARGE * room < self._buffer.size:
            self._scope.free(self._buffer)
            self._buffer = self._scope.buffer(reserve=room, dynamic=True)
        if len(records):
            self._buffer.orphan()
            self._buffer.write(records.tobytes())

    def bind(self, array: moderngl.VertexArray, first: int) -> None:
        """Instance 0 of the next draw is record `first` (GL 3.3 has no base instance)."""
        for name, layout, offset in self._fields:
            attribute: Any = array.program.get(name, None)
            if attribute is not None:
                array.bind(
                    attribute.location, "f", self._buffer, layout, offset + first * self._stride, self._stride, 1
                )


class RecordTexture:
    """Records that shaders fetch by number, `RECORDS_PER_ROW` to a row of a texture of floats, four to a texel."""

    def __init__(self, scope: Scope, dtype: np.dtype[np.void]) -> None:
        self._scope = scope
        self._dtype = dtype
        self._texture = self._make(1)

    def _make(self, rows: int) -> moderngl.Texture:
        return self._scope.texture((RECORDS_PER_ROW * self._dtype.itemsize // 16, rows), 4, "f4")

    def upload(self, records: NDArray[np.void]) -> None:
        """Replaces what the texture holds by `records` (n,)."""
        rows = -(-len(records) // RECORDS_PER_ROW)
        if rows > self._texture.height:
            self._scope.free(self._texture)
            self._texture = self._make(2 * rows)
        padded = np.zeros(rows * RECORDS_PER_ROW, self._dtype)
        padded[: len(records)] = records
        self._texture.write(padded.tobytes(), viewport=(0, 0, self._texture.width, rows))

    def use(self, unit: int) -> None:
        self._texture.use(unit)


class AssetArrays:
    """Vertex arrays of one program over the assets' buffers, by any key, made when first drawn."""

    def __init__(self, scope: Scope, program: moderngl.Program, layout: str, *attributes: str) -> None:
        self._scope = scope
        self._program = program
        self._format = (layout, *attributes)
        self._arrays: dict[Hashable, moderngl.VertexArray] = {}

    def get(
        self, key: Hashable, vertices: moderngl.Buffer, indices: moderngl.Buffer, index_bytes: int = 4
    ) -> moderngl.VertexArray:
        if key not in self._arrays:
            content = [(vertices, *self._format)]
            options = {"index_buffer": indices, "index_element_size": index_bytes}
            self._arrays[key] = self._scope.vertex_array(self._program, content, **options)
        return self._arrays[key]

    def forget(self) -> None:
        """Releases all of them; to be called before the assets' buffers go."""
        self._scope.free(*self._arrays.values())
        self._arrays.clear()
