"""The one place where numba is called: typed decorators for compiled kernels."""

import hashlib
import linecache
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import CodeType, FunctionType, ModuleType
from typing import Any, ParamSpec, TypeVar, cast

import numba
import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba.core import event
from numba.core.ccallback import CFunc
from numba.extending import intrinsic

from identification.errors import BadModel

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

# Fused multiply-add is allowed (it rounds less); reordering and NaN-blind forms are not.
CONTRACT = {"contract"}


def compiled(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """`function` compiled on first call, cached on disk, run without the interpreter's lock."""
    return _jit(function, fastmath=CONTRACT)


def compiled_fast(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """As `compiled`, with reordered sums: for reductions whose rounding is of no account."""
    return _jit(function, fastmath=True)


def compiled_exact(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """As `compiled_inline`, each operation rounded by itself and in the written order: what a
    controller's code has to do in any language, bit for bit."""
    return _jit(function, fastmath=False, forceinline=True)


def compiled_inline(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """As `compiled`, always inlined into its caller (for the innermost vector loops)."""
    return _jit(function, fastmath=CONTRACT, forceinline=True)


def _jit(function: Callable[Arguments, Result], **options: Any) -> Callable[Arguments, Result]:
    wrapped: Any = numba.njit(cache=True, nogil=True, error_model="numpy", **options)(function)
    _follow_sources(wrapped._cache, function)
    return cast(Callable[Arguments, Result], wrapped)


class _Compiling(event.Listener):
    """Reports when the first of the kernels under compilation begins, and when the last ends."""

    def __init__(self, report: Callable[[bool], None]) -> None:
        self._report, self._depth = report, 0

    def on_start(self, event: Any) -> None:
        self._depth += 1
        if self._depth == 1:
            self._report(True)

    def on_end(self, event: Any) -> None:
        self._depth -= 1
        if self._depth == 0:
            self._report(False)


@contextmanager
def while_compiling(report: Callable[[bool], None]) -> Iterator[None]:
    """Within the block, `report` is called whenever kernels that are in no cache begin to be
    compiled (True), and when they have been (False)."""
    with event.install_listener("numba:compile", _Compiling(report)):
        yield


DOUBLES = 9  # arguments of an effect's kernel before its signals and parameters
_TYPES: Any = numba.types
_POINTER = _TYPES.CPointer(_TYPES.float64)


def kernel_pointer(function: Callable[..., float], name: str, step: bool) -> Any:
    """An effect's kernel behind an address, compiled once and cached on disk.

    step: the kernel takes dt before its other arguments. Raises BadModel where it does not
    compile; `name` says whose kernel it is.
    """
    arguments = (*[_TYPES.float64] * (DOUBLES + int(step)), _POINTER, _POINTER)
    made: Any = CFunc(function, (arguments, _TYPES.float64), {}, {"error_model": "numpy"})
    made.enable_caching()
    _follow_sources(made._cache, function)
    try:
        made.compile()
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


def _follow_sources(cache: Any, function: Callable[..., Any]) -> None:
    """Let a kernel's cache on disk count only while all that the kernel is made of is the same.

    Numba looks at the kernel's own file only; what it calls or names may have changed in another.
    """
    index = cache._cache_file
    index._source_stamp = _Stamp(index._source_stamp, function)


class _Stamp:
    """The sources of a kernel, hashed when its cache is looked at: its module is complete then.

    In the cache's index it is the hash as a text.
    """

    def __init__(self, own: object, function: Callable[..., Any]) -> None:
        self._own, self._function, self._text = own, function, ""

    def __str__(self) -> str:
        if not self._text:
            parts = list(_made_of(self._function, set()))
            whole = repr((self._own, _text_of(_jit), parts))
            self._text = hashlib.sha256(whole.encode()).hexdigest()
        return self._text

    def __eq__(self, other: object) -> bool:
        return str(self) == other

    def __hash__(self) -> int:
        return hash(str(self))

    def __reduce__(self) -> tuple[type[str], tuple[str]]:
        return str, (str(self),)


def _made_of(kernel: Any, seen: set[object]) -> Iterator[str]:
    """Sources of the kernels, and values of the constants, that a kernel reaches by name."""
    function = getattr(kernel, "py_func", getattr(kernel, "_defn", kernel))
    if function in seen:
        return
    seen.add(function)
    yield _text_of(function)
    names = frozenset(_names_in(function.__code__))
    enclosed = [cell.cell_contents for cell in function.__closure__ or ()]
    for value in (*function.__annotations__.values(), *enclosed):
        yield from _meant_by("", value, names, seen)
    for name in sorted(names & function.__globals__.keys()):
        yield from _meant_by(name, function.__globals__[name], names, seen)


def _meant_by(name: str, value: Any, names: frozenset[str], seen: set[object]) -> Iterator[str]:
    """What a name in a kernel stands for; `names`: what may be asked of it where it is a module."""
    if hasattr(value, "py_func") or hasattr(value, "_defn"):
        yield from _made_of(value, seen)
    elif isinstance(value, ModuleType):
        if (value, names) not in seen:
            seen.add((value, names))
            for one in sorted(names & vars(value).keys()):
                yield from _meant_by(one, vars(value)[one], names, seen)
    elif isinstance(value, tuple):
        for one in value:
            yield from _meant_by(name, one, names, seen)
    elif isinstance(value, type):
        yield f"{value.__qualname__} {getattr(value, '_fields', ())}"
    elif isinstance(value, np.ndarray):
        yield f"{name} = {value.dtype} {value.shape} {value.tobytes().hex()}"
    elif isinstance(value, int | float | complex | str | bytes | np.generic):
        yield f"{name} = {value!r}"


def _names_in(code: CodeType) -> Iterator[str]:
    """Names that a function and the functions inside it use."""
    yield from code.co_names
    for one in code.co_consts:
        if isinstance(one, CodeType):
            yield from _names_in(one)


def _text_of(function: FunctionType | Callable[..., Any]) -> str:
    """The text of the file in which a function stands."""
    return "".join(linecache.getlines(function.__code__.co_filename, function.__globals__))
