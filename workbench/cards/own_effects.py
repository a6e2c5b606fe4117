'''Effects that do not ship: a user's own files, and those of installed packages.

A file of a folder given by `--effects FOLDER` holds one effect, declared as EFFECT; a file whose
name begins with "_" is left alone. Its Python is run, so only folders that one trusts are given.
All that the shipped effects can do it can too:

    """A magnet at the end of the stroke."""

    import math

    from identification.effects._base import Effect, Param


    def value(t, y, v, F, u, d, z, c, f, s, p):
        """F_m exp(-y/reach)."""
        return p[0] * math.exp(-y / p[1])


    EFFECT = Effect(
        key="magnet",
        meaning="a magnet at the end of the stroke",
        equation="F_m*exp(-y/reach)",
        source="measured on our bench, 2026",
        acts="force",
        params=(
            Param("F_m", "N", 0.0, 1e3, 5.0, "its pull at y = 0", linear=True),
            Param("reach", "m", 1e-3, 1.0, 0.02, "where 37 % of it is left"),
        ),
        value=value,
        depends_on=("y",),
    )

`identification/effects/_base.py` says what every field means. The kernel is compiled: numbers,
`math`, p[i] and s[i] only. A recipe then may say `[recipe.effects.magnet] F_m = "8 N"`, and

    workbench simulate card.toml --effects my_effects

simulates it. An installed package declares its effects as entry points of the group
"workbench.effects", each an Effect or a module with EFFECT; they need no option.
'''

import hashlib
import importlib.util
import re
import sys
import tempfile
import traceback
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from importlib.machinery import SourceFileLoader
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

import numba

from identification.effects._base import Effect
from identification.effects._library import Library, built_in, declared, joined_library
from identification.errors import BadModel, UserError
from workbench.files import broken_link, refuse_special

GROUP = "workbench.effects"
_LINE = re.compile(r'File "[^"]*", line (\d+)')
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")


def library(folders: Iterable[Path] = ()) -> Library:
    """The shipped effects, those of installed packages, and those in the files of `folders`.

    Raises BadModel, in one line with file, line and cause, where one does not load, declares no
    effect, does not compile, or bears a key that is taken.
    """
    found, origin = built_in(), dict.fromkeys(built_in(), "an effect that ships")
    for point in sorted(entry_points(group=GROUP), key=lambda one: one.name):
        where = f"entry point {point.name!r} of {point.dist.name if point.dist else 'a package'}"
        found = _with(found, origin, _of_package(point, where), where)
    for path in _files(folders):
        found = _with(found, origin, load_effect(path), str(path))
    return found


class _FreshSource(SourceFileLoader):
    """Compiles the source each time.

    Python's cached bytecode is taken for current where the file's size and its second are the
    same: a sign changed within a second would not count.
    """

    def get_code(self, fullname: str) -> CodeType:
        path = self.get_filename(fullname)
        return compile(self.get_data(path), path, "exec", dont_inherit=True)


def load_effect(path: Path) -> Effect:
    """The effect that the file declares, compiled; raises BadModel as `library`."""
    refuse_special(path, BadModel)
    name = f"workbench_effects_{hashlib.sha256(str(path).encode()).hexdigest()[:12]}_{path.stem}"
    loader = _FreshSource(name, str(path))
    spec = importlib.util.spec_from_file_location(name, path, loader=loader)
    if spec is None:
        raise BadModel(f"{path}: is no Python file; give a folder of files that declare EFFECT")
    module = importlib.util.module_from_spec(spec)
    # Numba looks a cached kernel's module up by this name, in this process and in the next.
    sys.modules[name] = module
    try:
        loader.exec_module(module)
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        raise BadModel(f"{path}{_line_of(error, path)}: {_cause(error)}; correct it") from error
    return _compiled(declared(module), str(path))


def _with(found: Library, origin: dict[str, str], effect: Effect, where: str) -> Library:
    """The library with one effect more."""
    if effect.key in found:
        raise BadModel(
            f"{where}: its key {effect.key!r} is taken by {origin[effect.key]}; rename one"
        )
    origin[effect.key] = where
    return joined_library([effect], found)


def _of_package(point: EntryPoint, where: str) -> Effect:
    try:
        loaded = point.load()
        if isinstance(loaded, ModuleType):
            loaded = declared(loaded)
    except UserError as error:
        raise BadModel(f"{where}: {error}") from error
    except Exception as error:
        raise BadModel(f"{where}: {_cause(error)}; correct or uninstall it") from error
    if not isinstance(loaded, Effect):
        raise BadModel(f"{where}: is {type(loaded).__name__}, an Effect needed; correct it")
    return _compiled(loaded, where)


def _files(folders: Iterable[Path]) -> Sequence[Path]:
    """The effects' files of the folders, each once, by folder and name."""
    out: dict[Path, None] = {}
    for folder in folders:
        if not folder.is_dir():
            what = "is a file" if folder.exists() else "no such folder"
            raise BadModel(f"{folder}: {what}; give the folder that holds your effects' files")
        paths = sorted(path for path in folder.glob("*.py") if not path.name.startswith("_"))
        if not paths:
            raise BadModel(f"{folder}: no effect in it; put files into it that declare EFFECT")
        for path in paths:
            broken = broken_link(path)
            if broken:
                raise BadModel(f"{path}: {broken}")
            out[path.resolve()] = None
    return list(out)


def _compiled(effect: Effect, where: str) -> Effect:
    """The effect with its kernels compiled; where no folder takes their cache, without one."""
    try:
        try:
            _ = effect.pointers
        except RuntimeError:  # neither the file's folder nor the user's own takes a cache
            with tempfile.TemporaryDirectory() as folder, _cache_in(folder):
                _ = effect.pointers
    except Exception as error:  # the compiler raises what it meets, of any kind
        line, cause = _compiler_says(error, effect)
        raise BadModel(
            f"{where}, line {line}: effect {effect.key!r} does not compile ({cause}); write its"
            " kernels with eleven arguments (evolve: dt first), numbers, math, p[i] and s[i] only"
        ) from error
    return effect


@contextmanager
def _cache_in(folder: str) -> Iterator[None]:
    """Compiled kernels are cached in `folder` meanwhile."""
    settings: Any = numba.config
    usual, settings.CACHE_DIR = settings.CACHE_DIR, folder
    try:
        yield
    finally:
        settings.CACHE_DIR = usual


def _compiler_says(error: Exception, effect: Effect) -> tuple[int, str]:
    """Line and cause of a kernel that does not compile; the line of `value` where none is said."""
    found = error.__cause__ if isinstance(error, BadModel) and error.__cause__ else error
    text = _COLOUR.sub("", str(found))
    said = _LINE.findall(text)
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    cause = next((line for line in lines if not line.startswith("Failed in")), "no reason given")
    return int(said[-1]) if said else effect.value.__code__.co_firstlineno, cause[:120]


def _line_of(error: BaseException, path: Path) -> str:
    """Where in the file the error is, as ", line N"; nothing where that is not known."""
    if isinstance(error, SyntaxError) and error.filename == str(path):
        return f", line {error.lineno}"
    frames = traceback.extract_tb(error.__traceback__)
    lines = [frame.lineno for frame in frames if frame.filename == str(path)]
    return f", line {lines[-1]}" if lines else ""


def _cause(error: BaseException) -> str:
    """What went wrong, in one line."""
    text = " ".join(str(error.msg if isinstance(error, SyntaxError) else error).split())
    if isinstance(error, UserError):
        return text
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
