"""The library of effects and checks of one's own, as `workbench effects` shows them."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from workbench.cards.effect_values import known_effect
from workbench.cards.own_effects import library
from workbench.commands.effects import checked, described
from workbench.interface.inputs import PathLike


def effects(*keys: str, folders: Iterable[PathLike] = ()) -> Sequence[Mapping[str, Any]]:
    """What each effect declares: equation, parameters with units, source; all without `keys`.

    As `workbench effects list --json`. folders: of your own effects, whose Python is run. Raises
    BadModel where a key is unknown, or a file declares none.
    """
    known = library([Path(one) for one in folders])
    return [described(known_effect(key, known)) for key in keys or known]


def check_effects(folder: PathLike) -> Mapping[str, Any]:
    """Which rules your own effects keep, as `workbench effects check --json`.

    folder: one effect a file, whose Python is run. The result has `effects`, by key whether it
    `holds` and what is `broken`, and the names of the `checks`.
    """
    return checked(Path(folder), lambda _share: None)
