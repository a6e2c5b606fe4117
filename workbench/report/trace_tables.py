"""A trace in tables, for a terminal and for its report."""

import math
from collections.abc import Sequence
from dataclasses import replace

from identification.effects._base import Param
from identification.log import Rig
from identification.tracing.regression.significance import DRAWS
from identification.tracing.result import FoundEffect, Trace
from workbench.cards.parameter_units import shown
from workbench.cards.readable import as_shown, in_digits, number, shown_unit, small, units_of
from workbench.output import Row
from workbench.report.model_tables import estimate_cells, is_left_out, reasons_once
from workbench.report.trace_words import percent, words
from workbench.report.view import notes
from workbench.screen import Part, more, tabled
from workbench.steps.trace import Traced, effect_estimates

EFFECT_HEAD = ("effect", "value", "unit", "95 % interval", "meaning")
RIVAL_HEAD = ("rival", "force left", "why not")
SAME_HEAD = ("parameter", "value", "unit", "95 % interval")
CHANGE_HEAD = ("parameter", "before", "after", "unit", "95 % interval after", "change")
DRIFT_HEAD = ("parameter", "training", "test", "unit", "change")
FLOOR = 1.0 / (DRAWS + 1)  # least chance that draws can show


def errors_table(found: Trace, rotary: bool, tested: bool = True) -> Part:
    """Errors before and after, on training and held-out logs; not tested: on stretches left out."""
    test = "held out" if tested else "left out"
    head = ("error", "train before", "after", f"{test} before", "after", "sensors' noise")
    unit, position = shown(rotary).force, units_of(rotary).position
    errors = (
        ("force_rms", f"force, equation of motion [{unit}]", 1.0, found.noise_force),
        ("force_relative", "the same, of the applied force [%]", 100.0, None),
        ("position_rms", f"position, free run of 2 s [{position.name}]", position.factor,
         found.noise_y),
        ("actuator_rms", f"actuator equation [{unit}/s]", 1.0, found.noise_actuator),
    )  # fmt: skip
    columns = [one[where] for where in ("train", "test") for one in (found.before, found.after)]
    rows = list[Row]()
    for key, name, factor, floor in errors:
        values = [getattr(one, key) for one in columns]
        cells = ("-" if value is None else small(factor * value) for value in values)
        rows.append((name, *cells, "" if floor is None else small(factor * floor)))
    known = [row for row in rows if set(row[1:5]) != {"-"} and "%" not in row[0]]
    fell = [row for row in known if row[1] != row[2] or row[3] != row[4]]
    return tabled(head, fell or known, whole=rows)


def effects_table(found: Trace, rig: Rig, logs: Sequence[str] = ()) -> Part:
    """Every effect's parameters; of one effect alone a screen has room for what they mean."""
    rows: list[Row] = []
    for e in found.effects:
        estimates = effect_estimates(e, rig)
        for p in shown_params(e):
            value, unit, interval = estimate_cells(estimates[p.name], "")
            unit = "" if p.unit == "1" else unit
            rows.append((f"{words(e.effect.key)} {p.name}", value, unit, interval, p.meaning))
    once = effects_once(rows, found, logs)
    if len(found.effects) == 1:
        return tabled(EFFECT_HEAD, once, whole=rows)
    short = tabled(EFFECT_HEAD[:-1], [row[:-1] for row in once])
    return replace(short, whole=tuple(rows), whole_head=EFFECT_HEAD)


def shown_params(of: FoundEffect) -> list[Param]:
    """The parameters of an effect but for sizes that it does without."""
    return [p for p in of.effect.params if not is_left_out(p, of.params[p.name])]


def effects_once(rows: list[Row], found: Trace, logs: Sequence[str]) -> list[Row]:
    """The rows of `effects_table` for one screen: a row names the effect, those of its parameters
    follow."""
    out: list[Row] = []
    left = iter(rows)
    for e in found.effects:
        name = words(e.effect.key)
        own = [next(left) for _ in shown_params(e)]
        short = [(row[0].removeprefix(f"{name} "), *row[1:]) for row in own]
        out.append((f"{name}:", "", "", "", ""))
        if len(found.effects) > 1:  # their reasons would push other effects from the screen
            short = [row if row[1] != "-" else (*row[:3], "", row[4]) for row in short]
        out += [(f"  {row[0]}", *row[1:]) for row in reasons_once(short, logs)]
    return out


def effect_lines(found: Trace) -> list[str]:
    """Equation, source and worth of every effect, once for those of the same."""
    said = dict[str, list[str]]()
    for e in found.effects:
        line = (
            f"{e.effect.equation}; {e.effect.place.gives}. {_worth(e)}. Source: {e.effect.source}."
        )
        said.setdefault(line, []).append(words(e.effect.key))
    return [f"{', '.join(names)}: {line}" for line, names in said.items()]


def _worth(e: FoundEffect) -> str:
    chance = "p < 1e-4" if e.p_value < 1e-4 else f"p = {e.p_value:.2g}"
    if math.isclose(e.p_value, FLOOR):
        chance = f"p < {FLOOR:.1g}, none of {DRAWS} draws"
    share = f"{100 * e.explained:.3g} %"
    return f"It explains {share} of what was missing where it shows (by chance: {chance})"


def rivals_table(found: Trace, rotary: bool) -> Part:
    """Rivals in the order of the force error that they leave; last those that leave none."""
    unit = shown(rotary).force
    left = [(one.test_force_rms, one) for one in found.rivals]
    left.sort(key=lambda both: math.inf if both[0] is None else both[0])
    rows = [
        (words(one.key), "-" if rms is None else f"{number(rms)} {unit}", one.why_not)
        for rms, one in left
    ]
    return tabled(RIVAL_HEAD, rows)


def changes_table(found: Trace, logs: Sequence[str] = ()) -> Part:
    """The plain parameters; before and after the effects joined, where any did."""
    out: list[Row] = []
    for name, after in found.parameters_after.items():
        value, unit, interval = estimate_cells(after, "")
        before, now = found.parameters_before.get(name), as_shown(after).value
        if not found.effects:
            out.append((name, value, unit, interval))
        elif before is None or (was := as_shown(before)).value is None or now is None:
            out.append((name, "-", value, unit, interval, ""))
        else:
            (said,) = in_digits((was.value,), was.value, was.sd)
            out.append((name, said, value, unit, interval, percent(was.value, now)))
    shortened = reasons_once(out, logs, 2 if found.effects else 1)
    return tabled(CHANGE_HEAD if found.effects else SAME_HEAD, shortened, whole=out)


def differences_table(found: Trace) -> Part:
    """Parameters that differ between training and test logs."""
    rows = list[Row]()
    for c in found.drift:
        unit, factor = shown_unit(c.unit)
        after = f"{number(factor * c.after, 4)} ± {number(factor * 1.96 * c.sd, 2)}"
        change = percent(c.before, c.after)
        rows.append((c.name, number(factor * c.before, 4), after, unit, change))
    return tabled(DRIFT_HEAD, rows)


def trace_parts(traced: Traced) -> list[Part | str]:
    """Errors before and after, effects, parameters and drift.

    Behind --verbose: the effects' equations and sources, and the rivals.
    """
    found, rotary, logs = traced.trace, traced.model.rotary, logs_of_trace(traced)
    return [
        errors_table(found, rotary, bool(traced.test)),
        effects_table(found, traced.model.rig, logs),
        *map(more, effect_lines(found)),
        more(rivals_table(found, rotary)),
        changes_table(found, logs),
        differences_table(found),
        notes((*traced.remarks, *found.remarks), logs),
    ]


def logs_of_trace(traced: Traced) -> tuple[str, ...]:
    """Names of its logs, as remarks begin with them."""
    return tuple(dict.fromkeys(source.log.name for source in (*traced.train, *traced.test)))
