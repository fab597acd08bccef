"""Replace the primitives of glTF files that Draco has compressed (`KHR_draco_mesh_compression`) by ordinary ones.

Done as soon as the header is read, so that everything else sees a file without compression. That includes `trimesh`,
which would decode Draco itself, without any bounds.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError
from depthwalk.ingest.draco.decoder import DracoMesh, DracoStream, decode
from depthwalk.ingest.gltf import DRACO, TRIANGLES, accessor_numbers, compressed_primitives
from depthwalk.ingest.gltf_accessors import DTYPES, WIDTHS, Accessors

_STRIP = 5  # mode of primitives of triangles that share two corners with the one before

Header = dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class _Compressed:
    """Hold a primitive that must be decoded: where it is, the view of its stream, the unique IDs of its attributes."""

    where: str
    primitive: Header
    view: int
    ids: dict[str, int]


def decompress_primitives(header: Header, accessors: Accessors, path: Path) -> bool:
    """Replace compressed primitives by ordinary ones.

    Where a file holds the same without compression, too, for programs that do not know the extension, that is used.
    Strips become separate triangles, as Draco holds them.

    Parameters
    ----------
    header
        The JSON header, checked by `gltf.check_header`; changed in place.
    accessors
        Reads the file's streams; holds the decoded data.
    path
        The file, for messages.

    Returns
    -------
    bool
        Whether there were any.

    Raises
    ------
    InputError
        `path: meshes[0].primitives[1]: defect`, and as `draco.decoder.decode`.
    ValueError, TypeError, LookupError
        For other damaged data.
    """
    listed = list(compressed_primitives(header))
    found = []
    for where, primitive in listed:
        terms = primitive["extensions"].pop(DRACO)
        if not all(_has_data(header["accessors"][number]) for number in accessor_numbers(primitive)):
            found.append(
                _Compressed(
                    where=f"{path}: {where}", primitive=primitive, view=terms["bufferView"], ids=terms["attributes"]
                )
            )
    if found:
        streams: dict[int, DracoStream] = {}
        for compressed in found:
            if compressed.view not in streams:
                streams[compressed.view] = _stream(compressed, header, accessors)
        decoded = dict(zip(streams, decode(list(streams.values()), path), strict=True))
        replacement = _Replacement(header, accessors)
        for compressed in found:
            replacement.fill(compressed, decoded[compressed.view])
    return bool(listed)


def _has_data(accessor: Header) -> bool:
    return "bufferView" in accessor or "sparse" in accessor


def _stream(compressed: _Compressed, header: Header, accessors: Accessors) -> DracoStream:
    """Return the stream of a primitive, with the sizes that its accessors announce."""
    primitive = compressed.primitive
    named = [header["accessors"][primitive["attributes"][name]] for name in compressed.ids]
    return DracoStream(
        where=compressed.where,
        data=accessors.view(compressed.view),
        triangles=_most_triangles(compressed, header),
        vertices=header["accessors"][primitive["attributes"]["POSITION"]]["count"],
        width=sum(WIDTHS[accessor["type"]] for accessor in named),
    )


def _most_triangles(compressed: _Compressed, header: Header) -> int:
    """Return how many triangles the accessors of a primitive announce. Raises InputError for other primitives."""
    primitive = compressed.primitive
    mode = primitive.get("mode", TRIANGLES)
    if mode not in (TRIANGLES, _STRIP) or "indices" not in primitive:
        raise InputError(f"{compressed.where}: Draco compresses only triangles and strips, with indices")
    corners: int = header["accessors"][primitive["indices"]]["count"]
    return corners // 3 if mode == TRIANGLES else corners - 2


class _Replacement:
    """Fill accessors with decoded data; each attribute of a stream once."""

    def __init__(self, header: Header, accessors: Accessors) -> None:
        self.header = header
        self.accessors = accessors
        self.filled: dict[object, int] = {}

    def fill(self, compressed: _Compressed, mesh: DracoMesh) -> None:
        """Give a primitive the data of a decoded mesh.

        Old exporters announce the vertices that a mesh has before it is compressed; Draco may divide some, of which
        each triangle has three at most, and leaves triangles out that have no area.
        """
        where, primitive = compressed.where, compressed.primitive
        most = _most_triangles(compressed, self.header)
        count = max(map(len, mesh.attributes.values()), default=0)
        if not 0 < len(mesh.faces) <= most:
            raise InputError(f"{where}: its Draco data has {len(mesh.faces)} triangles instead of {most}")
        if count > 3 * most or mesh.faces.max() >= count:
            raise InputError(f"{where}: the {most} triangles of its Draco data do not fit its {count} vertices")
        attributes = {
            name: self._attribute(compressed, mesh, name, number, count)
            for name, number in primitive["attributes"].items()
        }
        key = compressed.view, "faces", primitive["indices"]
        if key not in self.filled:
            self.filled[key] = self._place(primitive["indices"], mesh.faces.reshape(-1, 1))
        primitive |= {"attributes": attributes, "indices": self.filled[key], "mode": TRIANGLES}

    def _attribute(self, compressed: _Compressed, mesh: DracoMesh, name: str, number: int, count: int) -> int:
        """Return the number of an accessor with an attribute of so many vertices, of the mesh or beside it."""
        accessor, where = self.header["accessors"][number], f"{compressed.where}: {name}"
        if name not in compressed.ids:
            if not _has_data(accessor):  # which stands for zeros
                zeros = np.zeros((count, WIDTHS[accessor["type"]]), DTYPES[accessor["componentType"]])
                return self._place(number, zeros)
            if accessor["count"] != count:
                raise InputError(f"{where}: {accessor['count']} values for the {count} vertices of its Draco data")
            return number
        key = compressed.view, compressed.ids[name], number
        if key not in self.filled:
            values = mesh.attributes.get(compressed.ids[name])
            if values is None or len(values) != count:
                raise InputError(f"{where} is missing from its Draco data")
            self.filled[key] = self._place(number, _as_announced(values, accessor, where))
        return self.filled[key]

    def _place(self, number: int, values: NDArray[Any]) -> int:
        """Return the number of an accessor with these values: this one, or a copy if it has others."""
        listed = self.header["accessors"]
        if _has_data(listed[number]):
            listed.append({key: value for key, value in listed[number].items() if key not in ("min", "max")})
            number = len(listed) - 1
        self.accessors.fill(number, values)
        return number


def _as_announced(values: NDArray[Any], accessor: Header, where: str) -> NDArray[Any]:
    """Return decoded values (V, width) in the type of their accessor.

    Raises InputError for those of another kind.
    """
    dtype, width = np.dtype(DTYPES[accessor["componentType"]]), WIDTHS[accessor["type"]]
    if values.shape[1] != width or (dtype.kind == "f" and values.dtype.kind != "f"):
        raise InputError(f"{where} has another type in its Draco data than in its accessor")
    if dtype.kind == "f":
        return values.astype(dtype)
    limits = np.iinfo(dtype)
    if values.dtype.kind == "f":
        if accessor.get("normalized", False) and np.abs(values).max() <= 1:  # as fractions, if Draco has them so
            values = values * np.float32(limits.max)
        values = np.rint(values)
    if not ((values >= limits.min) & (values <= limits.max)).all():
        raise InputError(f"{where} has numbers in its Draco data that its accessor cannot hold")
    return values.astype(dtype)
