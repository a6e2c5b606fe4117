"""A worker of the page: takes the next task, does it, and stops where it is cancelled.

It may be killed at any moment: its lease ends, and another begins the task anew. What it makes of a
dropped log are a model, its design and validation, and how to see them: the files are those of the
commands; `result.json` holds what the page shows beside them.
"""

import os
import signal
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from types import FrameType

import numpy as np

from design.controllers.design import design
from design.controllers.validate import validate, validation_document
from design.identified.identify_logs import identify_logs
from design.identified.trace_logs import trace_logs
from design.machine.documents import design_document
from design.machine.model import Model
from identification.errors import BadModel, BadSpecification, NotIdentifiable, UserError
from workbench.cards.own_effects import library
from workbench.course import Course, moving
from workbench.jobs.options import clock, worker_name
from workbench.jobs.passes import Patience, Report, renewed
from workbench.logs.sources import Sources, read_sources
from workbench.output import OutputFolder
from workbench.page.dropped import CHARTS_FILE, LOG_FOLDER, RESULT_FILE, Drop, without_path
from workbench.page.settings import PageSettings
from workbench.registry.bench import Bench, EndState
from workbench.registry.store import Registry
from workbench.registry.tables import TaskRow
from workbench.registry.values import LostClaim, RegistryAway, TaskKind
from workbench.report.model_tables import (
    MODEL_HEAD,
    fit_lines,
    logs_of,
    parameter_rows,
    plant_lines,
)
from workbench.report.trace import errors_table, logs_of_trace
from workbench.report.view import View, report_notes, view
from workbench.steps.asked import IDENTIFY_STAGES, TRACE_STAGES

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
    found = identify_logs(sources.logs, on_progress=course.report)
    model = found.model
    said = (*fit_lines(model), *plant_lines(model), *found.remarks)
    return model, view(found), {"notes": _notes(said, logs_of(model)), "errors": None}


def _traced(sources: Sources, course: Course) -> Made:
    found = trace_logs(sources.logs, None, library(()), 0, course.report)
    errors = errors_table(found.trace, found.model.display, tested=False)
    result = {
        "notes": _notes((*found.remarks, *found.trace.remarks), logs_of_trace(found)),
        "errors": {"head": errors.full_head, "rows": errors.whole},
    }
    return found.model, view(found), result


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


TASK_LEASE = timedelta(seconds=30)
QUEUE_POLL = 0.5  # s between two checks of the queue, and at whether the task is still ours
STUBBORN = 10.0  # s after which a computation that does not end is ended with its process
STUBBORN_STATUS = 75


@dataclass
class _Progress:
    """How far the task in hand is, and what goes on."""

    share: float = 0.0
    stage: str = ""

    def advance(self, step: float) -> None:
        self.share = min(self.share + step, 1.0)

    def describe(self, words: str) -> None:
        self.stage = words


class NotOurs(BaseException):
    """The task in hand was cancelled, or another has taken it over."""


def run_worker(settings: PageSettings, report: Report, *, once: bool = False) -> None:
    """Do tasks until SIGTERM or Ctrl-C, which give the one in hand back; once: until none waits.

    Runs in the main thread, as its task is ended by a signal.
    """
    owner = worker_name()
    signal.signal(signal.SIGUSR1, _raise)  # which only a beat sends
    patience = Patience()
    with patience(Registry, settings.where) as registry:
        bench = Bench(registry.database)
        report("worker_ready", owner=owner)
        while True:
            try:
                claim = bench.claim(owner, lease=TASK_LEASE, now=clock())
            except RegistryAway as error:
                report("registry_away", reason=str(error))
                time.sleep(10 * QUEUE_POLL)
                continue
            if claim is not None:
                _one(bench, claim, settings, report)
            elif once:
                return
            else:
                time.sleep(QUEUE_POLL)


def _one(bench: Bench, task: TaskRow, settings: PageSettings, report: Report) -> None:
    """Do one task; its end is written, unless it is no longer ours."""
    report("task_begun", task=task.id, kind=task.kind, upload=task.upload)
    try:
        state, said = _made(bench, task, settings, report)
        Patience()(bench.finish, task, state, said, now=clock())
        report("task_over", task=task.id, state=state, said=said)
    except (NotOurs, LostClaim):
        report("task_lost", task=task.id)
    except BaseException:  # asked to end: another begins it anew
        bench.give_back(task)
        raise


def _made(
    bench: Bench, task: TaskRow, settings: PageSettings, report: Report
) -> tuple[EndState, str]:
    """What came of the task: its last state, and a line."""
    files = Drop(settings.machines, task.upload)
    try:
        work = Work(task.kind, files.log, files.card, files.results(task.id))
        with _beating(bench, task) as state:
            return "done", done(work, course_of(task.kind, state.advance, state.describe))
    except UserError as error:
        return "failed", without_path(str(error), [files.folder / LOG_FOLDER / "log", files.card])
    except (OSError, MemoryError) as error:
        return "failed", f"{type(error).__name__}: {getattr(error, 'strerror', None) or error}"
    except Exception as error:  # a fault of ours in one task must not stop the others
        report("fault_of_ours", task=task.id, traceback=traceback.format_exc())
        return "failed", f"fault of ours: {type(error).__name__}: {error}"


@contextmanager
def _beating(bench: Bench, task: TaskRow) -> Iterator[_Progress]:
    """Within the block the task's progress is written, and NotOurs raised once it is not ours."""
    state = _Progress()

    def beat() -> None:
        bench.progress(task, state.stage, state.share, lease=TASK_LEASE, now=clock())

    def stop(over: threading.Event) -> None:
        os.kill(os.getpid(), signal.SIGUSR1)
        if not over.wait(STUBBORN):
            os._exit(STUBBORN_STATUS)

    with renewed(beat, QUEUE_POLL, stop):
        yield state


def _raise(_number: int, _frame: FrameType | None) -> None:
    raise NotOurs
