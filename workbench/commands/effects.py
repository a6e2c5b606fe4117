"""`workbench effects`: the library of effects, and a user's own file checked as they are."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from workbench import options
from workbench.ending import StatusGroup, step
from workbench.output import JSON_OPTION, emit, progress
from workbench.signature import argument, by_signature

if TYPE_CHECKING:
    from identification.effects._base import Effect
    from workbench.screen import Screen


@click.group(cls=StatusGroup, epilog="Example: workbench effects list")
def command() -> None:
    """Show the effects that 'workbench trace' knows, and check files of your own.

    Every subcommand takes --json.
    """


@command.command("list", epilog="Example: workbench effects list stribeck")
@by_signature
def list_effects(
    keys: tuple[str, ...] = argument("[KEY]..."),
    effects: tuple[Path, ...] = options.EFFECTS_OPTION,
    as_json: bool = JSON_OPTION,
) -> None:
    """List the effects, a line each; with --verbose equation, parameters with units, source.

    KEY: those to be shown, with all of this; by default every effect.
    """
    from workbench.cards.effect_values import known_effect
    from workbench.cards.own_effects import library

    known = library(effects)
    found = [known_effect(key, known) for key in keys] if keys else list(known.values())
    emit([described(one) for one in found], as_json, lambda: _listed(found, [*known.values()]))


@command.command(
    refusal="an effect breaks a rule", epilog="Example: workbench effects check my_effects"
)
@by_signature
def check(folder: Path = argument(), as_json: bool = JSON_OPTION) -> int:
    """Check your own effects by the rules that the shipped ones are held to.

    FOLDER holds one effect a file, declared as EFFECT ('python -c "import
    workbench.cards.own_effects as o; print(o.__doc__)"' shows one). Its Python is run: check only
    files that you trust.
    """
    with progress("checking", 1.0, as_json=as_json) as advance:
        result = checked(folder, advance)
    broken = {key: one["broken"] for key, one in result["effects"].items()}
    wrong = any(broken.values())
    then = step("once the files are mended", "effects", "check", folder) if wrong else None
    emit(result, as_json, lambda: _checked(broken, len(result["checks"])), then)
    return 1 if wrong else 0


def checked(folder: Path, advance: Callable[[float], None]) -> dict[str, Any]:
    """Which rules the folder's effects keep, by key; advance takes shares of the whole."""
    from identification.effects._library import built_in
    from workbench.cards.effect_runs import CHECKS, failures
    from workbench.cards.own_effects import library

    own = {key: one for key, one in library([folder]).items() if key not in built_in()}
    found = {}
    for key, one in own.items():
        broken = dict(failures(one))
        found[key] = {"holds": not broken, "broken": broken}
        advance(1.0 / len(own))
    return {"effects": found, "checks": list(CHECKS)}


def described(effect: "Effect") -> dict[str, Any]:
    """An effect as JSON has it."""
    of_each = ("name", "unit", "low", "high", "typical", "default", "meaning")
    return {
        **{key: getattr(effect, key) for key in ("key", "meaning", "equation", "acts")},
        "gives": effect.place.gives,
        **{key: getattr(effect, key) for key in ("depends_on", "signals", "state_unit")},
        "parameters": [{key: getattr(p, key) for key in of_each} for p in effect.params],
        "source": effect.source,
    }


def _listed(found: "Sequence[Effect]", known: "Sequence[Effect]") -> "Screen":
    """A line an effect; each one as a paragraph where it was asked for by name."""
    from workbench.screen import instead, listed, screen

    every = [line for one in found for line in (*paragraph(one), "")][:-1]
    if len(found) < len(known):
        return screen(listed(every))
    short = [f"{one.key}: {one.meaning}" for one in found]
    then = "next: workbench effects list KEY shows its equation, parameters and source"
    return screen(instead(short, every), instead([then], []))


def paragraph(one: "Effect") -> list[str]:
    """An effect in lines: equation, what it gives, parameters with units, source."""
    lines = [f"{one.equation}", f"gives the {one.place.gives}"]
    for p in one.params:
        usual = f"{p.typical:g}" if p.default is None else f"{p.default:g} unless given"
        lines.append(f"{p.name} [{p.unit}]: {p.meaning} ({usual})")
    lines.append(f"source: {one.source}")
    return [f"{one.key}: {one.meaning}", *(f"    {line}" for line in lines)]


def _checked(broken: Mapping[str, Mapping[str, str]], count: int) -> str:
    lines = []
    for key, found in broken.items():
        if not found:
            lines.append(f"{key}: holds to all {count} checks")
        lines += [f"{key}: not so: {name}: {said}" for name, said in found.items()]
    return "\n".join(lines)
