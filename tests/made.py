"""What several tests need and what takes long to make, made once: kept on disk, for both workers.

A result is filed by the code of the packages, the cards, the file whose function makes it, and what
that function was asked. So it is made anew where any of these changes, and never otherwise.
"""

import copyreg
import fcntl
import hashlib
import inspect
import pickle
import shutil
import sys
from collections.abc import Callable
from dataclasses import fields
from functools import cache, wraps
from pathlib import Path
from types import MappingProxyType
from typing import Any, ParamSpec, TypeVar

from identification.effects._base import Effect

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "build" / "made-by-tests"
CODE = ("identification", "design", "workbench", "datasets")

Asked = ParamSpec("Asked")
Made = TypeVar("Made")


def _read_only(of: dict[Any, Any]) -> MappingProxyType[Any, Any]:
    return MappingProxyType(of)


copyreg.pickle(MappingProxyType, lambda one: (_read_only, (dict(one),)))
# Without what it has compiled, which is of this process.
copyreg.pickle(Effect, lambda one: (Effect, tuple(getattr(one, f.name) for f in fields(one))))


@cache
def code() -> bytes:
    """Digest of everything in the packages and the cards that a result hangs on."""
    found = hashlib.sha256(sys.version.encode())
    for folder in CODE:
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix in (".py", ".toml", ".csv"):
                found.update(path.relative_to(ROOT).as_posix().encode() + path.read_bytes())
    return found.digest()


def made_once(function: Callable[Asked, Made]) -> Callable[Asked, Made]:
    """The function, called once for the same arguments over all workers and runs of this code.

    What it gives has to be a value: each process gets its own copy, and the same one at each call.
    Arguments are told apart by their `repr`.
    """
    source = Path(inspect.getfile(function)).read_bytes()
    known: dict[str, Made] = {}

    @wraps(function)
    def kept(*given: Asked.args, **named: Asked.kwargs) -> Made:
        asked = repr((function.__qualname__, given, sorted(named.items())))
        key = hashlib.sha256(code() + source + asked.encode()).hexdigest()
        if key not in known:
            known[key] = _filed(key, lambda: function(*given, **named))
        return known[key]

    return kept


@cache
def _folder() -> Path:
    """Where the results of this code lie; those of other code go."""
    own = FOLDER / code().hex()[:16]
    own.mkdir(parents=True, exist_ok=True)
    for other in FOLDER.iterdir():
        if other != own:
            shutil.rmtree(other, ignore_errors=True)
    return own


def _filed(key: str, make: Callable[[], Made]) -> Made:
    """The result on file, made and filed where there is none; another worker waits meanwhile."""
    path = _folder() / f"{key}.pickle"
    with path.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if path.exists():
            found: Made = pickle.loads(path.read_bytes())
            return found
        result = make()
        part = path.with_suffix(".part")
        part.write_bytes(pickle.dumps(result))
        part.replace(path)
        return result
