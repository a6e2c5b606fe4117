"""The library of effects and checks of one's own, as `workbench effects` shows them."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from design.machine.effect_values import known_effect
from identification.effects._base import Effect
from workbench.interface.inputs import PathLike, effects_of


def effects(*keys: str, folders: Iterable[PathLike] = ()) -> Sequence[Mapping[str, Any]]:
    """What each effect declares: equation, parameters with units, source; all without `keys`.

    As `workbench effects list --json`. folders: of your own effects, whose Python is run. Raises
    BadModel where a key is unknown, or a file declares none.
    """
    known = effects_of(folders)
    return [described(known_effect(key, known)) for key in keys or known]


def described(effect: Effect) -> dict[str, Any]:
    """An effect as JSON has it."""
    of_each = ("name", "unit", "low", "high", "typical", "default", "meaning")
    return {
        **{key: getattr(effect, key) for key in ("key", "meaning", "equation", "acts")},
        "gives": effect.place.gives,
        **{key: getattr(effect, key) for key in ("depends_on", "signals", "state_unit")},
        "parameters": [{key: getattr(p, key) for key in of_each} for p in effect.params],
        "source": effect.source,
    }


def check_effects(
    folder: PathLike, advance: Callable[[float], None] = lambda _share: None
) -> Mapping[str, Any]:
    """Which rules your own effects keep, as `workbench effects check --json`.

    folder: one effect a file, whose Python is run. The result has `effects`, by key whether it
    `holds` and what is `broken`, and the names of the `checks`. advance: takes shares of the whole.
    """
    from identification.effects._library import built_in
    from workbench.cards.effect_checks import CHECKS, failures

    own = {key: one for key, one in effects_of(folder).items() if key not in built_in()}
    found = {}
    for key, one in own.items():
        broken = dict(failures(one))
        found[key] = {"holds": not broken, "broken": broken}
        advance(1.0 / len(own))
    return {"effects": found, "checks": list(CHECKS)}
