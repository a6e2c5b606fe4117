"""The report of a trace: verdict, residual before and after, what explains it, rivals."""

from workbench.output import Row
from workbench.report.page import Section, page, render
from workbench.report.trace_friction import friction_before_after
from workbench.report.trace_pictures import (
    Picture,
    against_signal,
    in_equation,
    over_time,
    pictures,
)
from workbench.report.trace_tables import (
    DRIFT_HEAD,
    EFFECT_HEAD,
    RIVAL_HEAD,
    change_head,
    change_rows,
    drift_rows,
    effect_lines,
    effect_rows,
    error_rows,
    errors_head,
    next_run,
    rival_rows,
    trace_sentence,
    words,
)
from workbench.steps.trace import Traced

HIDDEN = (
    "{} shows in neither equation while the body slides, but at rest, at breakaway or in what the"
    " transducer shows: the free run tells it, no residual of an equation does."
)


def trace_report(traced: Traced) -> str:
    """HTML: what is missing, how it shows, and the errors before and after."""
    found, model = traced.trace, traced.model
    drawn = pictures(found)
    sections = [*_drawn(drawn, model.rotary), *_hidden(traced, drawn)]
    if found.run is not None:
        sections.append(over_time(found.run, model.rotary))
    sections.append(
        _table(
            "Before and after",
            errors_head(bool(traced.test)),
            error_rows(found, model.rotary),
        )
    )
    if found.effects:
        title = "The effect" if len(found.effects) == 1 else "The effects"
        rows = effect_rows(found, model.rig)
        sections.append(_table(title, EFFECT_HEAD, rows, effect_lines(found)))
    sections.append(friction_before_after(traced))
    plain = "Parameters before and after" if found.effects else "Parameters"
    for title, head, rows in (
        ("Rivals, by the force that they leave", RIVAL_HEAD, rival_rows(found, model.rotary)),
        (plain, change_head(found), change_rows(found)),
        ("Drift between training and test logs", DRIFT_HEAD, drift_rows(found)),
    ):
        if rows:
            sections.append(_table(title, head, rows))
    if found.next_experiment:
        sections.append(Section("Next experiment", render("lines", lines=[next_run(found)])))
    notes = [*traced.remarks, *found.remarks]
    if notes:
        sections.append(Section("Notes", render("lines", lines=notes)))
    lead = f"{trace_sentence(traced)} {next_run(found)}".strip()
    return page(f"Trace of {model.card}", lead, sections)


def _drawn(drawn: list[Picture], rotary: bool) -> list[Section]:
    """Each equation over time, and its residual against every signal that explains it."""
    out: list[Section] = []
    shown: set[str] = set()
    for picture in drawn:
        if picture.residual.equation not in shown:
            out.append(over_time(picture.residual, rotary))
            shown.add(picture.residual.equation)
        out.append(against_signal(picture, rotary))
    return out


def _hidden(traced: Traced, drawn: list[Picture]) -> list[Section]:
    """A line for each effect that no residual of an equation shows."""
    seen = {picture.residual.equation for picture in drawn}
    lines = [
        HIDDEN.format(words(e.effect.key))
        for e in traced.trace.effects
        if in_equation(e.effect) not in seen
    ]
    return [Section("Where it shows", render("lines", lines=lines))] if lines else []


def _table(title: str, head: Row, rows: list[Row], lines: list[str] | None = None) -> Section:
    return Section(title, render("table", head=head, rows=rows, lines=lines or []))
