"""The one place where numba is called: typed decorators for compiled kernels."""

from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar, cast

import numba

P = ParamSpec("P")
R = TypeVar("R")

# Fused multiply-add is allowed (it rounds less); reordering and NaN-blind forms are not.
CONTRACT = {"contract"}


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """`function` compiled on first call, cached on disk, run without the interpreter's lock."""
    return _jit(function, fastmath=CONTRACT)


def compiled_fast(function: Callable[P, R]) -> Callable[P, R]:
    """As `compiled`, with reordered sums: for reductions whose rounding is of no account."""
    return _jit(function, fastmath=True)


def compiled_inline(function: Callable[P, R]) -> Callable[P, R]:
    """As `compiled`, always inlined into its caller (for the innermost vector loops)."""
    return _jit(function, fastmath=CONTRACT, forceinline=True)


def _jit(function: Callable[P, R], **options: Any) -> Callable[P, R]:
    wrapped = numba.njit(cache=True, nogil=True, error_model="numpy", **options)(function)
    return cast(Callable[P, R], wrapped)
