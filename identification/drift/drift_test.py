"""Drift test of one new log against the model in force: has the machine changed, and in what?

The log's own parameters come from its fit, begun from the model in force (`log_estimate`). Their
change counts by how far it lies beyond a practical margin, in the covariance of everything that is
unsure: the log's fit, the model's fit, and how much the machine varies from log to log anyhow. A
second statistic over the logs since the model was put in force (`mewma`) finds what changes slowly.
A log that no parameters bring the model to follow is said to have another structure; that is no
drift.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.stats import chi2, norm

from identification.arrays import Array
from identification.drift.log_estimate import LogEstimate, estimate_log
from identification.drift.mewma import (
    DriftState,
    Mean,
    chart_limit,
    fresh_state,
    mean_change,
    taken_in,
    variation,
)
from identification.drift.practical_margin import explained_change, moved
from identification.drift.reference_model import InForce
from identification.errors import BadSpecification, NotIdentifiable
from identification.log import Log

DriftVerdict = Literal["none", "drift", "structure", "not_judged"]
FoundBy = Literal["log", "mean"]
Z_95 = float(norm.isf(0.025))


@dataclass(frozen=True)
class DriftSettings:
    """What counts as drift.

    margin: relative change that does not matter; run_length: logs without drift up to a false
    alarm, at least, on average; smoothing: weight of the newest log in the mean over logs;
    variation: relative standard deviation of a parameter from log to log, stated until the
    machine's own logs show it; widest: relative deviation of a change from which a log does not
    judge a parameter. Raises BadSpecification.
    """

    margin: float = 0.02
    run_length: float = 1000.0
    smoothing: float = 0.2
    variation: float = 0.01
    widest: float = 0.25

    def __post_init__(self) -> None:
        for name, value in (("margin", self.margin), ("variation", self.variation)):
            if not 0.0 <= value < 1.0:
                raise BadSpecification(f"{name} = {value:g}, must lie from 0 to below 1")
        if not (np.isfinite(self.run_length) and self.run_length >= 10.0):
            raise BadSpecification(f"run_length = {self.run_length:g} logs, at least 10 needed")
        if not 0.01 <= self.smoothing <= 1.0:
            raise BadSpecification(f"smoothing = {self.smoothing:g}, must lie from 0.01 to 1")
        if not self.widest > 0.0:
            raise BadSpecification(f"widest = {self.widest:g}, must be > 0")


@dataclass(frozen=True)
class Shift:
    """A parameter before (model in force) and after (this log, or the mean of the last logs).

    change: relative to the model's value, with its standard deviation and 95 % interval, in which
    the model's error, the log's and the machine's variation from log to log are.
    """

    name: str
    unit: str
    before: float
    before_sd: float
    after: float
    after_sd: float
    change: float
    sd: float
    low: float
    high: float


@dataclass(frozen=True)
class Statistic:
    """A test's value and threshold; p_value: chance of as much without drift, at most."""

    value: float
    threshold: float
    p_value: float
    parameters: int

    @property
    def alarm(self) -> bool:
        """Whether the value lies above the threshold."""
        return self.value > self.threshold


@dataclass(frozen=True)
class DriftTest:
    """The verdict on one log.

    verdict: "none", "drift" (`moved` names the fewest parameters that explain it), "structure"
    (no parameters of the model's structure follow the log), "not_judged" (`reason` says why).
    shifts: every judged parameter on this log; not_judged: the others, with the reason; single,
    mean: the statistic of this log and of the mean over logs, None where nothing is judged;
    found_by: which of them alarmed. chi_square: what the log's own refit leaves; allowed: up to
    which the structure fits. state: to be given with the next log.
    """

    log: str
    verdict: DriftVerdict
    moved: tuple[Shift, ...]
    shifts: Mapping[str, Shift]
    not_judged: Mapping[str, str]
    single: Statistic | None
    mean: Statistic | None
    found_by: FoundBy | None
    chi_square: float | None
    allowed: float | None
    reason: str
    state: DriftState


def drift_test(
    model: InForce,
    log: Log,
    rng: np.random.Generator,
    *,
    state: DriftState | None = None,
    settings: DriftSettings | None = None,
) -> DriftTest:
    """The verdict on a new log, and the state to be given with the next one.

    state: what the log before gave; None, or of another model, begins anew. Raises BadLog where
    a signal is missing.
    """
    settings = settings or DriftSettings()
    if state is None or state.model != model.key or state.names != model.names:
        state = fresh_state(model.key, model.names)
    try:
        found = estimate_log(model, log, rng)
    except NotIdentifiable as error:
        return _silent(log.name, "not_judged", str(error), {}, None, state)
    if not found.follows:
        reason = (
            f"{log.name}: no parameters of the model's structure follow this log (chi-square"
            f" {found.chi_square:.3g}, at most {found.allowed:.3g} allowed); trace it"
        )
        return _silent(log.name, "structure", reason, {}, found, state)
    return judged_estimate(model, found, log.name, state, settings)


def judged_estimate(
    model: InForce, found: LogEstimate, log: str, state: DriftState, settings: DriftSettings
) -> DriftTest:
    """The verdict on a log whose parameters have been estimated."""
    change, own = _relative(model, found)
    in_force = model.covariance / np.outer(model.scales, model.scales)
    varied = variation(state, settings.variation)
    covariance = own + in_force + np.diag(varied)
    reasons = _not_judged(model, found, log, covariance, settings)
    told = np.array([name not in reasons for name in model.names])
    if not np.any(told):
        why = f"{log}: it tells none of the model's parameters; " + next(iter(reasons.values()), "")
        return _silent(log, "not_judged", why, reasons, found, state)
    at = np.flatnonzero(told)
    here = Mean(
        tuple(int(i) for i in at), change[at], covariance[np.ix_(at, at)],
        np.full(len(at), settings.margin),
    )  # fmt: skip
    single = _statistic(here, float(chi2.isf(0.5 / settings.run_length, len(at))))
    after = taken_in(state, change, own, told, settings.smoothing, varied)
    over = mean_change(after, in_force, settings.margin)
    mean = _statistic(
        over, chart_limit(len(over.at), settings.smoothing, 2.0 * settings.run_length)
    )
    by: FoundBy | None = "log" if single.alarm else ("mean" if mean.alarm else None)
    which = _moved(model, over if by == "mean" else here, here) if by else ()
    return DriftTest(
        log=log,
        verdict="drift" if by else "none",
        moved=which,
        shifts=_shifts(model, here),
        not_judged=reasons,
        single=single,
        mean=mean,
        found_by=by,
        chi_square=found.chi_square,
        allowed=found.allowed,
        reason="",
        # A jump would stay in the mean long after it has been repaired.
        state=state if single.alarm else after,
    )


def _relative(model: InForce, found: LogEstimate) -> tuple[Array, Array]:
    """Change (d,) of the model's parameters in their scales, positive where the size grows, and
    its covariance (d, d); parameters that the log lacks are without a bound."""
    sign = np.where(model.values < 0, -1.0, 1.0)
    factor = sign / model.scales
    place = {name: i for i, name in enumerate(found.names)}
    d = len(model.names)
    change, covariance = np.zeros(d), np.zeros((d, d))
    at = [(i, place[name]) for i, name in enumerate(model.names) if name in place]
    rows, columns = [i for i, _ in at], [k for _, k in at]
    change[rows] = (found.values[columns] - model.values[rows]) * factor[rows]
    outer = np.outer(factor, factor)
    covariance[np.ix_(rows, rows)] = (
        found.covariance[np.ix_(columns, columns)] * outer[np.ix_(rows, rows)]
    )
    return change, covariance


def _not_judged(
    model: InForce, found: LogEstimate, log: str, covariance: Array, settings: DriftSettings
) -> dict[str, str]:
    """Parameters that this log cannot be judged by, with the reason."""
    out: dict[str, str] = {}
    for i, name in enumerate(model.names):
        sd = float(np.sqrt(covariance[i, i]))
        if name in model.untold:
            out[name] = f"the model in force does not tell it ({model.untold[name]})"
        elif name not in found.names:
            out[name] = found.untold.get(name, f"{log}: not among what this log tells")
        elif name in found.untold:
            out[name] = found.untold[name]
        elif not sd <= settings.widest:
            out[name] = (
                f"{log}: a change of it is known to {100 * sd:.2g} % only, at most"
                f" {100 * settings.widest:.2g} % needed; excite it more, or log for longer"
            )
    return {**{n: r for n, r in model.untold.items() if n not in model.names}, **out}


def _statistic(found: Mean, threshold: float) -> Statistic:
    square = found.distance.square
    return Statistic(square, threshold, float(chi2.sf(square, len(found.at))), len(found.at))


def _moved(model: InForce, found: Mean, here: Mean) -> tuple[Shift, ...]:
    """The fewest parameters that explain the change, largest first, by how much on this log.

    The mean over the logs, where that found it, lags behind what drifts: it names the parameters,
    and sizes them only where this log does not judge them or shows less.
    """
    names = {found.at[k] for k in moved(found.change, found.covariance, found.margin)}
    size_here = dict(zip(here.at, np.abs(here.change).tolist(), strict=True))
    size_mean = dict(zip(found.at, np.abs(found.change).tolist(), strict=True))
    sized = here if all(size_here.get(i, 0.0) >= size_mean[i] for i in names) else found
    chosen = tuple(k for k, i in enumerate(sized.at) if i in names)
    size, covariance = explained_change(sized.change, sized.covariance, sized.margin, chosen)
    out = [
        _shift(model, sized.at[k], float(size[n]), float(np.sqrt(covariance[n, n])))
        for n, k in enumerate(chosen)
    ]
    return tuple(sorted(out, key=lambda one: -abs(one.change)))


def _shifts(model: InForce, found: Mean) -> dict[str, Shift]:
    """Every judged parameter by itself."""
    sd = np.sqrt(np.diag(found.covariance))
    return {
        model.names[i]: _shift(model, i, float(found.change[k]), float(sd[k]))
        for k, i in enumerate(found.at)
    }


def _shift(model: InForce, i: int, change: float, sd: float) -> Shift:
    scale = float(model.scales[i])
    before = float(model.values[i])
    sign = -1.0 if before < 0 else 1.0
    name = model.names[i]
    return Shift(
        name=name,
        unit=model.units[name],
        before=before,
        before_sd=float(np.sqrt(model.covariance[i, i])),
        after=before + sign * scale * change,
        after_sd=scale * sd,
        change=change,
        sd=sd,
        low=change - Z_95 * sd,
        high=change + Z_95 * sd,
    )


def _silent(
    log: str, verdict: DriftVerdict, reason: str, not_judged: Mapping[str, str],
    found: LogEstimate | None, state: DriftState,
) -> DriftTest:  # fmt: skip
    """A verdict without changes; the state stays as it was."""
    return DriftTest(
        log, verdict, (), {}, dict(not_judged), None, None, None,
        found.chi_square if found else None, found.allowed if found else None, reason, state,
    )  # fmt: skip
