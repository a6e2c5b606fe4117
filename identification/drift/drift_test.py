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

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2, norm

from identification.arrays import Array
from identification.drift.drift_result import Z_95, DriftTest, FoundBy, Shift, Statistic
from identification.drift.log_estimate import LogEstimate, allowed_misfit, estimate_log
from identification.drift.mewma import (
    DriftState,
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

    state: what the log before gave of this model; None begins anew. Raises BadLog where a signal is
    missing.
    """
    state = state or fresh_state(model.key, model.names)
    try:
        found = estimate_log(model, log, rng)
    except NotIdentifiable as error:
        return DriftTest("not_judged", state, str(error))
    return estimate_under_test(model, found, log.name, state, settings or DriftSettings())


def estimate_under_test(
    model: ReferenceModel, found: LogEstimate, log: str, state: DriftState, settings: DriftSettings
) -> DriftTest:
    """The verdict on a log whose parameters have been estimated."""
    allowed, misfit = allowed_misfit(model.chi_square), own_misfit(model)
    untested = DriftTest("not_judged", state, chi_square=found.chi_square, allowed=allowed)
    if not (found.as_usual or found.chi_square <= allowed):
        why = (
            f"{log}: no parameters of the model's structure follow this log (chi-square"
            f" {found.chi_square:.3g}, at most {allowed:.3g} allowed); trace it"
        )
        return replace(untested, verdict="structure", reason=why)
    if misfit.has_lost_its_way(found.chi_square):
        why = (
            f"{log}: its fit leaves {found.chi_square:.3g}, fits of the model's own logs at most"
            f" {misfit.left:.3g}: it has lost its way, and says nothing of the parameters; log"
            " another run, or trace this one"
        )
        return replace(untested, reason=why)
    own = misfit.of_log(found.covariance, found.chi_square)
    of_model = misfit.of_model(model.relative_covariance)
    varied = variation(state, settings.variation)
    sd = np.sqrt(np.diag(own + of_model) + varied)
    reasons = _inconclusive(model, found, log, sd, settings.widest)
    untested = replace(untested, inconclusive=reasons)
    identifiable = np.array([name not in reasons for name in model.names])
    if not np.any(identifiable):
        first = next(iter(reasons.values()), "")
        why = f"{log}: none of the model's parameters is identifiable; {first}"
        return replace(untested, reason=why)
    at = np.flatnonzero(identifiable)
    here = LogChange(
        tuple(model.names[i] for i in at), found.change[at], (own + of_model)[np.ix_(at, at)],
        varied[at], settings.margin,
    )  # fmt: skip
    after = taken_in(state, found.change, own, identifiable, settings.smoothing, varied)
    over = mean_change(after, of_model, settings.margin)
    return _tested(untested, model, log, here, over, after, settings)


def _tested(
    untested: DriftTest, model: ReferenceModel, log: str, here: LogChange, over: Change,
    after: DriftState, settings: DriftSettings,
) -> DriftTest:  # fmt: skip
    """What the three statistics say; after: the state with this log taken in.

    Half of the false alarms are the mean's, a quarter each of the others'. A run without one is the
    longer for it that means of neighbouring logs go together (Royen, Far East J. Theor. Stat. 48
    (2014) 139: the chance that no log alarms is at least the product of each one's).
    """
    d, quarter = len(here.names), 0.25 / settings.run_length
    largest = float(np.max(here.alone) ** 2)
    p_value = min(1.0, d * float(chi2.sf(largest, 1)))
    alone = Statistic(largest, float(chi2.isf(quarter / d, 1)), p_value, d)
    single, mean = _statistic(here.nearer, quarter), _statistic(over, 2.0 * quarter)
    by: FoundBy | None = "mean" if mean.alarm else None
    if single.alarm or alone.alarm:
        by = "log"
    found, shifts = over if by == "mean" else here.nearer, _shifts(model, here.beyond_usual)
    moved, unsure = _moved(found, shifts, _shifts(model, found)) if by else ((), ())
    by_mean = detectable_together(over, mean.threshold).tolist()
    lasting = dict(zip(over.names, by_mean, strict=True))
    of_log = here.detectable(alone.threshold, single.threshold).tolist()
    seen = {n: min(size, lasting[n]) for n, size in zip(here.names, of_log, strict=True)}
    coarse = "" if by else too_coarse(model, seen, log, settings)
    return replace(
        untested,
        verdict="drift" if by else ("not_judged" if coarse else "none"),
        # A jump would stay in the mean long after it has been repaired.
        state=untested.state if by == "log" else after,
        reason=coarse,
        moved=moved,
        unsure=unsure,
        shifts=shifts,
        could_have_seen=seen,
        single=single,
        alone=alone,
        mean=mean,
        found_by=by,
    )


def _statistic(found: Change, chance: float) -> Statistic:
    """Of all parameters together, with the chance of a false alarm."""
    d, square = len(found.names), found.square
    return Statistic(square, float(chi2.isf(chance, d)), float(chi2.sf(square, d)), d)


def too_coarse(
    model: ReferenceModel, seen: Mapping[str, float], log: str, settings: DriftSettings
) -> str:
    """Why "none" cannot be said of a log without an alarm; "" where it can.

    Friction that changes shows in the Coulomb levels first: every one that the model identifies has
    to be seen, or of a model with neither at least one parameter.
    """
    limit = settings.to_be_seen
    asked = [name for name in COULOMB_NAMES if name in model.names]
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
    out = dict(model.not_identifiable)
    for name, sd in zip(model.names, deviations, strict=True):
        if name in found.not_identifiable:
            out[name] = found.not_identifiable[name]
        elif not sd <= widest:
            out[name] = (
                f"{log}: a change of it is known to {100 * sd:.2g} % only, at most"
                f" {100 * widest:.2g} % needed; excite it more, or log for longer"
            )
    return out


def _moved(
    found: Change, here: Mapping[str, Shift], mean: Mapping[str, Shift]
) -> tuple[tuple[Shift, ...], tuple[str, ...]]:
    """Parameters that surely changed, largest first; and the names of those that may have.

    By how much on this log; or by the mean over the logs, which lags behind what drifts, where this
    log is inconclusive on one of them or shows less.
    """
    sure, unsure = found.discriminated(found.moved())
    names, log = [found.names[k] for k in sure], here
    if any(n not in here or abs(here[n].change) < abs(mean[n].change) for n in names):
        log = mean
    shifts = tuple(sorted((log[n] for n in names), key=lambda one: -abs(one.change)))
    return shifts, tuple(found.names[k] for k in unsure)


def _shifts(model: ReferenceModel, found: Change) -> dict[str, Shift]:
    """Every tested parameter by itself."""
    sd = np.sqrt(np.diag(found.covariance)).tolist()
    each = zip(found.names, found.change.tolist(), sd, strict=True)
    return {name: _shift(model, name, *one) for name, *one in each}


def _shift(model: ReferenceModel, name: str, change: float, sd: float) -> Shift:
    """The shift of a parameter, of relative change and deviation."""
    i = model.names.index(name)
    before, scale = float(model.values[i]), float(model.scales[i])
    after, after_sd = before + (-scale if before < 0 else scale) * change, scale * sd
    return Shift(
        name, model.units[name], before, float(np.sqrt(model.covariance[i, i])), after, after_sd,
        low=after - Z_95 * after_sd, high=after + Z_95 * after_sd, change=change, sd=sd,
        p_value=float(2.0 * norm.sf(abs(change) / sd)),
    )  # fmt: skip
