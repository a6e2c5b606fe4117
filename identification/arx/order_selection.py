"""Order and delay of an ARX model by validation.

One factor of the largest model on the estimation runs gives every smaller model, and one on the
validation runs its one-step error there, so all orders together cost two passes over the data.

Which of them is taken: a superfluous coefficient lowers the one-step error on n held-out samples
by chance by less than z^2/n of it (maximum over q of `2 z sqrt(q/(n N)) - q/N`, N fitted samples),
so among the models within z^2/n of the best the one with the fewest coefficients is taken, z = 4. n
is the number of independent samples: fewer than the samples where the best model's errors are
correlated. The simulation error has no such scale; it may be asked for as the criterion where the
model is to run freely, with errors that are correlated over the plant's memory.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from identification.arrays import Array
from identification.arx.model import (
    ArxModel,
    Run,
    Runs,
    arx_of_factor,
    as_runs,
    factor_of,
    one_step_errors,
    simulation_errors,
)
from identification.arx.qr_factor import Factor, Order
from identification.arx.residual_tests import effective_samples
from identification.errors import BadLog, BadModel, NotIdentifiable

Criterion = Literal["one-step", "simulation"]
SIGMAS = 4.0
# Errors below this part of y are rounding, not differences between models.
ROUNDING_SHARE = 1e-12


@dataclass(frozen=True)
class ArxCandidate:
    """One model tried, its errors on the validation runs in units of y; NaN: not simulated."""

    model: ArxModel
    one_step_rms: float
    simulation_rms: float

    @property
    def size(self) -> int:
        """Coefficients na + nb."""
        return self.model.na + self.model.nb


@dataclass(frozen=True)
class ArxChoice:
    """The model taken and what it was taken from.

    best_of_size: for each number of coefficients the best model by one-step error, simulated too.
    tolerance: relative difference of squared errors that counts as none. samples, independent:
    of the validation runs, the second by the correlation of the best model's errors.
    """

    model: ArxModel
    one_step_rms: float
    simulation_rms: float
    criterion: Criterion
    best_of_size: tuple[ArxCandidate, ...]
    tried: int
    tolerance: float
    samples: int
    independent: float


@dataclass(frozen=True)
class OrderRange:
    """Orders to choose from: up to max_na, max_nb coefficients, min_nk to max_nk samples of delay.

    Raises BadModel where there are none.
    """

    max_na: int = 6
    max_nb: int = 6
    max_nk: int = 10
    min_nk: int = 0

    def __post_init__(self) -> None:
        if not 0 <= self.min_nk <= self.max_nk or self.max_na < 0 or self.max_nb < 0:
            raise BadModel(
                f"orders up to na={self.max_na}, nb={self.max_nb} and delays {self.min_nk} to"
                f" {self.max_nk}; none may be negative, and the delays must rise"
            )

    @property
    def largest(self) -> Order:
        """The order that holds all of them; raises BadModel where it has no coefficient."""
        nb = self.max_nk - self.min_nk + self.max_nb if self.max_nb else 0
        return Order(self.max_na, nb, self.min_nk)

    def __iter__(self) -> Iterator[Order]:
        for na in range(self.max_na + 1):
            if na:
                yield Order(na, 0, self.min_nk)
            for nb in range(1, self.max_nb + 1):
                for nk in range(self.min_nk, self.max_nk + 1):
                    yield Order(na, nb, nk)


USUAL_ORDERS = OrderRange()


def select_arx(
    logs: Runs,
    validation: Runs | None,
    h: float,
    *,
    orders: OrderRange = USUAL_ORDERS,
    split: float = 0.6,
    offset: bool = False,
    criterion: Criterion = "one-step",
) -> ArxChoice:
    """The smallest ARX model within noise of the best on validation runs; h [s].

    validation: runs held out; None holds out the last `1 - split` of every run. The model is
    fitted on the estimation runs alone. Raises BadLog, BadModel, and NotIdentifiable where no
    order at all can be estimated.
    """
    fitted, held_out = _runs(logs, validation, split)
    largest = orders.largest
    fit, test = factor_of(fitted, largest), factor_of(held_out, largest)
    if test.rows <= largest.size:
        raise BadLog(
            f"{test.rows} validation samples after the first {largest.lag} of each run; more than "
            f"{largest.size} needed for these orders: use longer runs or lower orders"
        )
    found = list(_candidates(fit, test, orders, h, offset))
    best = min(found, key=lambda candidate: candidate.one_step_rms)
    errors = [one_step_errors(best.model, u, y) for u, y in held_out]
    independent = effective_samples(errors)
    floor = (ROUNDING_SHARE * float(np.linalg.norm(test.R[:, -1]))) ** 2 / test.rows
    shortlist = _best_of_size(found, held_out)
    if criterion == "simulation":
        best = min(shortlist, key=lambda candidate: candidate.simulation_rms)
        independent = effective_samples([simulation_errors(best.model, u, y) for u, y in held_out])
    tolerance = SIGMAS**2 / independent

    def error(candidate: ArxCandidate) -> float:
        by_simulation = criterion == "simulation"
        return (candidate.simulation_rms if by_simulation else candidate.one_step_rms) ** 2

    limit = error(best) * (1.0 + tolerance) + floor
    taken = next(c for c in shortlist if error(c) <= limit)
    return ArxChoice(
        model=taken.model,
        one_step_rms=taken.one_step_rms,
        simulation_rms=taken.simulation_rms,
        criterion=criterion,
        best_of_size=tuple(shortlist),
        tried=len(found),
        tolerance=tolerance,
        samples=test.rows,
        independent=independent,
    )


def _runs(logs: Runs, validation: Runs | None, split: float) -> tuple[list[Run], list[Run]]:
    runs = as_runs(logs)
    if validation is not None:
        return runs, as_runs(validation)
    if not 0.0 < split < 1.0:
        raise BadModel(f"split = {split}; the part of each run to fit must lie between 0 and 1")
    ends = [round(split * len(y)) for _, y in runs]
    pairs = list(zip(runs, ends, strict=True))
    return [(u[:n], y[:n]) for (u, y), n in pairs], [(u[n:], y[n:]) for (u, y), n in pairs]


def _candidates(
    fit: Factor, test: Factor, orders: OrderRange, h: float, offset: bool
) -> Iterator[ArxCandidate]:
    refusal: NotIdentifiable | None = None
    count = 0
    for order in orders:
        try:
            model = arx_of_factor(fit, order, h, offset=offset)
        except NotIdentifiable as error:
            refusal = error
            continue
        count += 1
        yield ArxCandidate(model, _one_step_rms(test, order, model), float("nan"))
    if not count:
        raise refusal or BadModel("no order to choose from; let max_na or max_nb be above 0")


def _one_step_rms(test: Factor, order: Order, model: ArxModel) -> float:
    """RMS one-step error on the samples of a factor, without going back to the samples."""
    constant = [] if model.offset is None else [model.offset]
    weights = np.concatenate([constant, -model.A[1:], model.B[order.nk :][: order.nb], [-1.0]])
    errors: Array = test.R[:, test.columns(order, model.offset is not None)] @ weights
    return float(np.linalg.norm(errors) / np.sqrt(test.rows))


def _best_of_size(found: Sequence[ArxCandidate], held_out: Sequence[Run]) -> list[ArxCandidate]:
    out = []
    for size in sorted({candidate.size for candidate in found}):
        same = [candidate for candidate in found if candidate.size == size]
        best = min(same, key=lambda candidate: candidate.one_step_rms)
        out.append(
            ArxCandidate(best.model, best.one_step_rms, _simulation_rms(best.model, held_out))
        )
    return out


def _simulation_rms(model: ArxModel, runs: Sequence[Run]) -> float:
    """RMS error of a free run on each of the runs; infinite where the model runs away."""
    with np.errstate(over="ignore", invalid="ignore"):
        errors = np.concatenate([simulation_errors(model, u, y) for u, y in runs])
        rms = float(np.sqrt(np.mean(errors**2)))
    return rms if np.isfinite(rms) else float("inf")
