"""Compile functions with numba, for declared types."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

_Function = TypeVar("_Function", bound=Callable[..., Any])


def _array(kind: numba.types.Type, axes: int) -> numba.types.Type:
    """Return the type of read-only arrays with any memory layout."""
    return numba.types.Array(kind, axes, "A", readonly=True)


_KINDS: dict[str, numba.types.Type] = {
    "F": numba.float32,
    "D": numba.float64,
    "I": numba.int64,
    "N": numba.int32,
    "U": numba.uint8,
    "B": numba.boolean,
}
TYPES = {  # by their names in signatures: F2 is a float32 array with two axes
    "i": numba.int64,
    "f": numba.float64,
    "?": numba.boolean,
    "P2": numba.types.Array(numba.float32, 2, "C", readonly=True),  # a picture, row by row
} | {f"{name}{axes}": _array(kind, axes) for name, kind in _KINDS.items() for axes in range(1, 5)}


def compiled(signature: str = "") -> Callable[[_Function], _Function]:
    """Compile a function of numbers and arrays when its module is imported, or read it from numba's cache.

    Division by zero gives infinity, as in NumPy. The function releases the GIL, so that other threads can run.

    Parameters
    ----------
    signature : the types of the arguments, names of `TYPES` separated by blanks; empty: the function is compiled into
        the compiled functions that call it, for their types.

    Returns
    -------
    The decorator.
    """
    njit: Any = numba.njit
    if not signature:
        return cast(Callable[[_Function], _Function], njit(nogil=True, error_model="numpy"))
    types = tuple(TYPES[name] for name in signature.split())
    return cast(Callable[[_Function], _Function], njit(types, cache=True, nogil=True, error_model="numpy"))
