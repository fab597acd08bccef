"""Express all that a glTF file holds in plain terms: geometry, materials and normal maps."""

from pathlib import Path
from typing import Any

from depthwalk.ingest import gltf
from depthwalk.ingest.gltf_accessors import Accessors
from depthwalk.ingest.gltf_compression import decompress
from depthwalk.ingest.gltf_geometry import express
from depthwalk.ingest.gltf_normal_maps import fold_normal_maps
from depthwalk.ingest.gltf_points import warn_of_undrawn
from depthwalk.ingest.gltf_sizes import buffer_bytes, check_placed_size
from depthwalk.ingest.gltf_textures import decode_pictures, warn_of_missing_textures
from depthwalk.ingest.sources import Sources


def expressed(header: dict[str, Any], accessors: Accessors, length: int, path: Path, sources: Sources) -> bool:
    """Check a glTF file, and express it in the core terms of glTF; warn of what is not drawn.

    Parameters
    ----------
    header
        The JSON header, changed in place.
    accessors
        Reads the file's accessors; holds what is added to them.
    length
        The bytes of the file itself.
    path
        The file, for messages, and to find its buffers beside it.
    sources
        Reads files and keeps their bytes.

    Returns
    -------
    bool
        Whether anything was changed.

    Raises
    ------
    InputError
        `path: defect`.
    ValueError, TypeError, LookupError, AttributeError
        For other damaged data.
    """
    gltf.check_header(header, path)
    length += buffer_bytes(header, path, sources)
    compressed = decompress(header, accessors, path)
    check_placed_size(header, length + sum(map(len, accessors.added.values())), path)
    decoded = decode_pictures(header, accessors, path)
    warn_of_missing_textures(header, accessors, path)
    warn_of_undrawn(header, path)
    changed = [express(header, accessors), gltf.fold_extensions(header, path), fold_normal_maps(header, path)]
    return compressed or decoded or any(changed)
