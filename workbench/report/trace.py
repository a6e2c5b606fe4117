"""The report of a trace: verdict, residual before and after, what explains it, rivals."""

from pathlib import Path

from workbench.documents.model_file import model_document
from workbench.report.chart import Chart
from workbench.report.friction import trace_friction_chart
from workbench.report.missing_force import Which, missing_chart, missing_over_time
from workbench.report.next_steps import after_trace
from workbench.report.response import over_frequency
from workbench.report.trace_pictures import (
    against_signal,
    free_curves,
    in_equation,
    over_time,
    pictures,
    signal_chart,
)
from workbench.report.trace_tables import (
    changes_table,
    differences_table,
    effect_lines,
    effects_table,
    errors_table,
    logs_of_trace,
    rivals_table,
    trace_parts,
)
from workbench.report.trace_words import advice, trace_sentence, words
from workbench.report.view import Section, View, report_notes
from workbench.steps.trace import Traced, trace_document

HIDDEN = (
    "{} shows in neither equation while the body slides, but at rest, at breakaway or in what the"
    " transducer shows: only the free run identifies it, no residual of an equation."
)


def traced_view(traced: Traced) -> View:
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
        after_trace(found.verdict, found.effects, newer, "CARD", Path()),
    )


def _main_chart(traced: Traced) -> Chart:
    """What is missing against the signal that explains it, else over time, else the friction before
    and after."""
    drawn, rig = pictures(traced.trace), traced.model.rig
    if drawn:
        return signal_chart(drawn[0], traced.model.rotary, rig.command_unit)
    if traced.trace.missing_force is not None:
        return missing_chart(
            traced.trace, traced.trace.missing_force, traced.model.rotary, *_unseen(traced)
        )
    return trace_friction_chart(traced)


def _sections(traced: Traced) -> list[Section]:
    found, model = traced.trace, traced.model
    drawn, command = pictures(found), model.rig.command_unit
    logs = [source.file for source in traced.train]
    sections = missing_over_time(found, model.rotary, *_unseen(traced))
    # What is left of each equation against every signal that explains it, then over time.
    sections += [against_signal(picture, model.rotary, command) for picture in drawn]
    left = {picture.residual.equation: picture.residual for picture in drawn}
    seen = set(left) if found.residuals else {"mechanical", "actuator"}
    if found.missing_force is not None:  # the report begins with it
        left.pop("mechanical", None)
    sections += [over_time(residual, model.rotary, logs) for residual in left.values()]
    hidden = [e.effect for e in found.effects if in_equation(e.effect) not in seen]
    if hidden:
        sections.append(
            Section("Where it shows", [HIDDEN.format(words(one.key)) for one in hidden])
        )
    if found.run is not None:
        sections.append(over_time(found.run, model.rotary, logs))
    errors = errors_table(found, model.rotary, bool(traced.test))
    sections.append(Section("Before and after", errors))
    if found.effects:
        title = "The effect" if len(found.effects) == 1 else "The effects"
        sections.append(Section(title, effects_table(found, model.rig), effect_lines(found)))
    if found.curves:
        sections.append(free_curves(found.curves, model.rotary, command))
    sections.append(Section("Friction", trace_friction_chart(traced)))
    plain = "Parameters before and after" if found.effects else "Parameters"
    tables = {
        "Rivals, by the force that they leave": rivals_table(found, model.rotary),
        plain: changes_table(found),
        "Drift between training and test logs": differences_table(found),
    }
    sections += [Section(title, one) for title, one in tables.items() if one.whole]
    sections += over_frequency(model, traced.train)
    notes = report_notes((*traced.remarks, *found.remarks), logs_of_trace(traced))
    return [*sections, Section("Notes", notes)] if notes else sections


def _unseen(traced: Traced) -> tuple[list[str], Which]:
    """Names of the logs that the model has not seen, or of the others where there are none."""
    names = [source.file for source in traced.test or traced.train]
    return names, "test" if traced.test else "training"
