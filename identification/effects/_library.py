"""The effects by key: every module of `identification.effects` that does not begin with `_`."""

import importlib
import pkgutil
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cache
from types import MappingProxyType, ModuleType

from identification import effects
from identification.effects._base import Effect
from identification.errors import BadModel

Library = Mapping[str, Effect]


@cache
def built_in() -> Library:
    """The effects that ship with the package."""
    names = sorted(m.name for m in pkgutil.iter_modules(effects.__path__) if m.name[0] != "_")
    return joined_library(
        declared(importlib.import_module(f"{effects.__name__}.{n}")) for n in names
    )


def declared(module: ModuleType) -> Effect:
    """The effect that a module declares as EFFECT; raises BadModel where it does not."""
    effect = getattr(module, "EFFECT", None)
    if not isinstance(effect, Effect):
        raise BadModel(
            f"{module.__file__}: no EFFECT of type identification.effects._base.Effect in it;"
            " declare one, or begin the file's name with '_'"
        )
    return effect


def numbered(effect: Effect, number: int) -> Effect:
    """The effect once more in the same machine, as KEY_2, KEY_3; the first by its own key."""
    return effect if number == 1 else replace(effect, key=f"{effect.key}_{number}")


def of_key(key: str, library: Library) -> Effect | None:
    """The effect of that key, numbered ones too; None where there is none."""
    name, _, number = key.rpartition("_")
    if key in library or name not in library or not (number.isdigit() and int(number) > 1):
        return library.get(key)
    return numbered(library[name], int(number))


def joined_library(found: Iterable[Effect], to: Library | None = None) -> Library:
    """These effects by key, after those of `to`; raises BadModel where a key is taken."""
    library = dict(to or {})
    for effect in found:
        if effect.key in library:
            raise BadModel(f"two effects with the key {effect.key!r}; rename one")
        library[effect.key] = effect
    return MappingProxyType(library)
