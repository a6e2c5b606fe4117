"""The process that runs one case of `real`: lines of JSON, each of which holds the one before.

    python -m benchmarks.real_child NAME LIMIT look|identify|trace|both|said|promise

look: init, doctor and yardstick; identify: these and the fit; trace: the yardstick and the trace.
said: what is reported of the first log before a fit, alone, and of all logs; promise: this and what
`identify` then tells (see `promises`); with `_of_test` behind it, of the held-out logs.
LIMIT: processor time [s], after which the system ends the process; a trace is asked to end a little
before, as by `--budget`. Everything is asked through the functions behind the commands.
"""

import json
import resource
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from benchmarks.real_cases import Case, Prepared, every_case, prepared
from benchmarks.real_shares import model_run, model_share, window_of
from benchmarks.yardstick import Fit, Record, fitted, own_share, record, run_errors
from design.identified.examined import Examined
from design.identified.identifiable_by_log import identifiability_of_runs
from design.identified.identify_logs import Identified, identify_logs
from design.identified.trace_logs import trace_logs
from design.machine.model import Identifiable, Model
from identification.effects._library import built_in
from identification.errors import UserError
from identification.log import Log
from identification.model.estimates import Estimate
from identification.model.karnopp import NAMES
from identification.tracing.result import Trace
from workbench.cards.card import Card
from workbench.logs.runs import read_signals, with_force
from workbench.logs.sources import Sources, sources_of
from workbench.steps.doctor import examine
from workbench.steps.first_card.proposal import proposed

SEED = 0
SHORT, LONG = 0.2, 2.0  # s, windows of the free run
OF_TEST = "_of_test"
PROMISES = ("said", "promise", f"said{OF_TEST}", f"promise{OF_TEST}")
ROOM = 20.0  # s before the limit at which a trace is asked to end


def record_of(path: Path, card: Card) -> Record:
    """The file as the yardstick has it: the columns as they stand, on an even clock."""
    raw, _ = read_signals(path, card)
    log = with_force(raw, path, card)
    key = "u" if card.rig(path.name).kind == "motor" else "F"
    others = {k: x for k, x in log.signals.items() if k not in ("t", "y", key, "F")}
    return record(log["t"], log["y"], log[key], others)


def by_yardstick(
    case: Case, train: Sequence[Record], test: Sequence[Record], measured: str
) -> dict[str, Any]:
    """What least squares leave, and the fit itself; measured: F, or u of a motor."""
    fit = fitted(train, case.terms)
    if fit is None:
        return {"refused": "too little slides"}
    out = {
        "share": own_share(test, fit), "train": fit.share, "values": dict(fit.values),
        "width": fit.width, "lag": fit.lag, "h": train[0].h,
        "measured": measured,
    }  # fmt: skip
    if not case.prescribed:
        out |= {f"run_{s:g}": run_errors(test, fit, window_of(test[0], s)) for s in (SHORT, LONG)}
    return out | {"fit": fit}


def judged_model(
    case: Case, model: Model, test: Sequence[Record], fit: Fit | None,
    read: Sequence[Sequence[Log]],
) -> dict[str, Any]:  # fmt: skip
    """Parameters of a model, what it leaves on the held-out records, and its free runs."""
    numbers: dict[str, Estimate] = {name: model.friction[name] for name in NAMES}
    for key, params in model.effects.items():
        numbers |= {f"{key}.{name}": one for name, one in params.items()}
    out: dict[str, Any] = {
        "parameters": {
            name: {"value": one.value, "low": one.low, "high": one.high, "reason": one.reason}
            for name, one in numbers.items()
        },
        "remarks": list(model.fit.remarks),
    }
    try:
        out["share"] = model_share(model, test, fit, read) if fit else None
        if not case.prescribed:
            out |= {f"run_{s:g}": model_run(model, test, s) for s in (SHORT, LONG)}
    except UserError as error:
        out["inconclusive"] = str(error)
    return out


def named_in(found: Trace) -> list[str]:
    """The effects of a trace, with what acts beside the force and a second mass."""
    beside = found.surroundings
    keys = [one.effect.key for one in found.effects] + [one.key for one in beside.effects]
    keys += ["two_masses"] if beside.resonance is not None else []
    return list(dict.fromkeys(keys))


def doctor_answer(found: Examined) -> dict[str, Any]:
    """What the doctor says, as far as it is judged."""
    identifiable = [f"{one.name}: {one.why} {one.add}" for one in found.identifiability]
    bad = [json.dumps(one.as_json(), default=str) for one in found.bad]
    return {
        "delays": {one.of: one.seconds for one in found.delays},
        "rested": None if found.ways is None else found.ways.rested,
        "duration": found.clock.duration,
        "text": "\n".join([found.refused, *found.remarks, *identifiable, *bad]),
    }


def said_answer(identifiable: Sequence[Identifiable], refused: str) -> dict[str, Any]:
    """What is said of each parameter before a fit."""
    said = {
        one.name: {"can": one.can, "why": one.why, "only_if": one.only_if} for one in identifiable
    }
    return {"refused": refused, "identifiable": said}


def kept_answer(found: Identified) -> dict[str, Any]:
    """What a fit tells of each parameter."""
    every = {**found.model.friction, **(found.model.actuator or {})}
    return {
        "kept": {name: {"value": one.value, "sd": one.sd, "why": one.reason}
                 for name, one in every.items()},
        "adequate": found.model.fit.adequate,
        "remarks": list(found.model.fit.remarks),
    }  # fmt: skip


def init_answer(path: Path) -> dict[str, Any]:
    """The card that init proposes."""
    found = proposed(path)
    shown = {one.name: [one.shown.strip("' "), str(one.column).strip()] for one in found.signals}
    return {"kind": found.kind, "motion": found.motion, "signals": shown,
            "units": {one.name: one.unit for one in found.signals},
            "remarks": list(found.remarks)}  # fmt: skip


def tried(work: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """An answer with its processor time; or what was refused, or the fault."""
    begin = time.process_time()
    try:
        out = work()
    except UserError as error:
        out = {"refused": f"{type(error).__name__}: {error}"}
    except Exception:
        out = {"fault": traceback.format_exc()}
    return {**out, "seconds": time.process_time() - begin}


class Answers:
    """The answers to a case, said after each."""

    def __init__(self, case: Case) -> None:
        self.out: dict[str, Any] = {"case": case.name, "group": case.group, "array": case.array}

    def ask(self, what: str, work: Callable[[], dict[str, Any]]) -> dict[str, Any]:
        """One more answer; `fit` in it is kept out of what is said."""
        found = tried(work)
        self.out[what] = {k: x for k, x in found.items() if k != "fit"}
        print(json.dumps(self.out, default=str), flush=True)
        return found


def promise(answers: Answers, ready: Prepared, card: Card, part: str) -> None:
    """What is said before a fit, and what the fit tells: of the first log alone, and of all."""
    paths = ready.test if part.endswith(OF_TEST) else ready.train
    first, every = [str(paths[0])], [str(path) for path in paths]

    def said() -> dict[str, Any]:
        found = examine(paths[0], card)
        return said_answer(found.identifiability, found.refused)

    def said_of_all() -> dict[str, Any]:
        read = sources_of(every, card)
        found = identifiability_of_runs([one.log for one in read.runs], read.rig)
        return said_answer(found.identifiability, found.reason)

    def kept(asked: Sequence[str]) -> dict[str, Any]:
        return kept_answer(identify_logs(sources_of(asked, card).logs, seed=SEED))

    several = len(every) > 1
    answers.ask("said_alone", said)
    if several:
        answers.ask("said_all", said_of_all)
    if part.startswith("promise"):
        answers.ask("alone", lambda: kept(first))
        if several:
            answers.ask("all", lambda: kept(every))


def run(case: Case, ready: Prepared, limit: float, part: str) -> None:
    """Asks everything of a case."""
    answers, card = Answers(case), ready.card
    if case.right.init is not None and part not in ("trace", *PROMISES):
        answers.ask("init", lambda: init_answer(ready.train[0]))
    if card is None:
        return
    if part in PROMISES:
        promise(answers, ready, card, part)
        return
    if part != "trace":
        answers.ask("doctor", lambda: doctor_answer(examine(ready.train[0], card)))
    train = [record_of(path, card) for path in ready.train]
    test = [record_of(path, card) for path in ready.test]
    measured = "u" if card.rig().kind == "motor" else "F"
    least = answers.ask("yardstick", lambda: by_yardstick(case, train, test, measured))
    fit: Fit | None = least.get("fit")
    sources: Sources | None = None

    def read_apart() -> list[list[Log]]:
        """The runs of each test file, as the workbench reads it."""
        every = [sources_of([str(path)], card).runs for path in ready.test]
        return [[one.log for one in runs] for runs in every]

    def identified() -> dict[str, Any]:
        nonlocal sources
        sources = sources_of([str(path) for path in ready.train], card)
        model = identify_logs(sources.logs, seed=SEED).model
        return judged_model(case, model, test, fit, read_apart())

    def traced() -> dict[str, Any]:
        read = sources or sources_of([str(path) for path in ready.train], card)
        held_out = sources_of([str(path) for path in ready.test], card)
        found = trace_logs(
            read.logs, held_out.logs, built_in(), SEED,
            keep_going=lambda: time.process_time() < limit - ROOM,
        )  # fmt: skip
        return {
            "verdict": found.trace.verdict,
            "effects": named_in(found.trace),
            "probability": {e.effect.key: e.probability for e in found.trace.effects},
            "rivals": [one.key for one in found.trace.rivals],
            "depends_on": list(found.trace.unknown.depends_on),
            "drift": [one.name for one in found.trace.drift],
            "not_tried": list(found.trace.not_tried),
            **judged_model(case, found.model, test, fit, read_apart()),
        }

    if part in ("identify", "both"):
        answers.ask("identify", identified)
    if part in ("trace", "both"):
        answers.ask("trace", traced)


def main() -> None:
    """Answers the case of the command line."""
    name, limit, part = sys.argv[1], float(sys.argv[2]), sys.argv[3]
    most = round(limit)
    resource.setrlimit(resource.RLIMIT_CPU, (most, most + 1))
    case = next(one for one in every_case() if one.name == name)
    with tempfile.TemporaryDirectory() as work:
        run(case, prepared(case, Path(work)), limit, part)


if __name__ == "__main__" and len(sys.argv) == 4:
    main()
