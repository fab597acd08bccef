"""Name the array types of signatures in the whole package.

They say what an array's values are. Its shape stands in the docstring of the function that takes it, since NumPy's
types cannot say it.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]
"""Floating-point values of either precision and any shape: points, directions, lengths, colours."""

Rows = NDArray[np.integer]
"""Whole numbers of any width, mostly row numbers of another array."""

Ints = NDArray[np.int64]
"""Whole numbers of 64 bits, where the width matters because keys are made of products of them."""

Mask = NDArray[np.bool_]
"""True where something holds, of the shape of the array that it selects from."""

Picture = NDArray[np.uint8]
"""A displayable picture (H, W, 3 or 4), sRGB, 0 to 255, the first row at the top."""
