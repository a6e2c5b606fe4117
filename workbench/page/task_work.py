"""What a worker makes of a dropped log: a model, its design and validation, and how to see them.

The files are those of the commands; `result.json` holds what the page shows beside them.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np

from identification.errors import BadModel, BadSpecification, NotIdentifiable
from workbench.cards.own_effects import library
from workbench.course import Course, moving
from workbench.documents.model import Model
from workbench.documents.result_files import design_document
from workbench.logs.sources import Sources, read_sources
from workbench.output import OutputFolder
from workbench.page.dropped import CHARTS_FILE, RESULT_FILE
from workbench.registry.values import TaskKind
from workbench.report.model_tables import (
    MODEL_HEAD,
    fit_lines,
    logs_of,
    parameter_rows,
    plant_lines,
)
from workbench.report.reports import identified_view
from workbench.report.trace import errors_table, logs_of_trace, traced_view
from workbench.report.view import View, report_notes
from workbench.steps.asked import IDENTIFY_STAGES, TRACE_STAGES
from workbench.steps.design import design
from workbench.steps.identify_sources import identify_sources
from workbench.steps.trace import trace_sources
from workbench.steps.validate import validate, validation_document

MODEL_SHARE = 0.9  # of the bar, for the model; the rest for its design
LAST_STAGES = {"designing": (MODEL_SHARE, 0.95), "validating": (0.95, 1.0)}
MOST_PICTURES = 3
# How the sections of a report begin that the page shows: of a trace what is missing, over time and
# against what explains it.
PICTURES = {
    "identify": ("Fit over time", "What the model leaves"),
    "trace": ("Force that the model lacks", "What it depends on", "Against "),
}
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
        model, view, result = makes(sources, course)
        line = _with_design(model, folder, course)
        view.write(folder)
        charts = [one.html for begin in PICTURES[work.kind] for one in view.drawn
                  if one.title.startswith(begin)]  # fmt: skip
        folder.write(CHARTS_FILE, "".join(charts[:MOST_PICTURES]))
        rows = [row[: len(MODEL_HEAD)] for row in parameter_rows(model)]
        of_model = {"head": MODEL_HEAD, "parameters": rows, "design": line, "card": model.card}
        folder.write_json(RESULT_FILE, {"summary": view.sentence, **result, **of_model})
    return view.sentence


Made = tuple[Model, View, Mapping[str, object]]


def _identified(sources: Sources, course: Course) -> Made:
    found = identify_sources(sources, on_progress=course.report)
    model = found.model
    said = (*fit_lines(model), *plant_lines(model), *found.remarks)
    return model, identified_view(found), {"notes": _notes(said, logs_of(model)), "errors": None}


def _traced(sources: Sources, course: Course) -> Made:
    found = trace_sources(sources, None, library(()), 0, course.report)
    errors = errors_table(found.trace, found.model.rotary, tested=False)
    result = {
        "notes": _notes((*found.remarks, *found.trace.remarks), logs_of_trace(found)),
        "errors": {"head": errors.full_head, "rows": errors.whole},
    }
    return found.model, traced_view(found), result


def _notes(remarks: Sequence[str], logs: Sequence[str]) -> list[str]:
    return [one.text for one in report_notes(remarks, logs)]


def _with_design(model: Model, folder: OutputFolder, course: Course) -> str:
    """Write design and validation, where the model carries them; what to say of them."""
    course.report("designing", 0.0)
    try:
        made = design(model)
    except (BadSpecification, NotIdentifiable, BadModel) as error:
        return f"no design: {error}"
    folder.write_json("design.json", design_document(made))
    course.report("validating", 0.0)
    try:
        checked, _ = validate(model, made, np.random.default_rng(0))
    except BadModel as error:
        return f"{made.recommended} recommended, not validated: {error}"
    folder.write_json("validation.json", validation_document(checked))
    said = "meets every limit in simulation" if checked.passed else "misses a limit in simulation"
    return f"{made.recommended.upper()} recommended, which {said}"
