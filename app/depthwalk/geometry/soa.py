"""TODO docstring."""

from collections.abc import Sequence
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray


class Takes:
    """Structures of arrays with one row per thing: `take` selects rows of all of them, `put` overwrites them, `joined`
    puts those of several one after the other."""

    __dataclass_fields__: ClassVar[dict[str, Any]]  # by their names

    def take(self, rows: NDArray[np.integer] | NDArray[np.bool_] | slice) -> Self:
        columns = {name: getattr(self, name) for name in self.__dataclass_fields__}
        if isinstance(rows, slice):
            return type(self)(**{name: column[rows] for name, column in columns.items()})
        if rows.dtype == bool:
            rows = rows.nonzero()[0]
        # `take` is quicker than an index, by far of records.
        return type(self)(**{name: column.take(rows, 0) for name, column in columns.items()})

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        names = cls.__dataclass_fields__
        return cls(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})

    def put(self, rows: NDArray[np.integer] | slice, other: Self) -> None:
        for name in self.__dataclass_fields__:
            getattr(self, name)[rows] = getattr(other, name)
