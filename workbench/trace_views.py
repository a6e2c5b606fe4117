"""A trace in words and tables, for a terminal and for its report."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from identification.trace_result import Errors, Trace
from workbench.parameter_units import shown
from workbench.tracing import Traced
from workbench.views import Row, in_digits, table, written

if TYPE_CHECKING:
    from rich.console import Group

ERRORS_HEAD = ("error", "train before", "after", "held out before", "after", "sensors' noise")
EFFECT_HEAD = ("effect", "parameter", "value", "95 % interval", "meaning")
RIVAL_HEAD = ("rival", "force left", "why not")
CHANGE_HEAD = ("parameter", "without effect", "with it", "unit", "change")
DRIFT_HEAD = ("parameter", "training", "test", "unit", "change")


def sentence(found: Trace, rotary: bool) -> str:
    """The verdict in one plain sentence."""
    unit = shown(rotary).force
    names = " and ".join(f"{e.effect.key} ({e.effect.meaning})" for e in found.effects)
    before, after = found.before["test"].force_rms, found.after["test"].force_rms
    errors = ""
    if before is not None and after is not None and found.effects:
        errors = (
            f" Held-out force error {before:.3g} {unit} -> {after:.3g} {unit}"
            f" (sensors' noise {found.noise_force:.2g} {unit})."
        )
    signals = ", ".join(found.unknown.depends_on)
    if found.verdict == "none":
        return "Nothing is missing: the model leaves no more than the sensors' noise explains."
    if found.verdict == "effect":
        return f"Missing: {names}.{errors}"
    if found.verdict == "drift":
        which = ", ".join(change.name for change in found.drift)
        return f"The structure holds, but the machine has drifted in {which}."
    if found.verdict == "inseparable":
        return f"These logs do not tell it from a rival: {names}.{errors}"
    known = f" Part of it is {names}.{errors}" if found.effects else ""
    return f"Unknown: what is left depends on {signals}, and no effect explains it.{known}"


def error_rows(found: Trace, rotary: bool) -> list[Row]:
    """Errors before and after, on training and held-out logs."""
    units = shown(rotary)
    noise = {"force_rms": found.noise_force, "actuator_rms": found.noise_actuator}
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


def effect_rows(found: Trace) -> list[Row]:
    """Every effect's parameters."""
    out: list[Row] = []
    for e in found.effects:
        for p in e.effect.params:
            value = e.params[p.name]
            number = "-" if value.value is None else f"{value.value:.4g} {value.unit}"
            interval = "held"
            if value.value is not None and value.low is not None and value.high is not None:
                interval = " to ".join(in_digits((value.low, value.high), value.value, value.sd))
            out.append((e.effect.key, p.name, number, interval, p.meaning))
    return out


def rival_rows(found: Trace, rotary: bool) -> list[Row]:
    """Rivals in the order of what they leave."""
    unit = shown(rotary).force
    return [
        (r.key, "-" if r.test_force_rms is None else f"{r.test_force_rms:.3g} {unit}", r.why_not)
        for r in found.rivals
    ]


def change_rows(found: Trace) -> list[Row]:
    """How the plain parameters change when the effect joins."""
    out: list[Row] = []
    for name, before in found.parameters_before.items():
        after = found.parameters_after[name]
        if before.value is None or after.value is None:
            continue
        change = 100 * (after.value - before.value) / before.value if before.value else 0.0
        out.append(
            (name, f"{before.value:.4g}", f"{after.value:.4g}", before.unit, f"{change:+.2g} %")
        )
    return out


def drift_rows(found: Trace) -> list[Row]:
    """Parameters that differ between training and test logs."""
    return [
        (
            c.name,
            f"{c.before:.4g}",
            f"{c.after:.4g} ± {1.96 * c.sd:.2g}",
            c.unit,
            f"{100 * (c.after - c.before) / c.before:+.3g} %" if c.before else "",
        )
        for c in found.drift
    ]


def trace_view(traced: Traced, folder: Path) -> "Group":
    """The verdict, errors before and after, effects, rivals and drift, for a terminal."""
    from rich.console import Group, RenderableType

    found, rotary = traced.trace, traced.model.rotary
    parts: list[RenderableType] = [sentence(found, rotary), ""]
    parts.append(table(ERRORS_HEAD, error_rows(found, rotary)))
    sections: Sequence[tuple[Sequence[str], list[Row]]] = (
        (EFFECT_HEAD, effect_rows(found)),
        (CHANGE_HEAD, change_rows(found) if found.effects else []),
        (RIVAL_HEAD, rival_rows(found, rotary)),
        (DRIFT_HEAD, drift_rows(found)),
    )
    parts.extend(table(head, rows) for head, rows in sections if rows)
    for e in found.effects:
        parts.append(
            f"{e.effect.key} explains {100 * e.explained:.3g} % of what was missing;"
            f" by luck: p = {e.p_value:.2g}"
        )
    if found.next_experiment:
        parts.append(f"next run: {found.next_experiment}")
    parts.extend(f"note: {line}" for line in (*traced.remarks, *found.remarks))
    parts.append(written(folder, "trace.json", "model.json", "report.html"))
    return Group(*parts)
