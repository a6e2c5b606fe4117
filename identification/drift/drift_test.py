"""Drift test of one new log against the active model: has the machine changed, and in what?

The log's own parameters come from its fit, begun from the active model (`log_estimate`). Their
change counts by how far it lies beyond a practical margin, and beyond how much the machine varies
from log to log anyhow, in the covariance of everything that is unsure: the log's fit and the
model's (`single_log`). How sure both are is estimated by the model's own logs where it left more
than noise of them (`own_misfit`): a machine that it never followed has not changed for that. A
second statistic over the logs since the model became active (`mewma`) finds what changes slowly.

A log that no parameters bring the model to follow is said to have another structure; that is no
drift. "None" is said only where the test could have seen a change that matters of the Coulomb
levels; else the log is inconclusive.
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
    Mean,
    chart_limit,
    fresh_state,
    mean_change,
    taken_in,
    variation,
)
from identification.drift.own_misfit import own_misfit
from identification.drift.practical_margin import discriminated, explained_change, moved
from identification.drift.reference_model import COULOMB, ReferenceModel
from identification.drift.single_log import LogChange, detectable_alone, detectable_together
from identification.errors import BadSpecification, NotIdentifiable
from identification.log import Log
from identification.model.karnopp import NAMES
from identification.thresholds import SEEN, SEEN_MARGINS, VANISHED

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
        return max(SEEN, SEEN_MARGINS * self.margin)


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
    change, own, _ = relative_change(model, found)
    misfit = own_misfit(model)
    if misfit.has_lost_its_way(found.chi_square):
        why = (
            f"{log}: its fit leaves {found.chi_square:.3g}, fits of the model's own logs at most"
            f" {misfit.left:.3g}: it has lost its way, and says nothing of the parameters; log"
            " another run, or trace this one"
        )
        return _silent(log, "not_judged", why, {}, found, state)
    own = misfit.of_log(own, found.chi_square)
    in_force = misfit.of_model(model.covariance / np.outer(model.scales, model.scales))
    varied = variation(state, settings.variation)
    measured = own + in_force
    reasons = _inconclusive(model, found, log, (change, measured + np.diag(varied)), settings)
    told = np.array([name not in reasons for name in model.names])
    if not np.any(told):
        first = next(iter(reasons.values()), "")
        why = f"{log}: none of the model's parameters is identifiable; {first}"
        return _silent(log, "not_judged", why, reasons, found, state)
    at = np.flatnonzero(told)
    here = LogChange(
        tuple(int(i) for i in at), change[at], measured[np.ix_(at, at)], varied[at],
        settings.margin,
    )  # fmt: skip
    after = taken_in(state, change, own, told, settings.smoothing, varied)
    over = mean_change(after, in_force, settings.margin)
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
        not_judged=reasons,
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
    over: Mean
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
        here, over = self.here, self.over
        of_log = np.min(
            [
                detectable_alone(here, self.alone.threshold),
                np.maximum(
                    detectable_together(here.beyond_margin, self.single.threshold),
                    detectable_together(here.beyond_usual, self.single.threshold),
                ),
            ],
            axis=0,
        )
        lasting = dict(zip(over.at, detectable_together(over, self.mean.threshold), strict=True))
        return {
            names[i]: float(min(size, lasting.get(i, np.inf)))
            for i, size in zip(here.at, of_log, strict=True)
        }


def _tests(here: LogChange, over: Mean, settings: DriftSettings) -> _Tests:
    """The statistics: half of the false alarms are the mean's, a quarter each of the others'."""
    d, quarter = len(here.at), 0.25 / settings.run_length
    largest = float(np.max(here.alone) ** 2)
    alone = Statistic(
        largest, float(chi2.isf(quarter / d, 1)), min(1.0, d * float(chi2.sf(largest, 1))), d
    )
    mean = _statistic(
        over, chart_limit(len(over.at), settings.smoothing, 2.0 * settings.run_length)
    )
    return _Tests(here, over, _statistic(here.nearer, float(chi2.isf(quarter, d))), alone, mean)


def at_bound(change: float) -> bool:
    """Whether a friction parameter or a mass has vanished by its fit, which none does."""
    return change <= -VANISHED


def too_coarse(
    model: ReferenceModel, seen: Mapping[str, float], log: str, settings: DriftSettings
) -> str:
    """Why "none" cannot be said of a log without an alarm; "" where it can.

    Friction that changes shows in the Coulomb levels first: every one that the model identifies has
    to be seen, or of a model with neither at least one parameter.
    """
    limit = settings.to_be_seen
    asked = [name for name in COULOMB if name in model.names and name not in model.untold]
    sizes = [seen.get(name, float("inf")) for name in asked]
    if asked and max(sizes) <= limit:
        return ""
    if not asked and min(seen.values()) <= limit:
        return ""
    names = asked or list(seen)
    said = ", ".join(
        f"{name} {100 * seen[name]:.2g} %" if name in seen else f"{name} none" for name in names
    )
    return (
        f"{log}: no alarm, but a change of {100 * limit:.3g} % is below the minimum detectable"
        f" change ({said}); log for longer, with more strokes both ways, or test the mean over more"
        " logs"
    )


def _inconclusive(
    model: ReferenceModel, found: LogEstimate, log: str, seen: tuple[Array, Array],
    settings: DriftSettings,
) -> dict[str, str]:  # fmt: skip
    """Parameters on which this log is inconclusive, with the reason; seen: the change (d,) and its
    covariance (d, d)."""
    change, covariance = seen
    out: dict[str, str] = {}
    for i, name in enumerate(model.names):
        sd = float(np.sqrt(covariance[i, i]))
        if name in model.untold:
            out[name] = f"not identified in the active model ({model.untold[name]})"
        elif name not in found.names:
            out[name] = found.untold.get(name, f"{log}: not identifiable from this log")
        elif name in found.untold:
            out[name] = found.untold[name]
        elif name in NAMES and at_bound(float(change[i])):
            out[name] = f"{log}: found next to 0, where a fit's deviation says nothing of it"
        elif not sd <= settings.widest:
            out[name] = (
                f"{log}: a change of it is known to {100 * sd:.2g} % only, at most"
                f" {100 * settings.widest:.2g} % needed; excite it more, or log for longer"
            )
    return {**{n: r for n, r in model.untold.items() if n not in model.names}, **out}


def _statistic(found: Mean, threshold: float) -> Statistic:
    square = found.distance.square
    return Statistic(square, threshold, float(chi2.sf(square, len(found.at))), len(found.at))


def _moved(
    model: ReferenceModel, found: Mean, log: LogChange
) -> tuple[tuple[Shift, ...], tuple[str, ...]]:
    """Parameters that surely changed, largest first, by how much on this log; and the names of
    those that may have.

    The mean over the logs, where that found it, lags behind what drifts: it names the parameters,
    and sizes them only where this log is inconclusive on them or shows less.
    """
    here = log.nearer
    chosen = moved(found.change, found.covariance, found.margin)
    sure, unsure = discriminated(found.change, found.covariance, found.margin, chosen)
    names = {found.at[k] for k in sure}
    size_here = dict(zip(here.at, np.abs(here.change).tolist(), strict=True))
    size_mean = dict(zip(found.at, np.abs(found.change).tolist(), strict=True))
    sized = here if all(size_here.get(i, 0.0) >= size_mean[i] for i in names) else found
    all_moved = {found.at[k] for k in chosen}
    explain = tuple(k for k, i in enumerate(sized.at) if i in all_moved)
    size, covariance = explained_change(sized.change, sized.covariance, sized.margin, explain)
    out = [
        _shift(model, sized.at[k], float(size[n]), float(np.sqrt(covariance[n, n])))
        for n, k in enumerate(explain)
        if sized.at[k] in names
    ]
    shifts = tuple(sorted(out, key=lambda one: -abs(one.change)))
    return shifts, tuple(model.names[found.at[k]] for k in unsure)


def _shifts(model: ReferenceModel, found: Mean) -> dict[str, Shift]:
    """Every tested parameter by itself."""
    sd = np.sqrt(np.diag(found.covariance))
    return {
        model.names[i]: _shift(model, i, float(found.change[k]), float(sd[k]))
        for k, i in enumerate(found.at)
    }


def _shift(model: ReferenceModel, i: int, change: float, sd: float) -> Shift:
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
