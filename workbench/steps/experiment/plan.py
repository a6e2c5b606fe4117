"""Model and limits -> the run to make next: searched, made safe, and promised."""

import numpy as np

from design.experiment.precision import looked_at, precision
from design.experiment.search import best_run
from identification.arrays import Array
from identification.errors import NotIdentifiable
from identification.progress import KeepGoing, Progress
from workbench.documents.design import Design
from workbench.documents.model import Model, versions
from workbench.steps.closed_loop import effects_left_out
from workbench.steps.experiment.drawn import drawn_plants, in_loop
from workbench.steps.experiment.machines import Bench, asked_of, bench_of
from workbench.steps.experiment.planned import (
    Experiment,
    Traces,
    Wanted,
    limits_of,
)
from workbench.steps.experiment.promise import made_safe, promised

EXPERIMENT_STAGES = {
    "segments": (0.0, 0.35),
    "sharing the time": (0.35, 0.4),
    "whole runs": (0.4, 0.8),
    "safety": (0.8, 0.85),
    "what it promises": (0.85, 1.0),
}
SEARCHED = 2  # drawn plants beside the model's, on which a search looks at every run
CHECKED = 40  # drawn plants, on which no limit may be exceeded
PROMISED = 2  # drawn plants beside the model's, whose logs are fitted
SHOWN = 12  # drawn plants in the picture


def experiment(
    model: Model, wanted: Wanted, design: Design | None, report: Progress, keep_going: KeepGoing
) -> Experiment:
    """The run that tells most of the parameters asked for, within the limits.

    design: whose recommended controller moves the machine; None: its present one. Raises BadModel
    where nothing would follow a reference, NotIdentifiable where no run within the limits tells
    anything.
    """
    limits = limits_of(model, wanted)
    bench = bench_of(model, design)
    search, draw, check, promise = np.random.default_rng(wanted.seed).spawn(4)
    plant = in_loop(model)
    plants = (plant, *drawn_plants(model, draw, CHECKED))
    machines = [bench.machine(one) for one in plants[: 1 + SEARCHED]]
    home = limits.home + np.zeros(round(1.0 / bench.loop.h))
    first = looked_at(machines[:1], home)
    if first is None:
        raise NotIdentifiable("the model's machine cannot be simulated at rest in its loop")
    asked = asked_of(model, wanted.parameters, first[1][0].names)
    criterion = precision(machines, asked)
    plan = best_run(criterion, limits, bench.loop.h, search, report, keep_going)
    report("safety", 0.0)
    r, safety = made_safe(bench, plants, plan.r, limits, check)
    promises = promised(bench, plants[: 1 + PROMISED], r, promise, report)
    seen = looked_at(machines[:1], r)
    efficiency = float(np.exp((plan.joined - plan.bound) / len(asked)))
    return Experiment(
        card=model.card,
        motion=model.rig.motion,
        command_unit=model.rig.command_unit,
        criterion="D",
        parameters=asked,
        limits=limits,
        h=bench.loop.law.h,
        controller=bench.controller,
        segments=plan.segments,
        promise=promises,
        separation=(),
        safety=safety,
        efficiency=efficiency,
        loose=seen[1][0].loose if seen else 1.0,
        tried=plan.tried,
        seed=wanted.seed,
        remarks=tuple(_remarks(model, safety.exceeding, safety.scale)),
        versions=versions(),
        r=_at_rate(r, bench),
        traces=_traces(bench, plants[: 1 + SHOWN], r),
    )


def _at_rate(r: Array, bench: Bench) -> Array:
    """The reference at the samples of the position controller."""
    return r[:: max(1, round(bench.loop.law.h / bench.loop.h))]


def _traces(bench: Bench, plants: tuple[object, ...], r: Array) -> Traces:
    runs = [bench.run(one, r) for one in plants]  # type: ignore[arg-type]
    return Traces(
        t=runs[0].t,
        r=r,
        y=np.array([one.y for one in runs]),
        v=np.array([one.v for one in runs]),
        F=np.array([one.F for one in runs]),
        u=np.array([one.u for one in runs]),
    )


def _remarks(model: Model, exceeding: int, scale: float) -> list[str]:
    out = list(model.read)
    left_out = effects_left_out(model)
    if left_out:
        out.append(left_out)
    if model.assumed:
        names = ", ".join(model.assumed)
        out.append(f"no log tells {names}: values within a third of the assumed ones were tried")
    if not model.fit.adequate:
        out.append(
            "the model leaves more than noise of its logs: what is promised holds for a machine"
            " like the model; run 'workbench trace' for what is missing"
        )
    if scale < 1.0:
        out.append(f"made smaller, to {scale:.0%}, so that no drawn machine exceeds a limit")
    if exceeding:
        out.append(f"{exceeding} drawn machines still exceed a limit: do not run it; widen the"
                   " limits or identify a better model")  # fmt: skip
    return out
