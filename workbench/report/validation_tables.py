"""A validation as tables and lines, for a terminal and a report."""

from workbench.cards.parameter_units import Shown, shown
from workbench.cards.readable import length
from workbench.output import Row
from workbench.report.view import notes
from workbench.screen import Part, listed, more, tabled
from workbench.steps.loop_figures import COMPENSATED, PRESENT, SCHEDULED, LoopFigures
from workbench.steps.recommend import (
    in_thousandths,
    other_figures,
    own_figures,
    percent,
    settling_words,
)
from workbench.steps.validate import Validation


def validation_table(found: Validation, rotary: bool = False) -> Part:
    """A row a controller and plant."""
    alone = len(found.figures[found.judged]) == 1
    rows = [
        (_shown(name), *(() if alone else (place,)), *_row(one, shown(rotary)))
        for name, places in found.figures.items()
        for place, one in places.items()
    ]
    return tabled(_head(found, rotary), rows, right=())


def _head(found: Validation, rotary: bool) -> tuple[str, ...]:
    units, one = shown(rotary), _any(found)
    where = ("on",) if len(found.figures[found.judged]) > 1 else ()
    command = () if one.command_peak is None else (f"command {one.command_unit}",)
    return (
        "loop",
        *where,
        "ok",
        "margin",
        "delay",
        "at rest",
        "over",
        "settling",
        "smooth",
        f"force {units.force}",
        *command,
        "limit cycle",
    )


def _any(found: Validation) -> LoopFigures:
    return next(iter(found.figures[found.judged].values()))


def _shown(name: str) -> str:
    """A loop's name as a narrow column takes it."""
    alone = name.removesuffix(COMPENSATED)
    if alone == PRESENT:
        return PRESENT
    if name.endswith(SCHEDULED):
        return f"{name.removesuffix(SCHEDULED).upper()}+table"
    return alone.upper() if alone == name else f"{alone.upper()}+comp"


def _row(one: LoopFigures, units: Shown) -> Row:
    m, passes = one.margins, "yes" if one.passed else "no"
    modulus, delay = f"{m.modulus:.3f}" if m else "unstable", "-"
    command = () if one.command_peak is None else (_command(one),)
    if m:
        delay = "any" if m.delay_samples is None else f"{m.delay_samples:.2g}"
    if not one.stable:
        return (passes, modulus, delay, *["-"] * (6 + len(command)))
    return (
        passes,
        modulus,
        delay,
        percent(one.standstill_relative),
        percent(max(one.overshoot, 0.0)),
        settling_words(one),
        percent(one.smooth_relative),
        f"{one.force_peak:.3g}",
        *command,
        _cycle(one, units),
    )


def _command(one: LoopFigures) -> str:
    """Largest command, and for how long it is at its limit."""
    return f"{one.command_peak:.3g}{f' ({100 * one.limited:.1g} %)' if one.limited else ''}"


def _cycle(one: LoopFigures, units: Shown) -> str:
    if not one.limit_cycle:
        return "none"
    size, unit = in_thousandths(one.limit_cycle.amplitude, units)
    return f"{size:.2g} {unit}, {one.limit_cycle.period:.2g} s"


def validation_lines(found: Validation, rotary: bool = False) -> list[str]:
    """What fails and what to know, in words."""
    alone = [name for name in found.figures if not name.endswith(COMPENSATED)]
    others = other_figures(found.why)
    lines = [others] if others else []
    lines += [line for name in alone for line in _missed(found, name)]
    lines.append(columns_line(found, rotary))
    return [*lines, *(f"note: {line}" for line in found.remarks)]


def columns_line(found: Validation, rotary: bool = False) -> str:
    """What the columns of the table mean, and the limits of command and force."""
    one, units = _any(found), shown(rotary)
    limit = (
        "" if one.command_limit is None else f"; limit {one.command_limit:.4g} {one.command_unit}"
    )
    table = any(name.endswith(SCHEDULED) for name in found.figures)
    beside = "+comp: with the compensator" + ("; +table: with the gain schedule" if table else "")
    limit += "" if one.force_limit is None else f", {one.force_limit:.4g} {units.force}"
    return (
        f"steps of {length(one.step, rotary)}; at rest, over (overshoot): error relative to the"
        " step; smooth: to the amplitude of the smooth reference; margin: modulus margin; delay:"
        f" delay margin in sampling periods; {beside}{limit}"
    )


def missed(found: Validation) -> str | None:
    """Why the tested controller does not pass, in one line; None where it does."""
    return None if found.passed else "; ".join(_missed(found, found.judged))


def _missed(found: Validation, name: str) -> list[str]:
    return [
        f"{name if name == PRESENT else name.upper()} on the {place}: {limit}"
        for place, one in found.figures[name].items()
        for limit in one.missed
    ]


def validation_verdict(found: Validation) -> str:
    """Whether the tested controller passed, in one line."""
    word = "passes" if found.passed else "fails"
    return f"{found.judged.upper()} {word} in simulation"


def validation_sentence(found: Validation) -> str:
    """Whether the tested controller passed and with which figures; what it misses."""
    said = validation_verdict(found)
    if not found.passed:
        return f"{said}: {missed(found)}."
    return f"{said}: {own_figures(found.why)}." if found.why else f"{said}."


def then_of_validation(found: Validation) -> list[str]:
    """What to do next with a design that was checked."""
    if found.passed:
        return ["`workbench export DESIGN --to c` writes it as code for the drive"]
    return ["`workbench design MODEL --poles W_N,ZETA` with slower poles, and validate again"]


def validation_parts(found: Validation, rotary: bool = False) -> list[Part | str]:
    """The figures of each loop; what controllers miss that are not tested, with --verbose."""
    others = other_figures(found.why)
    alone = [name for name in found.figures if not name.endswith(COMPENSATED)]
    return [
        validation_table(found, rotary),
        *([more(others)] if others else []),
        *(more(listed(_missed(found, name))) for name in alone),
        columns_line(found, rotary),
        notes(found.remarks),
    ]
