"""Name the array types used in signatures throughout the package.

They describe an array's values. Its shape is given in the docstring of the function that takes it, since NumPy's types
cannot express it.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]
"""Floating-point values of either precision and any shape: points, directions, lengths, colours."""

Rows = NDArray[np.integer]
"""Integers of any width, mostly row numbers of another array."""

Ints = NDArray[np.int64]
"""64-bit integers, where the width matters because keys are computed as products of them."""

Mask = NDArray[np.bool_]
"""True where a condition holds, with the shape of the array that it selects from."""

Picture = NDArray[np.uint8]
"""A displayable picture (H, W, 3 or 4), sRGB, 0 to 255, the first row at the top."""
