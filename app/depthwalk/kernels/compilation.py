"""Compile functions with numba, for declared types."""

from collections.abc import Callable
from typing import Annotated, Any, TypeVar, cast

import numba
import numpy as np
from numpy.typing import NDArray

_Function = TypeVar("_Function", bound=Callable[..., Any])


def _array(kind: numba.types.Type, axes: int) -> numba.types.Type:
    """Return the type of read-only arrays with any memory layout."""
    return numba.types.Array(kind, axes, "A", readonly=True)


# The annotations of compiled functions: an array's type, and after it how many axes it has.
Float32Array1 = Annotated[NDArray[np.float32], _array(numba.float32, 1)]
Float32Array2 = Annotated[NDArray[np.float32], _array(numba.float32, 2)]
Float64Array1 = Annotated[NDArray[np.float64], _array(numba.float64, 1)]
Float64Array2 = Annotated[NDArray[np.float64], _array(numba.float64, 2)]
Float64Array3 = Annotated[NDArray[np.float64], _array(numba.float64, 3)]
Float64Array4 = Annotated[NDArray[np.float64], _array(numba.float64, 4)]
Int64Array1 = Annotated[NDArray[np.int64], _array(numba.int64, 1)]
Int64Array2 = Annotated[NDArray[np.int64], _array(numba.int64, 2)]
Int32Array1 = Annotated[NDArray[np.int32], _array(numba.int32, 1)]
Int32Array2 = Annotated[NDArray[np.int32], _array(numba.int32, 2)]
UInt8Array1 = Annotated[NDArray[np.uint8], _array(numba.uint8, 1)]
BoolArray1 = Annotated[NDArray[np.bool_], _array(numba.boolean, 1)]
Float32Picture = Annotated[NDArray[np.float32], numba.types.Array(numba.float32, 2, "C", readonly=True)]  # row by row

_SCALARS = {int: numba.int64, float: numba.float64, bool: numba.boolean}


def compiled(function: _Function) -> _Function:
    """Compile a function into the compiled functions that call it, for the types that they give it.

    Division by zero gives infinity, as in NumPy. Python cannot call it: what would convert its arguments and results
    takes a tenth of the time to compile.

    Parameters
    ----------
    function : works on numbers and arrays.

    Returns
    -------
    The compiled function.
    """
    njit: Any = numba.njit
    inner = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return cast(_Function, njit(nogil=True, error_model="numpy", **inner)(function))


def compiled_as_annotated(function: _Function) -> _Function:
    """Compile a function when its module is imported, for its annotated types, or read it from numba's cache.

    Otherwise it is compiled as by `compiled`. Write into arrays number by number: for `a[k] = row`, numba also compiles
    what tells of a wrong shape, a sixth of all. Callers give arguments by name where these are many.

    Parameters
    ----------
    function : its parameters are annotated with int, float, bool, or one of the arrays above.

    Returns
    -------
    The compiled function.
    """
    njit: Any = numba.njit
    annotations = [kind for name, kind in function.__annotations__.items() if name != "return"]
    types = tuple(_SCALARS[kind] if kind in _SCALARS else kind.__metadata__[0] for kind in annotations)
    return cast(_Function, njit(types, cache=True, nogil=True, error_model="numpy")(function))
