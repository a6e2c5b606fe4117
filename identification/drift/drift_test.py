"""Drift test of one new log against the active model: has the machine changed, and in what?

The log's own parameters come from its fit, begun from the active model (`log_estimate`). Their
change counts by how far it lies beyond a practical margin, and beyond how much the machine varies
from log to log anyhow, in the covariance of everything that is unsure: the log's fit and the
model's (`single_log`). How sure both are is estimated by the model's own logs where it left more
than noise of them (`own_logs`): a machine that it never followed has not changed for that. A
second statistic over the logs since the model became active (`mewma`) finds what changes slowly.

A log that no parameters bring the model to follow is said to have another structure; that is no
drift. "None" is said only where the test has a minimum detectable change below one that matters of
the Coulomb levels; else the log is inconclusive.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, norm

from identification.arrays import Array
from identification.drift.drift_result import DriftTest, DriftVerdict, FoundBy, Shift, Statistic
from identification.drift.log_estimate import LogEstimate, estimate_log, relative_change
from identification.drift.mewma import (
    DriftState,
    chart_limit,
    fresh_state,
    mean_change,
    taken_in,
    variation,
)
from identification.drift.own_logs import own_misfit
from identification.drift.practical_margin import Change
from identification.drift.reference_model import ReferenceModel
from identification.drift.single_log import LogChange, detectable_together
from identification.errors import BadSpecification, NotIdentifiable
from identification.log import Log
from identification.model.karnopp import COULOMB_NAMES
from identification.thresholds import SEEN

Z_95 = float(norm.isf(0.025))


@dataclass(frozen=True)
class DriftSettings:
    """What counts as drift.

    margin: relative change that does not matter; run_length: logs without drift up to a false
    alarm, at least, on average; smoothing: weight of the newest log in the mean over logs;
    variation: relative standard deviation of a parameter from log to log, stated until the
    machine's own logs show it; widest: relative deviation of a change from which a log does not
    test a parameter. Raises BadSpecification.
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

    @property
    def to_be_seen(self) -> float:
        """Relative change that a log must be able to show, or it is inconclusive on the
        parameter."""
        return self.margin + SEEN


def drift_test(
    model: ReferenceModel,
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
    return estimate_under_test(model, found, log.name, state, settings)


def estimate_under_test(
    model: ReferenceModel, found: LogEstimate, log: str, state: DriftState, settings: DriftSettings
) -> DriftTest:
    """The verdict on a log whose parameters have been estimated."""
    change, own = relative_change(model, found)
    misfit = own_misfit(model)
    if misfit.has_lost_its_way(found.chi_square):
        why = (
            f"{log}: its fit leaves {found.chi_square:.3g}, fits of the model's own logs at most"
            f" {misfit.left:.3g}: it has lost its way, and says nothing of the parameters; log"
            " another run, or trace this one"
        )
        return _silent(log, "not_judged", why, {}, found, state)
    own = misfit.of_log(own, found.chi_square)
    of_model = misfit.of_model(model.relative_covariance)
    varied = variation(state, settings.variation)
    measured = own + of_model
    sd = np.sqrt(np.diag(measured) + varied)
    reasons = _inconclusive(model, found, log, sd, settings.widest)
    identifiable = np.array([name not in reasons for name in model.names])
    if not np.any(identifiable):
        first = next(iter(reasons.values()), "")
        why = f"{log}: none of the model's parameters is identifiable; {first}"
        return _silent(log, "not_judged", why, reasons, found, state)
    at = np.flatnonzero(identifiable)
    here = LogChange(
        tuple(at.tolist()), change[at], measured[np.ix_(at, at)], varied[at], settings.margin
    )
    after = taken_in(state, change, own, identifiable, settings.smoothing, varied)
    over = mean_change(after, of_model, settings.margin)
    tests = _tests(here, over, settings)
    by = tests.found_by
    which, unsure = _moved(model, over if by == "mean" else here.nearer, here) if by else ((), ())
    seen = tests.could_have_seen(model.names)
    coarse = "" if by else too_coarse(model, seen, log, settings)
    return DriftTest(
        log=log,
        verdict="drift" if by else ("not_judged" if coarse else "none"),
        moved=which,
        shifts=_shifts(model, here.beyond_usual),
        inconclusive=reasons,
        single=tests.single,
        mean=tests.mean,
        found_by=by,
        chi_square=found.chi_square,
        allowed=found.allowed,
        reason=coarse,
        # A jump would stay in the mean long after it has been repaired.
        state=state if by == "log" else after,
        alone=tests.alone,
        unsure=unsure,
        could_have_seen=seen,
    )


@dataclass(frozen=True, eq=False)
class _Tests:
    """The three statistics of a log: of all parameters, of the largest one, of the mean."""

    here: LogChange
    over: Change
    single: Statistic
    alone: Statistic
    mean: Statistic

    @property
    def found_by(self) -> FoundBy | None:
        """What alarms, the log itself first."""
        if self.single.alarm or self.alone.alarm:
            return "log"
        return "mean" if self.mean.alarm else None

    def could_have_seen(self, names: Sequence[str]) -> dict[str, float]:
        """Smallest change of each parameter of the log that one of the three sees."""
        here, over, square = self.here, self.over, self.single.threshold
        together = np.maximum(
            detectable_together(here.beyond_margin, square),
            detectable_together(here.beyond_usual, square),
        )
        of_log = np.minimum(here.detectable_alone(self.alone.threshold), together)
        lasting = dict(zip(over.at, detectable_together(over, self.mean.threshold), strict=True))
        return {
            names[i]: float(min(size, lasting.get(i, np.inf)))
            for i, size in zip(here.at, of_log, strict=True)
        }


def _tests(here: LogChange, over: Change, settings: DriftSettings) -> _Tests:
    """The statistics: half of the false alarms are the mean's, a quarter each of the others'."""
    d, quarter = len(here.at), 0.25 / settings.run_length
    largest = float(np.max(here.alone) ** 2)
    p_value = min(1.0, d * float(chi2.sf(largest, 1)))
    alone = Statistic(largest, float(chi2.isf(quarter / d, 1)), p_value, d)
    limit = chart_limit(len(over.at), settings.smoothing, 2.0 * settings.run_length)
    single = _statistic(here.nearer, float(chi2.isf(quarter, d)))
    return _Tests(here, over, single, alone, _statistic(over, limit))


def _statistic(found: Change, threshold: float) -> Statistic:
    d = len(found.at)
    return Statistic(found.square, threshold, float(chi2.sf(found.square, d)), d)


def too_coarse(
    model: ReferenceModel, seen: Mapping[str, float], log: str, settings: DriftSettings
) -> str:
    """Why "none" cannot be said of a log without an alarm; "" where it can.

    Friction that changes shows in the Coulomb levels first: every one that the model identifies has
    to be seen, or of a model with neither at least one parameter.
    """
    limit = settings.to_be_seen
    asked = [
        name for name in COULOMB_NAMES if name in model.names and name not in model.not_identifiable
    ]
    if max([seen.get(name, np.inf) for name in asked] or [min(seen.values())]) <= limit:
        return ""
    said = ", ".join(
        f"{name} {100 * seen[name]:.2g} %" if name in seen else f"{name} none"
        for name in asked or seen
    )
    return (
        f"{log}: no alarm, but a change of {100 * limit:.3g} % is below the minimum detectable"
        f" change ({said}); log for longer, with more strokes both ways, or test the mean over more"
        " logs"
    )


def _inconclusive(
    model: ReferenceModel, found: LogEstimate, log: str, deviations: Array, widest: float
) -> dict[str, str]:
    """Parameters on which this log is inconclusive, with the reason; deviations (d,) of their
    changes, and the widest that is allowed."""
    out: dict[str, str] = {}
    for name, sd in zip(model.names, deviations, strict=True):
        if name in model.not_identifiable:
            out[name] = f"not identified in the active model ({model.not_identifiable[name]})"
        elif name in found.not_identifiable:
            out[name] = found.not_identifiable[name]
        elif name not in found.names:
            out[name] = f"{log}: not identifiable from this log"
        elif not sd <= widest:
            out[name] = (
                f"{log}: a change of it is known to {100 * sd:.2g} % only, at most"
                f" {100 * widest:.2g} % needed; excite it more, or log for longer"
            )
    return {**{n: r for n, r in model.not_identifiable.items() if n not in model.names}, **out}


def _moved(
    model: ReferenceModel, found: Change, log: LogChange
) -> tuple[tuple[Shift, ...], tuple[str, ...]]:
    """Parameters that surely changed, largest first, by how much on this log; and the names of
    those that may have.

    The mean over the logs, where that found it, lags behind what drifts: it names the parameters,
    and sizes them only where this log is inconclusive on them or shows less.
    """
    chosen = found.moved()
    sure, unsure = found.discriminated(chosen)
    names, all_moved = ({found.at[k] for k in some} for some in (sure, chosen))
    here, mean = (
        dict(zip(one.at, np.abs(one.change).tolist(), strict=True)) for one in (log.nearer, found)
    )
    sized = log.nearer if all(here.get(i, 0.0) >= mean[i] for i in names) else found
    explain = tuple(k for k, i in enumerate(sized.at) if i in all_moved)
    size, covariance = sized.explained(explain)
    out = [
        _shift(model, sized.at[k], *each)
        for k, *each in zip(explain, size.tolist(), _deviations(covariance), strict=True)
        if sized.at[k] in names
    ]
    shifts = tuple(sorted(out, key=lambda one: -abs(one.change)))
    return shifts, tuple(model.names[found.at[k]] for k in unsure)


def _shifts(model: ReferenceModel, found: Change) -> dict[str, Shift]:
    """Every tested parameter by itself."""
    each = zip(found.at, found.change.tolist(), _deviations(found.covariance), strict=True)
    return {model.names[i]: _shift(model, i, change, sd) for i, change, sd in each}


def _deviations(covariance: Array) -> list[float]:
    return [float(sd) for sd in np.sqrt(np.diag(covariance))]


def _shift(model: ReferenceModel, i: int, change: float, sd: float) -> Shift:
    """The shift of parameter i, of relative change and deviation."""
    name, before = model.names[i], float(model.values[i])
    scale, before_sd = float(model.scales[i]), float(np.sqrt(model.covariance[i, i]))
    after = before + (-scale if before < 0 else scale) * change
    return Shift(
        name, model.units[name], before, before_sd, after, scale * sd, change, sd,
        low=change - Z_95 * sd, high=change + Z_95 * sd,
    )  # fmt: skip


def _silent(
    log: str, verdict: DriftVerdict, reason: str, inconclusive: Mapping[str, str],
    found: LogEstimate | None, state: DriftState,
) -> DriftTest:  # fmt: skip
    """A verdict without changes; the state stays as it was."""
    return DriftTest(
        log, verdict, (), {}, dict(inconclusive), None, None, None,
        found.chi_square if found else None, found.allowed if found else None, reason, state,
    )  # fmt: skip
