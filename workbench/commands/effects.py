"""`workbench effects`: the library of effects, and a user's own file checked as they are."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from workbench import options
from workbench.output import emit, progress, step
from workbench.signature import argument

if TYPE_CHECKING:
    from identification.effects._base import Effect
    from workbench.screen import Screen


@click.group(cls=options.StatusGroup, epilog="Example: workbench effects list")
def command() -> None:
    """Show the effects that 'workbench trace' knows, and check files of your own.

    Every subcommand takes --json.
    """


@options.command(command, "list", epilog="Example: workbench effects list stribeck")
def list_effects(
    keys: tuple[str, ...] = argument("[KEY]..."),
    effects: tuple[Path, ...] = options.EFFECTS_OPTION,
) -> None:
    """List the effects, a line each; with --verbose equation, parameters with units, source.

    KEY: those to be shown, with all of this; by default every effect.
    """
    from design.machine.effect_values import known_effect
    from workbench.cards.own_effects import library
    from workbench.interface.effects import described

    known = library(effects)
    found = [known_effect(key, known) for key in keys] if keys else list(known.values())
    emit([described(one) for one in found], lambda: _listed(found, [*known.values()]))


@options.command(
    command, refusal="an effect breaks a rule", epilog="Example: workbench effects check my_effects"
)
def check(folder: Path = argument()) -> int:
    """Check your own effects by the rules that the shipped ones are held to.

    FOLDER holds one effect a file, declared as EFFECT ('python -c "import
    workbench.cards.own_effects as o; print(o.__doc__)"' shows one). Its Python is run: check only
    files that you trust.
    """
    from workbench.interface.effects import check_effects

    with progress("checking", 1.0) as advance:
        result = check_effects(folder, advance)
    broken = {key: one["broken"] for key, one in result["effects"].items()}
    wrong = any(broken.values())
    then = step("once the files are mended", "effects", "check", folder) if wrong else None
    emit(result, lambda: _checked(broken, len(result["checks"])), then)
    return 1 if wrong else 0


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
    return "\n".join(
        line
        for key, found in broken.items()
        for line in [f"{key}: not so: {name}: {said}" for name, said in found.items()]
        or [f"{key}: holds to all {count} checks"]
    )
