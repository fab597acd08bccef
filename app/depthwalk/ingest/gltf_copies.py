"""Find which meshes of a glTF file are the same, although the file lists them separately.

Exporters write a mesh anew for each of its copies; some of them store the data once, others again and again.
"""

import hashlib
import json
from collections import Counter
from typing import Any

from depthwalk.ingest.gltf import surfaces
from depthwalk.ingest.gltf_accessors import Accessors

_HASHED = 4  # bytes of data that are compared, at most, for each byte of the file: accessors may share their data

Header = dict[str, Any]


def first_of_same(header: Header, accessors: Accessors, length: int) -> list[int]:
    """Return for each mesh the number of the first one that looks the same.

    Meshes look the same if the triangles, in this order, and the materials are equal, but for names.

    Parameters
    ----------
    header
        The JSON header, checked by `gltf.check_header`.
    accessors
        Reads its accessors.
    length
        How many bytes the file's data have. A file may describe them as many accessors; if comparing these takes too
        long, meshes count as different.

    Raises
    ------
    ValueError, TypeError, LookupError
        For damaged data.
    """
    meshes = [surfaces(mesh) for mesh in header.get("meshes", [])]
    materials = [_text(material, without=("name", "extras")) for material in header.get("materials", [])]
    data = _Contents(header, accessors, _HASHED * length)
    used = {at for mesh in meshes for primitive in mesh for at in _accessors(primitive)}
    data.compare(sorted(used))
    first: dict[object, int] = {}
    same = []
    for number, mesh in enumerate(meshes):
        looks = tuple(
            (
                primitive.get("mode"),
                materials[primitive["material"]] if "material" in primitive else None,
                tuple(sorted((name, data.kind[at]) for name, at in primitive["attributes"].items())),
                data.kind[primitive["indices"]] if "indices" in primitive else None,
            )
            for primitive in mesh
        )
        same.append(first.setdefault(looks, number))
    return same


def _accessors(primitive: Header) -> list[int]:
    indices = [primitive["indices"]] if "indices" in primitive else []
    return [*primitive["attributes"].values(), *indices]


def _text(item: Header, without: tuple[str, ...]) -> str:
    """Return an item of the header as text that is the same for equal ones."""
    return json.dumps({key: value for key, value in item.items() if key not in without}, sort_keys=True)


class _Contents:
    """Number accessors by what they hold.

    Attributes
    ----------
    kind
        The number of each accessor that was compared; equal ones have the same.
    """

    def __init__(self, header: Header, accessors: Accessors, most: int) -> None:
        self._listed, self._accessors, self._left = header.get("accessors", []), accessors, most
        self.kind: dict[int, int] = {}

    def compare(self, numbers: list[int]) -> None:
        """Give these accessors their numbers."""
        known: dict[object, int] = {}
        places = {at: _text(self._listed[at], without=("name", "extras", "min", "max")) for at in numbers}
        first = {place: at for at, place in reversed(places.items())}
        alike = Counter(self._head(at) for at in first.values())
        for at in numbers:
            shared = first[places[at]]
            if shared != at:
                self.kind[at] = self.kind[shared]
                continue
            head = self._head(at)
            content = self._hash(at) if alike[head] > 1 else None
            self.kind[at] = known.setdefault((head, at if content is None else content), len(known))

    def _head(self, at: int) -> tuple[object, ...]:
        accessor = self._listed[at]
        return accessor["componentType"], accessor["type"], accessor["count"], accessor.get("normalized", False)

    def _hash(self, at: int) -> bytes | None:
        """Return a hash of the values of an accessor; None if enough were hashed."""
        if self._left <= 0:
            return None
        values = self._accessors.stored(at)
        self._left -= values.nbytes
        return hashlib.blake2b(values.data, digest_size=20).digest()
