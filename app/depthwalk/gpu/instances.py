"""Draw instances: hold a record per object as vertex attributes or in a texture, and a vertex array per asset.

All instances of an asset are one draw call, in which the vertex stage reads a record for each object. GL 3.3 has no
base instance, so `InstanceStream` holds the records of one draw at a time: replacing these takes four GL calls,
pointing the attributes at other records five for each.
"""

from collections.abc import Hashable
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from depthwalk.gpu.device import Scope
from depthwalk.gpu.program import Program

RECORDS_PER_ROW = 1024  # records in a row of a `RecordTexture`
_COPIED_ROWS = 64  # of a `RecordTexture`, at most: copying them takes less time than another call of GL
_TEXEL_BYTES = 16  # of four floats


class InstanceStream:
    """Hold the records of the next draw in a buffer of just their size.

    Each field of a record is a vertex attribute, named `in_` plus the name of the field in the shader.
    """

    def __init__(self, scope: Scope, dtype: np.dtype[np.void]) -> None:
        """Create a small buffer in `scope`, which owns it, for records of `dtype`, whose fields are all float32."""
        self._scope = scope
        self._stride = dtype.itemsize
        self._fields = []
        fields: Any = dtype.fields
        for name in dtype.names or ():
            field, offset = fields[name][:2]
            components = int(np.prod(field.shape)) if field.shape else 1
            self._fields.append((f"in_{name}", f"{components}f", int(offset)))
        self._buffer = scope.buffer(reserve=self._stride, dynamic=True)

    def upload(self, records: NDArray[np.void]) -> None:
        """Replace the buffer's contents by `records` (n,) of the stream's dtype; earlier draws keep their own."""
        self._scope.refill(self._buffer, records)

    def bind(self, array: moderngl.VertexArray) -> None:
        """Let all draws of `array` read the records that are uploaded at the time, one for each instance."""
        if array.extra is self._buffer:  # bound already
            return
        array.extra = self._buffer
        members: Any = array.program
        for name, layout, offset in self._fields:
            if name in members:
                array.bind(members[name].location, "f", self._buffer, layout, offset, self._stride, 1)


class RecordTexture:
    """Hold records that shaders fetch by number, in a texture of floats, four to a texel.

    There are `RECORDS_PER_ROW` to a row. Shaders get the first texel of each field by `#from`, see `gpu.shader_source`.
    """

    def __init__(self, scope: Scope, dtype: np.dtype[np.void], records: int = 1) -> None:
        """Create a texture in `scope`, which owns it, with room for records of `dtype`, a multiple of 16 bytes."""
        self._scope = scope
        self._dtype = dtype
        self._texture = self._make(max(-(-records // RECORDS_PER_ROW), 1))

    def _make(self, rows: int) -> moderngl.Texture:
        """Create a texture for `rows` rows of records."""
        return self._scope.texture((RECORDS_PER_ROW * self._dtype.itemsize // _TEXEL_BYTES, rows), 4, "f4")

    def upload(self, records: NDArray[np.void]) -> None:
        """Replace the texture's first records by `records` (n,) of its dtype; later records become undefined."""
        rows = -(-len(records) // RECORDS_PER_ROW)
        if rows > self._texture.height:
            self._scope.free(self._texture)
            # A power of two, as one row is: software rasterisers compile programs anew for other textures.
            self._texture = self._make(1 << rows.bit_length())
        full, rest = divmod(len(records), RECORDS_PER_ROW)
        width, records = self._texture.width, np.ascontiguousarray(records)
        if full > _COPIED_ROWS or not rest:  # not copied, since there may be millions
            if full:
                self._texture.write(records[: len(records) - rest], viewport=(0, 0, width, full))
            records, full = records[len(records) - rest :], 0
        if rest:  # the texture takes whole rows
            padded = np.zeros((full + 1) * RECORDS_PER_ROW, self._dtype)
            padded[: len(records)] = records
            self._texture.write(padded, viewport=(0, rows - full - 1, width, full + 1))

    def use(self, unit: int) -> None:
        """Bind the texture to the texture unit with the number `unit`."""
        self._texture.use(unit)

    def free(self) -> None:
        """Free the texture; nothing may be fetched from it afterwards."""
        self._scope.free(self._texture)


class AssetArrays:
    """Keep the vertex arrays of one program over the assets' buffers, each created when it is first drawn.

    The arrays belong to the scope of the pass that draws, the buffers to the asset store. Before the store releases
    buffers, it makes every pass `forget` its arrays.
    """

    def __init__(self, scope: Scope, program: Program, layout: str, *attributes: str) -> None:
        """Store what the arrays are created from; none is created yet.

        Parameters
        ----------
        scope
            The scope of the pass that draws, which owns the arrays.
        program
            The program that draws with them; it is compiled for the first of them.
        layout
            moderngl's format of a vertex, such as "3f4 2u2".
        attributes
            The names of the shader's attributes, in the order of `layout`.
        """
        self._scope = scope
        self._program = program
        self._format = (layout, *attributes)
        self._arrays: dict[Hashable, moderngl.VertexArray] = {}

    def get(
        self,
        key: Hashable,
        vertices: moderngl.Buffer,
        indices: moderngl.Buffer,
        index_bytes: int = 4,
        offset: int = 0,
    ) -> moderngl.VertexArray:
        """Return the vertex array of an asset.

        Parameters
        ----------
        key
            Identifies the asset, its level if it has several, and the offset if there are several.
        vertices
            The asset's buffer of vertices.
        indices
            The asset's buffer of indices.
        index_bytes
            Bytes of an index: 1, 2 or 4.
        offset
            Byte of `vertices` at which the vertex with index 0 begins, in place of a base vertex, which moderngl does
            not offer. Unless it is 0, vertices have one attribute, of integers.

        Returns
        -------
        moderngl.VertexArray
            The array, created when it is first asked for.
        """
        if key not in self._arrays:
            content = [(vertices, *self._format)]
            options = {"index_buffer": indices, "index_element_size": index_bytes}
            array = self._arrays[key] = self._scope.vertex_array(self._program.gl, content, **options)
            if offset:
                layout, name = self._format
                attribute: Any = self._program.gl[name]
                array.bind(attribute.location, "i", vertices, layout, offset)
        return self._arrays[key]

    def forget(self) -> None:
        """Release all arrays, which must happen before the assets' buffers are released."""
        self._scope.free(*self._arrays.values())
        self._arrays.clear()
