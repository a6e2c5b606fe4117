"""Model -> robust design: what it promises of the machines that there may be, and beside which."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from design.asked import RobustAsked
from design.closed_loop.driven_loop import DrivenLoop, present_loop
from design.closed_loop.loop_figures import PRESENT, references
from design.controllers.design import design, effort_limit, with_choice
from design.machine.design import Design, From, Recommendation, Recommended
from design.machine.model import Model
from design.machine.versions import versions
from design.robust.outcomes import (
    MEASURES,
    DrawnMachines,
    Motion,
    Outcomes,
    drawn_machines,
    limits_by_name,
    outcomes,
    slow_ramp,
)
from design.robust.search import Candidate, Placing, searched
from design.tune import Asked, Goals
from identification.errors import BadModel, NotIdentifiable
from identification.progress import Progress, quiet

ROBUST_STAGES = {
    "nominal design": (0.0, 0.1),
    "placing poles": (0.1, 0.3),
    "loops on a few machines": (0.3, 0.55),
    "loops on all machines": (0.55, 0.75),
    "what it promises": (0.75, 1.0),
}
MOST_BESIDE = 100  # machines on which the nominal and the present loop are shown
ROBUST = "robust"
NOMINAL = "nominal"  # the design that knows of no spread


@dataclass(frozen=True)
class Spread:
    """A measure over the machines: 5 %, median, 95 %; its limit and the share that keeps it, None
    where it has none. Infinite values are of loops that run away."""

    low: float
    median: float
    high: float
    limit: float | None
    share: float | None


@dataclass(frozen=True, eq=False)
class Promise:
    """What a loop comes to over the machines, by measure, and the share that keeps every limit."""

    controller: str
    compensator: bool
    measures: Mapping[str, Spread]
    every: float
    found: Outcomes


@dataclass(frozen=True, eq=False)
class Robust:
    """A design chosen over the machines drawn, and promises by loop: "robust", then "nominal" and
    "present" where there are such, all counted on the same machines, drawn anew.

    missed: limits that too few machines keep, in words; () where the design passes.
    """

    design: Design
    asked: RobustAsked
    promises: Mapping[str, Promise]
    tried: int
    speed: float
    missed: tuple[str, ...]
    remarks: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether each limit is kept with the probability asked for."""
        return not self.missed


def robust_design(
    model: Model,
    wanted: RobustAsked,
    asked: Asked | None = None,
    *,
    where: tuple[From | None, float | None] = (None, None),
    report: Progress = quiet,
) -> Robust:
    """The design that does best over the machines that the model's errors (and its drift) allow.

    where: the linear plant to design on and its period [s], None where they are chosen. Raises
    NotIdentifiable where the mass is not known, BadSpecification where no loop can be placed.
    """
    asked = asked or Asked()
    if model.friction["m"].value is None or where[0] == "arx":
        raise NotIdentifiable(
            "a robust design draws machines around the physical plant; none on an ARX plant"
            f" (m: {model.friction['m'].reason or 'identified'})"
        )
    goals = Goals(wanted.limits.modulus, wanted.limits.delay, effort_limit(model))
    report("nominal design", 0.0)
    nominal = design(model, asked, goals=goals, source="physical", period=where[1])
    search, anew, noise = np.random.default_rng(wanted.seed).spawn(3)
    limits = limits_by_name(wanted.limits, wanted.staircase)
    machines = drawn_machines(model, search, wanted.draws, wanted.drift)
    motion, speed = one_motion(model, nominal)
    chosen, tried = searched(
        machines, Placing(asked, goals, where[1]), motion, limits, wanted.probability, search,
        report,
    )  # fmt: skip
    judges = drawn_machines(model, anew, wanted.draws, wanted.drift)
    promises = _promises(model, judges, chosen, nominal, limits, noise, report)
    words, kept = {one.name: one.words for one in MEASURES}, promises[ROBUST]
    missed = tuple(
        f"{words[name]}: within its limit on {100 * one.share:.0f} % of the machines drawn,"
        f" {100 * wanted.probability:g} % asked"
        for name, one in kept.measures.items()
        if one.share is not None and one.share < wanted.probability
    )
    choice = Recommendation("none", False, "; ".join(missed))
    if not missed:
        why = _why(chosen, kept, wanted.draws, tried)
        choice = Recommendation(chosen.name, chosen.compensator, why)
    return Robust(
        design=with_choice(model, chosen.design, choice),
        asked=wanted,
        promises=promises,
        tried=tried,
        speed=speed,
        missed=missed,
        remarks=tuple(_remarks(model, wanted)),
    )


def one_motion(model: Model, nominal: Design, h: float | None = None) -> tuple[Motion, float]:
    """One motion for all loops: that of the nominal design's validation, and a slow ramp."""
    period = h or (nominal.force.h if nominal.force else nominal.plant.h)
    steps, smooth, _ = references(model, nominal, period)
    slow, speed = slow_ramp(model, period)
    return Motion(steps, smooth, slow), speed


def _promises(
    model: Model, machines: DrawnMachines, chosen: Candidate, nominal: Design,
    limits: dict[str, float], rng: np.random.Generator, report: Progress,
) -> dict[str, Promise]:  # fmt: skip
    """What each loop comes to on machines of which the search knew nothing."""
    loops: dict[str, tuple[Recommended, bool, DrivenLoop]] = {
        ROBUST: (chosen.name, chosen.compensator, chosen.loop(model))
    }
    own = nominal.recommendation
    if own is not None and own.controller != "none":
        one = Candidate(nominal, own.controller, own.compensator)
        loops[NOMINAL] = (one.name, one.compensator, one.loop(model))
    if model.controller is not None:
        with suppress(BadModel):  # `validate` says why
            loops[PRESENT] = ("none", False, present_loop(model, model.controller))
    seeds, few = rng.spawn(len(machines.plants)), machines.plants[:MOST_BESIDE]
    out = {}
    for i, (name, (controller, compensator, loop)) in enumerate(loops.items()):
        report("what it promises", i / len(loops))
        motion, _ = one_motion(model, nominal, loop.h)
        judges = machines if name == ROBUST else DrawnMachines(model, few)
        found = outcomes(judges, loop, motion, seeds)
        out[name] = promise_of(controller, compensator, found, limits)
    return out


def promise_of(
    controller: str, compensator: bool, found: Outcomes, limits: Mapping[str, float]
) -> Promise:
    """The outcomes as shares and quantiles."""
    within, measures = found.within(limits), dict[str, Spread]()
    for name in (one.name for one in MEASURES if one.name in found.values):
        low, middle, high = np.quantile(found.values[name], (0.05, 0.5, 0.95), method="nearest")
        share = float(np.mean(within[name])) if name in within else None
        measures[name] = Spread(float(low), float(middle), float(high), limits.get(name), share)
    every = np.all(list(within.values()), axis=0)
    return Promise(controller, compensator, measures, float(np.mean(every)), found)


def _why(chosen: Candidate, promise: Promise, draws: int, tried: int) -> str:
    """The promise as the reason of a choice."""
    called = chosen.name.upper() + (" with the compensator" if chosen.compensator else "")
    least = min((m.share for m in promise.measures.values() if m.share is not None), default=1.0)
    return (
        f"{called}: of {draws} machines drawn each limit is met by at least {100 * least:.0f} %,"
        f" all of them by {100 * promise.every:.0f} %; the best of {tried} loops tried"
    )


def _remarks(model: Model, wanted: RobustAsked) -> list[str]:
    out = []
    if model.assumed:
        names = ", ".join(model.assumed)
        out.append(f"{names}: not identifiable; drawn within a third of the assumed values")
    if wanted.drift:
        widest = max(wanted.drift, key=lambda name: (wanted.drift or {})[name])
        out.append(
            f"widened by the drift between the machine's models: {len(wanted.drift)} parameters, at"
            f" most {100 * wanted.drift[widest]:.2g} % a step ({widest})"
        )
    if model.lacks:
        out.append(f"{model.lacks}: the machine is not among those drawn")
    return out


ROBUST_SCHEMA = "robust/1"


def robust_document(found: Robust) -> dict[str, Any]:
    """robust.json: what was asked, every loop's promise and the shares that keep each limit."""
    asked = found.asked
    return {
        "schema": ROBUST_SCHEMA,
        "card": found.design.card,
        "passed": found.passed,
        "recommended": found.design.recommended,
        "compensator": bool(found.promises[ROBUST].compensator),
        "draws": asked.draws,
        "seed": asked.seed,
        "probability": asked.probability,
        "drift": dict(asked.drift or {}),
        "tried": found.tried,
        "slow_speed": found.speed,
        "loops": {
            name: {
                "controller": one.controller,
                "compensator": one.compensator,
                "every_limit": one.every,
                "measures": {key: _measure(spread) for key, spread in one.measures.items()},
            }
            for name, one in found.promises.items()
        },
        "missed": list(found.missed),
        "remarks": list(found.remarks),
        "versions": dict(versions()),
    }


def _measure(one: Spread) -> dict[str, float | None]:
    """Infinite, so null in JSON, where a loop runs away, or no delay makes it unstable."""
    return {"low": one.low, "median": one.median, "high": one.high, "limit": one.limit,
            "kept": one.share}  # fmt: skip
