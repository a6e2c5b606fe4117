"""A trace in words and tables, for a terminal and for its report."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from identification.log import Rig
from identification.model.estimates import Estimate
from identification.tracing.regression.significance import DRAWS
from identification.tracing.result import Change, EffectRival, Errors, FoundEffect, Trace
from identification.tracing.verdict import listed
from workbench.cards.parameter_units import shown
from workbench.output import Row, table, written
from workbench.report.model_tables import in_digits
from workbench.steps.trace import Traced, effect_estimates

if TYPE_CHECKING:
    from rich.console import Group

EFFECT_HEAD = ("effect", "value", "unit", "95 % interval", "meaning")
RIVAL_HEAD = ("rival", "force left", "why not")
SAME_HEAD = ("parameter", "value", "unit", "95 % interval")
CHANGE_HEAD = ("parameter", "before", "after", "unit", "95 % interval after", "change")
DRIFT_HEAD = ("parameter", "training", "test", "unit", "change")
LEFT_IN_FORCE = 0.8  # of the force error; an effect that leaves more shows in another error
MOST = 1000.0  # change shown [%]
FLOOR = 1.0 / (DRAWS + 1)  # least chance that draws can show
NOISE = 1.5  # times the sensors' noise, up to which nothing is left


class Told(NamedTuple):
    """The error by which a trace is told: its name, before, after, its noise, and its unit."""

    name: str
    before: float
    after: float
    noise: float | None
    unit: str


def words(key: str) -> str:
    """An effect's key as words."""
    return key.replace("_", " ")


def errors_head(tested: bool) -> Row:
    """Head of the table of errors; tested: on test logs, not on stretches left out."""
    test = "held out" if tested else "left out"
    return ("error", "train before", "after", f"{test} before", "after", "sensors' noise")


def trace_sentence(traced: Traced) -> str:
    """The verdict in one or two plain sentences, and whether it is one for the time being."""
    left_out = traced.trace.not_tried
    early = f" Ended early, so this is for now; not tried: {'; '.join(left_out)}."
    return _verdict_sentence(traced) + (early if left_out else "")


def _verdict_sentence(traced: Traced) -> str:
    found = traced.trace
    names = "; and ".join(f"{words(e.effect.key)} – {e.effect.meaning}" for e in found.effects)
    told = fall_of_error(traced) if found.effects else ""
    errors = f" {told}" if told else ""
    changed = ", ".join(_changed(change) for change in found.drift)
    match found.verdict:
        case "unknown" if found.not_tried and not found.effects:
            return f"Open: {unexplained(traced, found.unknown.depends_on)}"
        case "none":
            return nothing_missing(found, shown(traced.model.rotary).force)
        case "effect":
            also = f" The test logs also differ in {changed}." if changed else ""
            return f"Missing: {names}.{share_explained(traced)}{errors}{also}"
        case "drift":
            return (
                f"Drift: between training and test logs the machine changed in {changed};"
                " its structure holds."
            )
        case "inseparable":
            others = " or ".join(words(key) for key in dict.fromkeys(equal_rival_keys(found)))
            rival = f" They do not tell it from {others}." if others else ""
            return f"Inseparable: these logs call for {names}.{rival}{errors}"
        case _:
            signals = listed(found.unknown.depends_on)
            if not signals:
                return f"Unknown: {unexplained(traced)}"
            share = f"{100 * found.unknown.explained:.0f} %"
            known = f" Part of it is {names}.{errors}" if found.effects else ""
            return (
                f"Unknown: what is left depends on {signals} (which accounts for {share} of it),"
                f" and no effect of the library explains it.{known}"
            )


def share_explained(traced: Traced) -> str:
    """How much of what was missing the effects explain, and on what the rest depends."""
    found = traced.trace
    if told_by(traced) is None:  # no error in which they would show
        return ""
    share = 100 * found.left.share
    it, where = (
        "It explains" if len(found.effects) == 1 else "They explain",
        "on the held-out logs" if traced.test else "on the stretches left out",
    )
    if found.complete:
        return f" {it} all of what was missing {where}, down to the sensors' noise."
    rest = "the rest depends on none of the signals"
    if found.left.depends_on:
        rest = f"the rest depends on {listed(found.left.depends_on)}"
    return f" {it} {100 - share:.3g} % of what was missing {where}; {rest}."


def unexplained(traced: Traced, signals: Sequence[str] = ()) -> str:
    """What is left where it is far more than noise; signals: on which it depends."""
    depends = f"depends on {listed(signals)}" if signals else "depends on none of the signals"
    found, units = traced.trace, shown(traced.model.rotary)
    unit, left = units.force, found.after["train"].force_rms
    off = found.after["train"].position_rms
    if left is not None and left <= NOISE * found.noise_force and off is not None:
        return (
            f"the free run is off by {off:.3g} {units.position} in 2 s (sensors' noise"
            f" {found.noise_y:.3g} {units.position}), and it {depends}."
        )
    return (
        f"the model leaves {left:.3g} {unit} of force, the sensors' noise alone"
        f" {found.noise_force:.3g} {unit}, and it {depends}."
    )


def nothing_missing(found: Trace, unit: str) -> str:
    """The verdict "none" in words; what is left may be more than noise, without a structure."""
    left, noise = found.after["test"].force_rms, found.noise_force
    if left is None:
        return "Nothing is missing."
    if left <= NOISE * noise:
        where = "" if found.noise_actuator is not None else " in the equation of motion"
        return (
            f"Nothing is missing{where}: the model leaves {left:.3g} {unit} of force, the"
            f" sensors' noise alone {noise:.3g} {unit}."
        )
    return (
        f"No effect is missing that these logs show: what is left ({left:.3g} {unit}, sensors'"
        f" noise {noise:.3g} {unit}) depends on none of their signals."
    )


def fall_of_error(traced: Traced) -> str:
    """How the error fell in which the effects show."""
    told = told_by(traced)
    if told is None:
        return ""
    noise = "" if told.noise is None else f" (sensors' noise {told.noise:.3g} {told.unit})"
    return f"{told.name} {told.before:.3g} {told.unit} -> {told.after:.3g} {told.unit}{noise}."


def told_by(traced: Traced) -> Told | None:
    """The force error, or where that hardly falls the one that falls most."""
    found, units = traced.trace, shown(traced.model.rotary)
    before, after = found.before["test"], found.after["test"]
    where = "Held-out" if traced.test else "On stretches left out,"
    noise, rate = found.noise_force, found.noise_actuator
    every = (
        Told(f"{where} force error", *_both(before, after, "force_rms"), noise, units.force),
        Told(
            f"{where} error of the actuator equation",
            *_both(before, after, "actuator_rms"),
            rate,
            f"{units.force}/s",
        ),
        Told(
            f"{where} position error in 2 s",
            *_both(before, after, "position_rms"),
            found.noise_y,
            units.position,
        ),
    )
    known = [told for told in every if math.isfinite(told.before) and told.before > 0]
    if not known:
        return None
    if known[0] is every[0] and known[0].after <= LEFT_IN_FORCE * known[0].before:
        return known[0]
    return min(known, key=lambda told: told.after / told.before)


def _both(before: Errors, after: Errors, key: str) -> tuple[float, float]:
    values = (getattr(before, key), getattr(after, key))
    return values if None not in values else (math.nan, math.nan)


def equal_rival_keys(found: Trace) -> tuple[str, ...]:
    """Keys of the rivals that explain as much as an effect taken; the first, where none says so."""
    keys = [r.key for r in found.rivals if r.why_not.startswith("explains as much")]
    return tuple(keys or [r.key for r in found.rivals[:1]])


def error_rows(found: Trace, rotary: bool) -> list[Row]:
    """Errors before and after, on training and held-out logs."""
    units = shown(rotary)
    noise = {
        "force_rms": found.noise_force,
        "actuator_rms": found.noise_actuator,
        "position_rms": found.noise_y,
    }
    names = {
        "force_rms": f"force, equation of motion [{units.force}]",
        "force_relative": "the same, of the applied force [%]",
        "position_rms": f"position, free run in windows of 2 s [{units.position}]",
        "actuator_rms": f"actuator equation [{units.force}/s]",
    }
    out = []
    for key, name in names.items():
        factor = 100.0 if key == "force_relative" else 1.0
        cells = [
            _cell(errors, key, factor)
            for where in ("train", "test")
            for errors in (found.before[where], found.after[where])
        ]
        floor = noise.get(key)
        out.append((name, *cells, "" if floor is None else f"{floor:.3g}"))
    return out


def _cell(errors: Errors, key: str, factor: float) -> str:
    value = getattr(errors, key)
    return "-" if value is None else f"{factor * value:.3g}"


def effect_rows(found: Trace, rig: Rig) -> list[Row]:
    """Every effect's parameters."""
    out: list[Row] = []
    for e in found.effects:
        estimates = effect_estimates(e, rig)
        for p in e.effect.params:
            value, interval = _value_cells(estimates[p.name])
            unit = "" if p.unit == "1" else estimates[p.name].unit
            out.append((f"{words(e.effect.key)} {p.name}", value, unit, interval, p.meaning))
    return out


def _value_cells(estimate: Estimate) -> tuple[str, str]:
    """Value and interval, with the digits that mean something."""
    if estimate.value is None:
        return "-", estimate.reason or "not identified"
    if estimate.low is None or estimate.high is None:
        return f"{estimate.value:.4g}", estimate.reason or "no interval"
    numbers = (estimate.value, estimate.low, estimate.high)
    value, low, high = in_digits(numbers, estimate.value, estimate.sd)
    return value, f"{low} to {high}"


def effect_lines(found: Trace) -> list[str]:
    """Equation, source and worth of every effect."""
    return [
        f"{words(e.effect.key)}: {e.effect.equation}; {e.effect.place.gives}. {_worth(e)}."
        f" Source: {e.effect.source}."
        for e in found.effects
    ]


def _worth(e: FoundEffect) -> str:
    chance = "p < 1e-4" if e.p_value < 1e-4 else f"p = {e.p_value:.2g}"
    if math.isclose(e.p_value, FLOOR):
        chance = f"p < {FLOOR:.1g}, none of {DRAWS} draws"
    return (
        f"It explains {100 * e.explained:.3g} % of what was missing where it shows"
        f" (by luck: {chance})"
    )


def rival_rows(found: Trace, rotary: bool) -> list[Row]:
    """Rivals in the order of the force error that they leave; last those that leave none."""
    unit = shown(rotary).force

    def left(rival: EffectRival) -> float:
        return math.inf if rival.test_force_rms is None else rival.test_force_rms

    return [
        (
            words(r.key),
            "-" if r.test_force_rms is None else f"{r.test_force_rms:.3g} {unit}",
            r.why_not,
        )
        for r in sorted(found.rivals, key=left)
    ]


def change_rows(found: Trace) -> list[Row]:
    """The plain parameters; before and after the effects joined, where any did (`change_head`)."""
    out: list[Row] = []
    for name, after in found.parameters_after.items():
        value, interval = _value_cells(after)
        before = found.parameters_before.get(name)
        if not found.effects:
            out.append((name, value, after.unit, interval))
        elif before is None or before.value is None or after.value is None:
            out.append((name, "-", value, after.unit, interval, ""))
        else:
            (was,) = in_digits((before.value,), before.value, before.sd)
            change = percent(before.value, after.value)
            out.append((name, was, value, after.unit, interval, change))
    return out


def change_head(found: Trace) -> Row:
    """Head of the table of the plain parameters."""
    return CHANGE_HEAD if found.effects else SAME_HEAD


def percent(before: float, after: float) -> str:
    """Change in percent; empty where there is nothing to compare with."""
    if before == 0:
        return ""
    change = 100 * (after - before) / before
    if abs(change) > MOST:
        return f"over {MOST:+.0f} %" if change > 0 else f"below {-MOST:+.0f} %"
    if round(change, 4) == 0:
        return "0 %"
    return f"{change:+.0f} %" if abs(change) >= 10 else f"{change:+.2g} %"


def drift_rows(found: Trace) -> list[Row]:
    """Parameters that differ between training and test logs."""
    return [
        (
            c.name,
            f"{c.before:.4g}",
            f"{c.after:.4g} ± {1.96 * c.sd:.2g}",
            c.unit,
            percent(c.before, c.after),
        )
        for c in found.drift
    ]


def _changed(change: Change) -> str:
    """One change in words."""
    by = percent(change.before, change.after)
    much = f" ({by})" if by else ""
    return f"{change.name} from {change.before:.4g} to {change.after:.4g} {change.unit}{much}"


def next_run(found: Trace) -> str:
    """The run that would tell more, as a sentence; empty where none is needed."""
    return f"Next run: {found.next_experiment.rstrip('.')}." if found.next_experiment else ""


def trace_view(traced: Traced, folder: Path) -> "Group":
    """The verdict, errors before and after, effects, rivals and drift, for a terminal."""
    from rich.console import Group, RenderableType

    found, rotary = traced.trace, traced.model.rotary
    parts: list[RenderableType] = [trace_sentence(traced)]
    parts.append(table(errors_head(bool(traced.test)), error_rows(found, rotary)))
    sections: Sequence[tuple[Sequence[str], list[Row]]] = (
        (EFFECT_HEAD, effect_rows(found, traced.model.rig)),
        (RIVAL_HEAD, rival_rows(found, rotary)),
        (change_head(found), change_rows(found)),
        (DRIFT_HEAD, drift_rows(found)),
    )
    for head, rows in sections:
        if rows:
            parts.append(table(head, rows))
        if head is EFFECT_HEAD:
            parts.extend(effect_lines(found))
    if found.next_experiment:
        parts.append(next_run(found))
    parts.extend(f"note: {line}" for line in (*traced.remarks, *found.remarks))
    parts.append(written(folder, "trace.json", "model.json", "report.html"))
    return Group(*parts)
