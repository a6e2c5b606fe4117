"""What a worker makes of a dropped log: a model, its design and validation, and how to see them.

The files are those of the commands; `result.json` holds what the page shows beside them.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from identification.errors import BadModel, BadSpecification, NotIdentifiable
from workbench.cards.own_effects import library
from workbench.course import Course, moving
from workbench.documents.design_file import design_document
from workbench.documents.model import Model
from workbench.documents.model_file import model_document
from workbench.files import REPORT_FILE
from workbench.logs.sources import Sources, read_sources
from workbench.output import OutputFolder
from workbench.page.dropped import CHARTS_FILE, RESULT_FILE
from workbench.registry.values import TaskKind
from workbench.report.fit import fit_chart, residual
from workbench.report.missing_force import missing_over_time
from workbench.report.model_tables import (
    MODEL_HEAD,
    fit_lines,
    logs_of,
    parameter_rows,
    plant_lines,
    summary,
)
from workbench.report.reports import identified_view
from workbench.report.trace import traced_view
from workbench.report.trace_pictures import against_signal, pictures
from workbench.report.trace_tables import errors_table, logs_of_trace
from workbench.report.trace_words import trace_sentence
from workbench.report.view import Section, report_notes
from workbench.steps.design import design
from workbench.steps.identify_sources import Identified, identify_sources
from workbench.steps.predict import fitted_run
from workbench.steps.predicted_force import missing_force
from workbench.steps.stages import IDENTIFY_STAGES, TRACE_STAGES
from workbench.steps.trace import Traced, trace_document, trace_sources
from workbench.steps.validate import validate, validation_document

MODEL_SHARE = 0.9  # of the bar, for the model; the rest for its design
LAST_STAGES = {"designing": (MODEL_SHARE, 0.95), "validating": (0.95, 1.0)}
MOST_PICTURES = 3  # of a trace: what is missing, over time and against what explains it
WORK_STAGES = {"identify": IDENTIFY_STAGES, "trace": TRACE_STAGES}


@dataclass(frozen=True)
class Work:
    """A task as a worker takes it: the log by its card, and where its results go."""

    kind: TaskKind
    log: Path
    card: Path
    out: Path


def course_of(
    kind: TaskKind, advance: Callable[[float], None], describe: Callable[[str], None]
) -> Course:
    """The course of a task: its stages, and those of the design after it."""
    stages = {
        name: (MODEL_SHARE * low, MODEL_SHARE * high)
        for name, (low, high) in WORK_STAGES[kind].items()
    }
    return Course(advance, {**stages, **LAST_STAGES}, time.monotonic, describe=describe)


def done(work: Work, course: Course) -> str:
    """Do the work and write its results, whole or not at all; a line on what came of it.

    Raises UserError where the log does not give a model.
    """
    with OutputFolder(work.kind, work.out, now=datetime.now()) as folder, moving(course):
        sources = read_sources([str(work.log)], str(work.card))
        makes = _identified if work.kind == "identify" else _traced
        model, documents, result, charts = makes(sources, course)
        documents, line = _with_design(model, documents, course)
        for name, document in documents.items():
            folder.write_json(f"{name}.json", document)
        folder.write_text(REPORT_FILE, result.pop("report"))
        folder.write_text(CHARTS_FILE, "".join(one.html for one in charts))
        rows = [row[: len(MODEL_HEAD)] for row in parameter_rows(model)]
        folder.write_json(
            RESULT_FILE,
            {**result, "head": MODEL_HEAD, "parameters": rows, "design": line, "card": model.card},
        )
    return str(result["summary"])


Made = tuple[Model, dict[str, Any], dict[str, Any], Sequence[Section]]


def _identified(sources: Sources, course: Course) -> Made:
    found: Identified = identify_sources(sources, on_progress=course.report)
    model = found.model
    missing = missing_force(model, [one.log for one in found.sources])
    result = {
        "summary": summary(model, missing),
        "notes": _notes((*fit_lines(model), *plant_lines(model), *found.remarks), logs_of(model)),
        "errors": None,
        "report": identified_view(found).page(),
    }
    own, fitted = found.fit.friction, found.sources
    runs = [fitted_run(model, one.log, number, own) for number, one in enumerate(fitted)]
    fit = Section("Fit over time", fit_chart(model, fitted, runs))
    drawn = (fit, *residual(model, fitted, runs, missing, own))
    return model, {"model": model_document(model)}, result, drawn


def _traced(sources: Sources, course: Course) -> Made:
    found: Traced = trace_sources(sources, None, library(()), 0, course.report)
    model, rotary = found.model, found.model.rotary
    errors = errors_table(found.trace, rotary, tested=False)
    result = {
        "summary": trace_sentence(found),
        "notes": _notes((*found.remarks, *found.trace.remarks), logs_of_trace(found)),
        "errors": {"head": errors.full_head, "rows": errors.whole},
        "report": traced_view(found).page(),
    }
    documents = {"trace": trace_document(found), "model": model_document(model)}
    command = model.rig.command_unit
    shown = missing_over_time(found.trace, rotary, [one.file for one in found.train])
    shown += [against_signal(one, rotary, command) for one in pictures(found.trace)]
    return model, documents, result, shown[:MOST_PICTURES]


def _notes(remarks: Sequence[str], logs: Sequence[str]) -> list[str]:
    return [one.text for one in report_notes(remarks, logs)]


def _with_design(
    model: Model, documents: dict[str, Any], course: Course
) -> tuple[dict[str, Any], str]:
    """The documents with design and validation, where the model carries them, and what to say."""
    course.report("designing", 0.0)
    try:
        made = design(model)
    except (BadSpecification, NotIdentifiable, BadModel) as error:
        return documents, f"no design: {error}"
    documents = {**documents, "design": design_document(made)}
    course.report("validating", 0.0)
    try:
        checked, _ = validate(model, made, np.random.default_rng(0))
    except BadModel as error:
        return documents, f"{made.recommended} recommended, not validated: {error}"
    said = "meets every limit in simulation" if checked.passed else "misses a limit in simulation"
    line = f"{made.recommended.upper()} recommended, which {said}"
    return {**documents, "validation": validation_document(checked)}, line
