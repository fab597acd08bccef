"""Suggest to a user that a model may not be in metres, the unit in which all files are read."""

from pathlib import Path

import numpy as np

from depthwalk.ingest.formats import METRIC_SUFFIXES
from depthwalk.types import Array

_LARGE = 100.0  # metres: nearly everything that is modelled as one mesh is smaller, but no 10 cm are in millimetres


def unit_hint(file: Path, extent: Array, remedy: str) -> str:
    """Return a hint that a model seems too large to be in metres.

    Programs for construction and printing write OBJ, PLY and STL files in millimetres, and none of these formats says
    so. In glTF the unit is the metre by definition (2.0, §3.4), FBX, COLLADA and 3MF files say theirs, and scans in LAS
    files are mostly larger.

    Parameters
    ----------
    file
        The mesh file.
    extent
        (3,) lengths of the model's edges along the axes, as read.
    remedy
        How the user gives the height in metres, as the end of the sentence.

    Returns
    -------
    str
        One line without the file's name; "" for a model of a usual size, or whose format has a unit.
    """
    largest = float(np.max(extent))
    if largest <= _LARGE or file.suffix.lower() in METRIC_SUFFIXES:
        return ""
    return f"{largest:,.4g} m large; if its unit is the millimetre, give its height in metres: {remedy}"
