"""A trace in tables, for a terminal, and as a report: verdict, residual before and after, what
explains it, rivals."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from design.identified.trace_document import trace_document
from design.identified.trace_logs import Traced, effect_estimates
from design.machine.documents import model_document
from design.machine.readable import Display, as_shown, in_digits, number, shown_unit, small
from identification.effects._base import Param
from identification.log import Rig
from identification.tracing.regression.significance import DRAWS
from identification.tracing.residual_rows import in_equation
from identification.tracing.result import FoundEffect, Trace
from identification.tracing.shown_against import pictures
from workbench.report.chart import Chart
from workbench.report.fit import Which, missing_chart
from workbench.report.friction import trace_friction_chart
from workbench.report.model_tables import estimate_cells, is_left_out, reasons_once
from workbench.report.next_steps import after_trace
from workbench.report.response import over_frequency
from workbench.report.trace_pictures import against_signal, free_curves, over_time, signal_chart
from workbench.report.trace_words import advice, by_regression, percent, trace_sentence, words
from workbench.report.view import Section, View, notes, report_notes, view
from workbench.screen import Part, Row, more, tabled

EFFECT_HEAD = ("effect", "value", "unit", "95 % interval", "meaning")
RIVAL_HEAD = ("rival", "force left", "why not")
SAME_HEAD = ("parameter", "value", "unit", "95 % interval")
CHANGE_HEAD = ("parameter", "before", "after", "unit", "95 % interval after", "change")
DRIFT_HEAD = ("parameter", "training", "test", "unit", "change")
FLOOR = 1.0 / (DRAWS + 1)  # least chance that draws can show
FOR_THE_TIME_BEING = "the values are for now, as the trace ended early:"
HIDDEN = (
    "{} shows in neither equation while the body slides, but at rest, at breakaway or in what the"
    " transducer shows: only the free run identifies it, no residual of an equation."
)


def errors_table(found: Trace, display: Display, tested: bool = True) -> Part:
    """Errors before and after, on training and held-out logs; not tested: on stretches left out."""
    test = "held out" if tested else "left out"
    head = ("error", "train before", "after", f"{test} before", "after", "sensors' noise")
    unit, position = display.force, display.shown("position")
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
    """Every effect's parameters; of one effect alone a screen has room for what they mean, and of
    several a row names the effect and those of its parameters follow."""
    rows, once, alone = list[Row](), list[Row](), len(found.effects) == 1
    for e in found.effects:
        name, estimates, own = words(e.effect.key), effect_estimates(e, rig), list[Row]()
        for p in shown_params(e):
            value, unit, interval = estimate_cells(estimates[p.name], "")
            own.append((p.name, value, "" if p.unit == "1" else unit, interval, p.meaning))
        rows += [(f"{name} {row[0]}", *row[1:]) for row in own]
        if not alone:  # their reasons would push other effects from the screen
            own = [row if row[1] != "-" else (*row[:3], "", row[4]) for row in own]
        once.append((f"{name}:", "", "", "", ""))
        once += [(f"  {row[0]}", *row[1:]) for row in reasons_once(own, logs)]
    if alone:
        return tabled(EFFECT_HEAD, once, whole=rows)
    short = tabled(EFFECT_HEAD[:-1], [row[:-1] for row in once])
    return replace(short, whole=tuple(rows), whole_head=EFFECT_HEAD)


def shown_params(of: FoundEffect) -> list[Param]:
    """The parameters of an effect but for sizes that it does without."""
    return [p for p in of.effect.params if not is_left_out(p, of.params[p.name])]


def effect_lines(found: Trace) -> list[str]:
    """Equation, source and worth of every effect, once for those of the same."""
    said = dict[str, list[str]]()
    for e in found.effects:
        chance = "p < 1e-4" if e.p_value < 1e-4 else f"p = {e.p_value:.2g}"
        if math.isclose(e.p_value, FLOOR):
            chance = f"p < {FLOOR:.1g}, none of {DRAWS} draws"
        line = (
            f"{e.effect.equation}; {e.effect.place.gives}. It explains {100 * e.explained:.3g} % of"
            f" what was missing where it shows (by chance: {chance}). Source: {e.effect.source}."
        )
        said.setdefault(line, []).append(words(e.effect.key))
    return [f"{', '.join(names)}: {line}" for line, names in said.items()]


def rivals_table(found: Trace, display: Display) -> Part:
    """Rivals in the order of the force error that they leave; last those that leave none."""
    left = [(one.test_force_rms, one) for one in found.rivals]
    left.sort(key=lambda both: math.inf if both[0] is None else both[0])
    rows = [
        (words(one.key), "-" if rms is None else display.force_text(rms), one.why_not)
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
    shortened = reasons_once(out, logs, (2, 3, 4) if found.effects else (1, 2, 3))
    return tabled(CHANGE_HEAD if found.effects else SAME_HEAD, shortened, whole=out)


def differences_table(found: Trace) -> Part:
    """Parameters that differ between training and test logs; the head says where they are not of
    the fit whose parameters are reported."""
    regressed = any(by_regression(c, found) for c in found.drift)
    head = (f"parameter{', by regression' if regressed else ''}", *DRIFT_HEAD[1:])
    rows = list[Row]()
    for c in found.drift:
        unit, factor = shown_unit(c.unit)
        after = f"{number(factor * c.after, 4)} ± {number(factor * 1.96 * c.sd, 2)}"
        change = percent(c.before, c.after)
        rows.append((c.name, number(factor * c.before, 4), after, unit, change))
    return tabled(head, rows)


def trace_parts(traced: Traced) -> list[Part | str]:
    """Errors before and after, effects, parameters and drift.

    Behind --verbose: the effects' equations and sources, and the rivals.
    """
    found, display, logs = traced.trace, traced.model.display, logs_of_trace(traced)
    return [
        errors_table(found, display, bool(traced.test)),
        effects_table(found, traced.model.rig, logs),
        *map(more, effect_lines(found)),
        more(rivals_table(found, display)),
        *([FOR_THE_TIME_BEING] if found.not_tried else []),
        changes_table(found, logs),
        differences_table(found),
        notes((*traced.remarks, *found.remarks), logs),
    ]


def logs_of_trace(traced: Traced) -> tuple[str, ...]:
    """Names of its logs, as remarks begin with them."""
    return tuple(dict.fromkeys(source.log.name for source in (*traced.train, *traced.test)))


@view.register
def _(traced: Traced) -> View:
    """What is missing, how it shows, and the errors before and after."""
    found, newer = traced.trace, [one.file for one in traced.test or traced.train]
    return View(
        f"Trace of {traced.model.card}",
        trace_sentence(traced),
        trace_parts(traced),
        {
            "trace.json": lambda: trace_document(traced),
            "model.json": lambda: model_document(traced.model),
        },
        lambda: _sections(traced),
        lambda: _main_chart(traced),
        advice(traced),
        after_trace(found.verdict, found.effects, traced.model, newer, "CARD", Path()),
    )


def _main_chart(traced: Traced) -> Chart:
    """What is missing against the signal that explains it, else over time, else the friction before
    and after."""
    drawn = pictures(traced.trace)
    if drawn:
        return signal_chart(drawn[0], traced.model.display)
    if traced.trace.missing_force is not None:
        return missing_chart(traced.trace, traced.model.display, *_unseen(traced))
    return trace_friction_chart(traced)


def _sections(traced: Traced) -> list[Section]:
    found, model = traced.trace, traced.model
    drawn, display = pictures(found), model.display
    logs = [source.file for source in traced.train]
    sections = list[Section]()
    if found.missing_force is not None:
        chart = missing_chart(found, display, *_unseen(traced))
        sections.append(Section("Force that the model lacks", chart))
    # What is left of each equation against every signal that explains it, then over time.
    sections += [against_signal(picture, display) for picture in drawn]
    left = {picture.residual.equation: picture.residual for picture in drawn}
    seen = set(left) if found.residuals else {"mechanical", "actuator"}
    if found.missing_force is not None:  # the report begins with it
        left.pop("mechanical", None)
    sections += [over_time(residual, display, logs) for residual in left.values()]
    hidden = [e.effect for e in found.effects if in_equation(e.effect) not in seen]
    if hidden:
        sections.append(
            Section("Where it shows", [HIDDEN.format(words(one.key)) for one in hidden])
        )
    if found.run is not None:
        sections.append(over_time(found.run, display, logs))
    errors = errors_table(found, display, bool(traced.test))
    sections.append(Section("Before and after", errors))
    if found.effects:
        title = "The effect" if len(found.effects) == 1 else "The effects"
        sections.append(Section(title, effects_table(found, model.rig), effect_lines(found)))
    if found.curves:
        sections.append(free_curves(found.curves, display))
    sections.append(Section("Friction", trace_friction_chart(traced)))
    plain = "Parameters before and after" if found.effects else "Parameters"
    tables = {
        "Rivals, by the force that they leave": rivals_table(found, display),
        f"{plain}{', for now' if found.not_tried else ''}": changes_table(found),
        "Drift between training and test logs": differences_table(found),
    }
    sections += [Section(title, one) for title, one in tables.items() if one.whole]
    sections += over_frequency(model, traced.train)
    said = report_notes((*traced.remarks, *found.remarks), logs_of_trace(traced))
    return [*sections, Section("Notes", said)] if said else sections


def _unseen(traced: Traced) -> tuple[list[str], Which]:
    """Names of the logs that the model has not seen, or of the others where there are none."""
    names = [source.file for source in traced.test or traced.train]
    return names, "test" if traced.test else "training"
