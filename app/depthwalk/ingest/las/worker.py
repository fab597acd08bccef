"""Read the points of a LAS or LAZ file in a process of its own, which `las.decoder` starts and watches.

It reads the file from its standard input. To its standard output it writes READY, once the library is imported, and
then an NPZ archive of `positions` (n, 3) float64 and `colours` (n, 3) uint16, or (0, 3) without colours, of the points
that are shown. Nothing follows READY if the file is damaged.
"""

import io
import logging
import sys

import numpy as np
from numpy.typing import NDArray

from depthwalk.ingest.watched_process import READY

_CHUNK = 1 << 20  # points at a time
_NOISE = (7, 18)  # classes of points that the maker of the file calls noise: low and high (LAS 1.4, table 17)


def main() -> None:
    """Read a file from standard input and write its points to standard output."""
    import laspy  # noqa: F401  # so that READY says that it is there

    logging.getLogger("laspy").setLevel(logging.CRITICAL)
    sys.stdout.buffer.write(READY)
    sys.stdout.buffer.flush()
    positions, colours = _points(sys.stdin.buffer.read())
    packed = io.BytesIO()
    np.savez(packed, allow_pickle=False, positions=positions, colours=colours)
    sys.stdout.buffer.write(packed.getbuffer())


def _points(data: bytes) -> tuple[NDArray[np.float64], NDArray[np.uint16]]:
    """Return positions and colours of the points of a file that are shown. Raises ValueError if some are missing."""
    import laspy

    needed = laspy.DecompressionSelection  # what is decompressed of LAZ files of recent formats
    selection = needed.XY_RETURNS_CHANNEL | needed.Z | needed.CLASSIFICATION | needed.FLAGS | needed.RGB
    positions, colours, count = [np.zeros((0, 3))], [np.zeros((0, 3), np.uint16)], 0
    with laspy.open(io.BytesIO(data), read_evlrs=False, decompression_selection=selection) as reader:
        has_colours = "red" in set(reader.header.point_format.dimension_names)
        for points in reader.chunk_iterator(_CHUNK):
            count += len(points)
            shown = ~np.isin(np.asarray(points.classification), _NOISE) & (np.asarray(points.withheld) == 0)
            positions.append(np.column_stack([points.x, points.y, points.z])[shown])
            if has_colours:
                colours.append(np.column_stack([points.red, points.green, points.blue])[shown])
        if count != reader.header.point_count:
            raise ValueError("truncated")
    return np.concatenate(positions), np.concatenate(colours)


if __name__ == "__main__":
    main()
