"""The array types that every module shares."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def frozen(values: Any) -> Array:
    """Read-only float64 copy of `values`, so that no caller's array is ever changed."""
    out = np.array(values, dtype=np.float64)
    out.flags.writeable = False
    return out


def read_only(values: Array) -> Array:
    """Read-only view, so that a kernel is compiled once for arrays that may be written or not."""
    out = values.view()
    out.flags.writeable = False
    return out
