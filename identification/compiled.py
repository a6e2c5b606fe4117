"""The one place where numba is called: typed decorators for compiled kernels."""

import hashlib
from collections.abc import Callable
from functools import lru_cache
from importlib.resources import files
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
    wrapped: Any = numba.njit(cache=True, nogil=True, error_model="numpy", **options)(function)
    # Numba looks at the kernel's own file only; a kernel it calls may have changed in another.
    index = wrapped._cache._cache_file
    index._source_stamp = (index._source_stamp, _sources(function.__module__.partition(".")[0]))
    return cast(Callable[P, R], wrapped)


@lru_cache
def _sources(package: str) -> str:
    """Hash of the sources whose kernels may call each other: this package's and the caller's."""
    digest = hashlib.sha256()
    for name in sorted({"identification", package}):
        try:
            modules = sorted(files(name).iterdir(), key=lambda entry: entry.name)
        except (ModuleNotFoundError, TypeError):
            continue
        for entry in modules:
            if entry.name.endswith(".py"):
                digest.update(entry.read_bytes())
    return digest.hexdigest()
