"""Make small LAS and LAZ files."""

from pathlib import Path

import laspy
import numpy as np

from depthwalk.types import Array, Mask

OFFSET = np.array([512_345.5, 5_400_123.25, 300.0])  # as in the grid of a country


def write_las(
    path: Path, points: Array, colours: Array | None = None, *, version: str = "1.4", **columns: Array | Mask
) -> Path:
    """Write points (n, 3), z upward, about OFFSET, and colours (n, 3) of 16 bits; LAZ if the name of `path` ends so."""
    recent = version == "1.4"
    header = laspy.LasHeader(
        point_format=(7 if recent else 2) if colours is not None else (6 if recent else 0), version=version
    )
    header.offsets, header.scales = OFFSET, np.full(3, 1e-4)
    scan = laspy.LasData(header)
    scan.x, scan.y, scan.z = (points + OFFSET).T
    if colours is not None:
        scan.red, scan.green, scan.blue = colours.astype(np.uint16).T
    for name, column in columns.items():
        setattr(scan, name, column)
    scan.write(str(path))
    return path
