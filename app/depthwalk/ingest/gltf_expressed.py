"""Express all that a glTF file holds in plain terms: geometry, materials and normal maps."""

from pathlib import Path
from typing import Any

from depthwalk.ingest.gltf import fold_extensions
from depthwalk.ingest.gltf_accessors import Accessors
from depthwalk.ingest.gltf_compression import decompress_checked
from depthwalk.ingest.gltf_geometry import express
from depthwalk.ingest.gltf_normal_maps import fold_normal_maps
from depthwalk.ingest.gltf_points import warn_of_undrawn
from depthwalk.ingest.gltf_reflection import fold_roughness_maps
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
    compressed = decompress_checked(header, accessors, length, path, sources)
    decoded = decode_pictures(header, accessors, path)
    warn_of_missing_textures(header, accessors, path)
    warn_of_undrawn(header, path)
    changed = [express(header, accessors), fold_extensions(header, path), fold_normal_maps(header, path)]
    return compressed or decoded or any(changed) or fold_roughness_maps(header)
