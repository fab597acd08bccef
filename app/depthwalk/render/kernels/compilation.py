"""Compile functions with numba, for types that are known beforehand."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

_Function = TypeVar("_Function", bound=Callable[..., Any])


def _array(kind: numba.types.Type, axes: int) -> numba.types.Type:
    """Return the type of arrays that are only read, however they lie in memory."""
    return numba.types.Array(kind, axes, "A", readonly=True)


_KINDS: dict[str, numba.types.Type] = {
    "F": numba.float32,
    "D": numba.float64,
    "I": numba.int64,
    "N": numba.int32,
    "U": numba.uint8,
    "B": numba.boolean,
}
TYPES = {  # by the names that signatures have for them: F2 is a float32 array with two axes
    "i": numba.int64,
    "f": numba.float64,
    "?": numba.boolean,
    "P2": numba.types.Array(numba.float32, 2, "C", readonly=True),  # a picture, row by row
} | {f"{name}{axes}": _array(kind, axes) for name, kind in _KINDS.items() for axes in range(1, 5)}


def compiled(signature: str = "") -> Callable[[_Function], _Function]:
    """Compile a function of numbers and arrays when its module is imported, or read it from numba's cache.

    Division by zero gives an infinity, as in NumPy, and other threads run meanwhile.

    Parameters
    ----------
    signature : the types of the arguments, names of `TYPES` divided by blanks; none: the function is made part of the
        compiled functions that call it, for whatever types they give.

    Returns
    -------
    The decorator.
    """
    njit: Any = numba.njit
    if not signature:
        return cast(Callable[[_Function], _Function], njit(nogil=True, error_model="numpy"))
    types = tuple(TYPES[name] for name in signature.split())
    return cast(Callable[[_Function], _Function], njit(types, cache=True, nogil=True, error_model="numpy"))
