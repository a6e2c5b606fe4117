"""The array types that every module shares."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def frozen(values: Any) -> Array:
    """Read-only float64 copy of `values`, so that no caller's array is ever changed.

    What nobody can write already is passed on as it is: a long log's signals are large.
    """
    if isinstance(values, np.ndarray) and values.dtype == np.float64 and _is_frozen(values):
        return values
    out = np.array(values, dtype=np.float64)
    out.flags.writeable = False
    return out


def _is_frozen(values: Array) -> bool:
    base: object = values.base
    locked = base is None or (isinstance(base, np.ndarray) and not base.flags.writeable)
    return locked and not values.flags.writeable


def read_only(values: Array) -> Array:
    """Read-only view, so that a kernel is compiled once for arrays that may be written or not."""
    out = values.view()
    out.flags.writeable = False
    return out
