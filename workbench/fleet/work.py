"""What a worker does with one log: read it there, identify or test it, and return the result."""

import resource
import sys
import time
import traceback
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from design.identified.identify_logs import identify_logs
from design.judgement import Candidate
from design.machine.documents import model_document
from design.machine.versions import versions
from identification.errors import BadCard, BadModel, NotIdentifiable, UserError
from workbench.files import CARD_FILE, sha256_of
from workbench.fleet.finding import local_copy, said
from workbench.fleet.values import BadLogs, Item, Result
from workbench.jobs.judge import Chain
from workbench.jobs.passes import Task
from workbench.logs.sources import read_sources
from workbench.registry.values import SeenLog

KIB = 1024


def work(item: Item) -> Result:
    """The log's result; nothing is raised but what ends the worker itself.

    The log is read here, so that it does not pass through the scheduler.
    """
    begin = time.process_time()
    try:
        with local_copy(item.url, item.log) as path, TemporaryDirectory(prefix="card-") as folder:
            card = Path(folder) / CARD_FILE
            card.write_text(item.card, encoding="utf-8")
            found = _result(item, path, card)
    except BadLogs as error:
        found = Result(item.log, "set_aside", str(error))
    seconds, peak = time.process_time() - begin, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    memory = peak if sys.platform == "darwin" else peak * KIB
    return replace(found, seconds=seconds, memory=memory, versions=versions())


def _result(item: Item, path: Path, card: Path) -> Result:
    """The result of the log in the local file, errors of the log and of ours among the results."""
    log = item.log
    blank = Result(log, "set_aside", "", against=item.version.number if item.version else None)
    try:
        blank = replace(blank, sha256=sha256_of(path))
        made = _identified if item.model is None else _judged
        return made(item, path, card, blank)
    except NotIdentifiable as error:
        return replace(blank, verdict="not_judged", reason=_named(error, path, card, item))
    except (BadCard, BadModel) as error:
        return replace(blank, verdict="waits", reason=_named(error, path, card, item))
    except (UserError, OSError) as error:
        return replace(blank, reason=_named(error, path, card, item))
    except MemoryError:
        reason = f"{log.name}: the worker's memory does not hold it; give workers with more"
        return replace(blank, verdict="waits", reason=reason)
    except Exception as error:  # a fault of ours on one log must not stop the others
        last = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(last.filename).name}, line {last.lineno}"
        reason = f"{log.name}: fault of ours: {type(error).__name__}: {said(error)} (in {where})"
        return replace(blank, verdict="failed", reason=reason)


def _identified(item: Item, path: Path, card: Path, blank: Result) -> Result:
    """The first model of a machine."""
    found = identify_logs(read_sources([str(path)], str(card)).logs, seed=item.seed)
    document = model_document(found.model)
    out = replace(blank, model=document, made=Candidate(document))
    if found.model.fit.adequate:
        return replace(out, verdict="identified", reason="the machine's first model")
    chi = found.model.fit.chi_square
    reason = f"the model leaves more than noise (chi-square {chi:.3g}); run 'workbench trace'"
    return replace(out, verdict="inadequate", reason=reason)


def _judged(item: Item, path: Path, card: Path, blank: Result) -> Result:
    """The log against the active version: drift test, and where it has drifted the chain anew."""
    log = item.log
    seen = SeenLog(blank.sha256, path.name, log.size, log.mtime_ns)
    task = Task(log.machine, card, path, seen, item.version, item.model, item.design, item.previous)
    found = Chain(seed=item.seed)(task)
    model = None if found.candidate is None else found.candidate.model
    return replace(blank, verdict=found.verdict, reason=found.reason, model=model,
                   made=found.candidate, rival=found.rival, evidence=found.evidence)  # fmt: skip


def _named(error: BaseException, path: Path, card: Path, item: Item) -> str:
    """The error's line with the log's own name, whatever file it was read from."""
    text = said(error).replace(str(path), item.log.name).replace(str(card), CARD_FILE)
    return text if item.log.name in text else f"{item.log.name}: {text}"
