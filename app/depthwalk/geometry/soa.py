"""Define structures of arrays: data classes whose fields are columns, from which rows are selected together."""

from collections.abc import Sequence
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray


class StructOfArrays:
    """Give a data class whose fields are arrays of one length the operations of a table.

    Each field is a column of the table, and row k of all columns describes thing k. Work over thousands of objects then
    stays vectorised, and no column is forgotten when rows are selected.
    """

    __dataclass_fields__: ClassVar[dict[str, Any]]  # by their names

    def take(self, rows: NDArray[np.integer] | NDArray[np.bool_] | slice) -> Self:
        """Return the same structure with only the given rows.

        Parameters
        ----------
        rows
            Row numbers (m,), a mask (n,), or a slice; for a slice, the result shares its memory with this structure.

        Returns
        -------
        Self
            A structure with the chosen rows.
        """
        columns = {name: getattr(self, name) for name in self.__dataclass_fields__}
        if isinstance(rows, slice):
            return type(self)(**{name: column[rows] for name, column in columns.items()})
        if rows.dtype == bool:
            rows = rows.nonzero()[0]
        # `take` is quicker than indexing, especially for records.
        return type(self)(**{name: column.take(rows, 0) for name, column in columns.items()})

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Return one structure with the rows of all `parts`, structures of this class, one after the other."""
        names = cls.__dataclass_fields__
        return cls(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})

    def put(self, rows: NDArray[np.integer] | slice, other: Self) -> None:
        """Overwrite m rows of every column, in place.

        Parameters
        ----------
        rows
            Row numbers (m,) int, or a slice of m rows.
        other
            A structure of m rows, which are copied.
        """
        for name in self.__dataclass_fields__:
            getattr(self, name)[rows] = getattr(other, name)
