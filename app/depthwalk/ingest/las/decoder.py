"""Read the points of LAS and LAZ files, in a process that may take only as much as the files explain.

What decompresses LAZ allocates as much as a damaged file says, 47 GB in one case; where it cannot, it ends the process.
"""

import io
import struct
import zipfile
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthwalk.budget import check_memory
from depthwalk.errors import InputError, counted
from depthwalk.extras import install_command
from depthwalk.ingest.point_cloud import PointCloud
from depthwalk.ingest.watched_process import run_watched
from depthwalk.limits import MAX_MESH_TRIANGLES

_WORKER = "depthwalk.ingest.las.worker"
_SHORTEST = 227  # bytes of a header of LAS 1.0
_LONG = 375  # bytes of a header of LAS 1.4, which has 64 bits for the number of points
_RECORD = 54  # bytes of the head of a variable-length record
# What reading may take: two million points with colours, compressed, take 100 bytes and 0.6 µs each.
_BYTES, _BYTES_PER_POINT = 256 << 20, 300
_SECONDS, _SECONDS_PER_POINT = 5.0, 2e-5


def read_las(data: bytes, path: Path) -> PointCloud:
    """Read the points of a LAS or LAZ file, without those that it calls noise or withholds.

    Parameters
    ----------
    data
        The contents of the file.
    path
        The file, for messages.

    Returns
    -------
    PointCloud
        The points, in the unit of the file, without normals. The file's z axis, which points upward (LAS 1.4, §2.4), is
        y here: x, z, −y.

    Raises
    ------
    InputError
        `path: defect`, also if laspy is not installed.
    """
    if find_spec("laspy") is None or find_spec("lazrs") is None:
        raise InputError(f"{path}: `{install_command('las')}` installs what reads LAS and LAZ files")
    count = _checked_count(data, path)
    most_bytes = _BYTES + _BYTES_PER_POINT * count + len(data)
    check_memory(path, most_bytes, f"{count} points")
    most_seconds = _SECONDS + _SECONDS_PER_POINT * count
    is_ready, archive, excess = run_watched(_WORKER, [data], most_bytes=most_bytes, most_seconds=most_seconds)
    if excess:
        raise InputError(f"{path}: damaged: it takes too much {excess} to read")
    if not is_ready:
        raise InputError(f"{path}: laspy, which reads LAS and LAZ files, does not start")
    if (cloud := _cloud(archive)) is None:
        raise InputError(f"{path}: damaged, truncated or an unsupported kind of LAS")
    if not len(cloud.positions):
        raise InputError(f"{path}: all of its {counted(count, 'point')} are noise or withheld")
    return cloud


def _checked_count(data: bytes, path: Path) -> int:
    """Return how many points the header of a file announces; raise InputError unless it is a header that may be right.

    laspy believes it, and would read thousands of millions of records that a few bytes announce.
    """
    if not data.startswith(b"LASF") or len(data) < _SHORTEST:
        raise InputError(f"{path}: not a LAS file, or truncated in its header")
    length, start, records = struct.unpack_from("<HII", data, 94)
    if start > len(data) or _RECORD * records > start:
        raise InputError(f"{path}: damaged: its header does not fit into the file")
    count: int = struct.unpack_from("<I", data, 107)[0]
    if data[25] >= 4 and _LONG <= length <= len(data):  # the minor version
        count = struct.unpack_from("<Q", data, 247)[0]
    if count == 0:
        raise InputError(f"{path}: holds no points")
    if 2 * count > MAX_MESH_TRIANGLES:
        raise InputError(f"{path}: {count} points; at most {MAX_MESH_TRIANGLES // 2} are allowed")
    return count


def _cloud(archive: bytes) -> PointCloud | None:
    """Return the points in an archive that the worker has written; None if it has not written all of it."""
    try:
        with np.load(io.BytesIO(archive), allow_pickle=False) as arrays:
            positions, colours = arrays["positions"], arrays["colours"]
    except (ValueError, OSError, EOFError, KeyError, zipfile.BadZipFile):
        return None
    normals = np.full_like(positions, np.nan)
    return PointCloud(positions[:, [0, 2, 1]] * [1, 1, -1], normals, _srgb8(colours) if len(colours) else None)


def _srgb8(colours: NDArray[np.uint16]) -> NDArray[np.uint8] | None:
    """Return colours (n, 3) of 8 bits; None where all are black, as without any.

    They should have 16 bits (LAS 1.4, §2.6); many programs write 8.
    """
    most = int(colours.max(initial=0))
    if most == 0:
        return None
    return (colours if most < 256 else colours >> 8).astype(np.uint8)
