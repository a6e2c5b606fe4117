"""A validation as tables and lines, for a terminal and a report."""

from pathlib import Path
from typing import TYPE_CHECKING

from workbench.cards.parameter_units import Shown, shown
from workbench.output import Row, table, written
from workbench.steps.validate import COMPENSATED, LoopFigures, Validation

if TYPE_CHECKING:
    from rich.console import Group

VALIDATION_HEAD = (
    "loop",
    "on",
    "passes",
    "modulus margin",
    "delay margin",
    "standstill error",
    "overshoot",
    "settling",
    "smooth error",
    "peak force",
    "limit cycle",
)


def validation_rows(found: Validation, rotary: bool = False) -> list[Row]:
    """One row a controller and plant, by `VALIDATION_HEAD`."""
    return [
        (_shown(name), place, *_row(one, shown(rotary)))
        for name, places in found.figures.items()
        for place, one in places.items()
    ]


def _shown(name: str) -> str:
    """A loop's name as a narrow column takes it."""
    alone = name.removesuffix(COMPENSATED)
    return alone.upper() if alone == name else f"{alone.upper()} + comp"


def _row(one: LoopFigures, units: Shown) -> Row:
    m = one.margins
    delay = "-"
    if m:
        delay = "any" if m.delay_samples is None else f"{m.delay_samples:.2g} h"
    cycle = "none"
    if one.limit_cycle:
        cycle = (
            f"{one.limit_cycle.amplitude:.2g} {units.position} every {one.limit_cycle.period:.2g} s"
        )
    return (
        "yes" if one.passed else "no",
        f"{m.modulus:.3f}" if m else "unstable",
        delay,
        f"{100 * one.standstill_relative:.3g} %" if one.stable else "-",
        f"{100 * one.overshoot:.3g} %" if one.stable else "-",
        f"{one.settling:.3g} s" if one.stable else "-",
        f"{100 * one.smooth_relative:.3g} %" if one.stable else "-",
        f"{one.force_peak:.4g} {units.force}" if one.stable else "-",
        cycle if one.stable else "-",
    )


def validation_lines(found: Validation, rotary: bool = False) -> list[str]:
    """What fails and what to know, in words."""
    alone = [name for name in found.figures if not name.endswith(COMPENSATED)]
    lines = [line for name in alone for line in _missed(found, name)]
    first = next(iter(found.figures[found.judged].values()))
    unit = shown(rotary).position
    lines.append(
        f"steps of {first.step:.3g} {unit}; standstill and overshoot are relative to the step"
    )
    return [*lines, *(f"note: {line}" for line in found.remarks)]


def missed(found: Validation) -> str | None:
    """Why the judged controller does not pass, in one line; None where it does."""
    return None if found.passed else "; ".join(_missed(found, found.judged))


def _missed(found: Validation, name: str) -> list[str]:
    return [
        f"{name.upper()} on the {place}: {limit}"
        for place, one in found.figures[name].items()
        for limit in one.missed
    ]


def validation_verdict(found: Validation) -> str:
    """Whether the judged controller passed, in one line."""
    word = "passes" if found.passed else "fails"
    return f"{found.judged.upper()} {word} in simulation"


def validation_view(found: Validation, folder: Path | None, rotary: bool = False) -> "Group":
    """The validation for a terminal."""
    from rich.console import Group

    return Group(
        validation_verdict(found),
        table(VALIDATION_HEAD, validation_rows(found, rotary)),
        *validation_lines(found, rotary),
        *([] if folder is None else [written(folder, "validation.json", "report.html")]),
    )
