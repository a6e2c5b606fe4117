"""The drift test over a machine's logs as the test of new logs takes it, and what it gives.

Its state goes from log to log in the registry, with each log's result.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from pydantic import TypeAdapter, ValidationError
from scipy.stats import norm

from identification.drift.drift_result import Shift
from identification.drift.mewma import DriftState
from identification.errors import BadModel
from workbench.documents.model import Model
from workbench.logs.sources import Sources
from workbench.output import dumps, strict
from workbench.report.drift import reason_sentence
from workbench.steps.drift import Stream, detectable_sizes, drift_of, model_key

TestedDrift = Literal["none", "drift", "structure", "not_judged"]


@dataclass(frozen=True)
class Moved:
    """A parameter that has changed: its unit, active value and now, p-value of the change."""

    name: str
    unit: str
    before: float
    after: float
    p_value: float


@dataclass(frozen=True)
class Reading:
    """A parameter by one log, with its 95 % interval, beside its active value.

    change: relative to that, with its standard deviation.
    """

    name: str
    unit: str
    before: float
    after: float
    low: float
    high: float
    change: float
    sd: float


@dataclass(frozen=True)
class Drift:
    """Verdict of a test: which parameters moved, and why.

    p_value: of the smallest kind, over all parameters. unsure: parameters of which some have
    changed, and nobody can say which; could_have_seen: smallest relative change of each that would
    have been found, None where none would. state: what the same test wants to be given with the
    next log; plain JSON. parameters: what the log gave of each, moved or not.
    """

    verdict: TestedDrift
    reason: str
    moved: tuple[Moved, ...] = ()
    p_value: float | None = None
    state: Mapping[str, Any] = field(default_factory=dict)
    unsure: tuple[str, ...] = ()
    could_have_seen: Mapping[str, float | None] = field(default_factory=dict)
    parameters: tuple[Reading, ...] = ()


# A test of a new log against the active model; of the state of the log before under it, empty at
# first.
DriftJudge = Callable[[Model, Sources, np.random.Generator, Mapping[str, Any]], Drift]


def drift_by_chart(
    model: Model, sources: Sources, rng: np.random.Generator, state: Mapping[str, Any]
) -> Drift:
    """The verdict on a log alone and by the mean of those since the model is active.

    Raises BadModel where the stored state is none, or model and card are of different machines.
    """
    stream = Stream(_state(state), ()) if state else None
    seed = int(rng.integers(2**31))
    found = drift_of(model, model_key(model), sources, stream=stream, seed=seed)
    worst = [one.test for one in found.tests if one.test.verdict == found.verdict][-1]
    state_now: Any = strict(found.stream.state)
    statistics = [one for one in (worst.single, worst.mean) if one is not None]
    return Drift(
        verdict=found.verdict,
        reason=reason_sentence(worst, found.settings.to_be_seen),
        moved=tuple(_moved(one) for one in worst.moved),
        p_value=min((one.p_value for one in statistics), default=None),
        state=state_now,
        unsure=worst.unsure,
        could_have_seen=detectable_sizes(worst),
        parameters=tuple(_reading(one) for one in worst.shifts.values()),
    )


def _state(state: Mapping[str, Any]) -> DriftState:
    try:
        return TypeAdapter(DriftState).validate_json(dumps(state), strict=True)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise BadModel(f"stored drift state: {first['loc']}: {first['msg']}") from None


def _reading(shift: Shift) -> Reading:
    half = float(norm.ppf(0.975)) * shift.after_sd
    low, high = shift.after - half, shift.after + half
    return Reading(
        shift.name, shift.unit, shift.before, shift.after, low, high, shift.change, shift.sd
    )


def _moved(shift: Shift) -> Moved:
    p_value = float(2.0 * norm.sf(abs(shift.change) / shift.sd)) if shift.sd > 0 else 0.0
    return Moved(shift.name, shift.unit, shift.before, shift.after, p_value)
