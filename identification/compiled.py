"""The one place where numba is called: typed decorators for compiled kernels."""

import hashlib
from collections.abc import Callable
from functools import lru_cache
from importlib.resources import files
from typing import Any, ParamSpec, TypeVar, cast

import numba
from llvmlite import ir  # type: ignore[import-untyped]
from numba.extending import intrinsic

from identification.errors import BadModel

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


DOUBLES = 9  # arguments of an effect's kernel before its signals and parameters
_TYPES: Any = numba.types
_POINTER = _TYPES.CPointer(_TYPES.float64)


def kernel_pointer(function: Callable[..., float], name: str, step: bool) -> Any:
    """An effect's kernel behind an address, compiled once and cached on disk.

    step: the kernel takes dt before its other arguments. Raises BadModel where it does not
    compile; `name` says whose kernel it is.
    """
    doubles = [numba.types.float64] * (DOUBLES + int(step))
    signature = numba.types.float64(*doubles, _POINTER, _POINTER)
    try:
        made: Any = numba.cfunc(signature, cache=True, error_model="numpy")(function)
    except numba.core.errors.NumbaError as fault:
        first = next((line.strip() for line in str(fault).splitlines() if line.strip()), "")
        raise BadModel(
            f"effect {name!r}: {function.__name__} does not compile ({first}); write it with"
            " numbers, numpy's scalar functions and p[i], s[i] only"
        ) from fault
    return made


def _call(doubles: int) -> Any:
    """An intrinsic that calls a kernel by its address: a new effect costs no new compilation."""

    def typed(_context: Any, address: Any, a: Any, s: Any, p: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            double, pointer = ir.DoubleType(), ir.DoubleType().as_pointer()
            shape = ir.FunctionType(double, [double] * doubles + [pointer, pointer])
            kernel = builder.inttoptr(args[0], shape.as_pointer())
            values = [builder.extract_value(args[1], i) for i in range(doubles)]
            places = [builder.inttoptr(one, pointer) for one in args[2:]]
            return builder.call(kernel, values + places)

        at = numba.types.int64
        many = _TYPES.UniTuple(_TYPES.float64, doubles)
        return numba.types.float64(at, many, at, at), generate

    return intrinsic(typed)


# Called as (address, (t, y, v, F, u, d, z, c, f), address of s, address of p); call_evolve has dt
# before t.
call_value = _call(DOUBLES)
call_evolve = _call(DOUBLES + 1)


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
