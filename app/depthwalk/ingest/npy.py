"""Map NPY files, which hold one array each, into memory."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthwalk.errors import InputError, missing_file


def map_npy(path: Path) -> NDArray[Any]:
    """Map the array of an NPY file, read-only, so that a header with a wrong size allocates nothing.

    `numpy.load` is unsuitable: it also opens archives and pickles.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    numpy.ndarray
        The array, of any shape and type, mapped to memory.

    Raises
    ------
    InputError
        `path: defect`, if the file is missing, of another format, damaged, or holds Python objects.
    """
    if not path.is_file():
        raise missing_file(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about old headers, and about damaged ones as Python's parser sees them
            return np.lib.format.open_memmap(path, mode="r")
    except Exception:  # the header is parsed as Python: damaged ones raise nearly anything, even tokenize.TokenError
        raise InputError(f"{path}: cannot be read as an NPY array") from None
