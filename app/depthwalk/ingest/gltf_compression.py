"""Decode whatever of a glTF file is compressed, so that all that reads it sees an ordinary one."""

from pathlib import Path
from typing import Any

from depthwalk.ingest.gltf import check_header
from depthwalk.ingest.gltf_accessors import Accessors
from depthwalk.ingest.gltf_draco import decompress_primitives
from depthwalk.ingest.gltf_meshopt import decompress_views
from depthwalk.ingest.gltf_sizes import buffer_bytes, check_placed_size
from depthwalk.ingest.sources import Sources


def decompress_checked(header: dict[str, Any], accessors: Accessors, length: int, path: Path, sources: Sources) -> bool:
    """Check a glTF file of so many bytes, beside its buffers, before and after it is decompressed.

    The other parameters and what is returned and raised are those of `decompress`; InputError also for a header that is
    not supported, and for more than the file or the machine's memory explains. `sources` keeps the buffers.
    """
    check_header(header, path)
    length += buffer_bytes(header, path, sources)
    compressed = decompress(header, accessors, path)
    check_placed_size(header, length + sum(map(len, accessors.added.values())), path)
    return compressed


def decompress(header: dict[str, Any], accessors: Accessors, path: Path) -> bool:
    """Replace compressed bufferViews and primitives by ordinary ones; return whether there were any.

    Parameters
    ----------
    header
        The JSON header, checked by `gltf.check_header`; changed in place.
    accessors
        Reads the file's data; holds the decoded data.
    path
        The file, for messages.

    Raises
    ------
    InputError
        `path: …` and `path: bufferViews[2]: …` as `decompress_views` and `decompress_primitives`.
    ValueError, TypeError, LookupError
        For other damaged data.
    """
    views = decompress_views(header, accessors, path)
    primitives = decompress_primitives(header, accessors, path)
    return views or primitives
