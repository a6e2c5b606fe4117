"""ARX models `A(z^-1) y = B(z^-1) u + c + e`: estimate, prediction, simulation."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np
from scipy.signal import lfilter, lfiltic

from identification.arrays import Array, frozen
from identification.arx.qr_factor import SMALLEST_ANGLE, ArxAccumulator, Factor, Order
from identification.errors import BadLog, BadModel, NotIdentifiable

Run = tuple[Array, Array]
Runs = Run | Sequence[Run]


@dataclass(frozen=True)
class ArxModel:
    """`y(t) = -a1 y(t-1) - .. - a_na y(t-na) + b1 u(t-nk) + .. + b_nb u(t-nk-nb+1) + c + e(t)`.

    A: `[1, a1..]`; B: in ascending powers of z^-1, `nk` zeros first (`[0]` without input).
    h: sampling period [s]. offset: c, None where it was not estimated. covariance: of
    `[a1.., b1..]`, shape (na + nb, na + nb), for white e. noise_variance: of e, by `rows` less
    coefficients. residual_rms: of the one-step error on the fitted samples; relative_error: that
    over the standard deviation of y. condition: of the regressors scaled to unit length.
    """

    A: Array
    B: Array
    na: int
    nb: int
    nk: int
    h: float
    offset: float | None
    covariance: Array
    sd_a: Array
    sd_b: Array
    sd_offset: float | None
    noise_variance: float
    residual_rms: float
    relative_error: float
    rows: int
    condition: float

    @property
    def lag(self) -> int:
        """The oldest sample that a prediction looks at."""
        return Order(self.na, self.nb, self.nk).lag


def as_runs(logs: Runs) -> list[Run]:
    """One `(u, y)` or several, as a list; the arrays themselves are not copied.

    Raises BadLog where there is none, or one is no pair.
    """
    if len(logs) == 2 and all(isinstance(part, np.ndarray) and part.ndim == 1 for part in logs):
        logs = [(np.asarray(logs[0]), np.asarray(logs[1]))]
    if len(logs) == 0:
        raise BadLog("no run to fit (0 found, at least 1 needed)")
    runs = [tuple(np.asarray(signal) for signal in run) for run in logs]
    for number, run in enumerate(runs, start=1):
        if len(run) != 2:
            raise BadLog(f"run {number}: {len(run)} signals; a run is the pair (u, y)")
    return [(run[0], run[1]) for run in runs]


def fit_arx(logs: Runs, na: int, nb: int, nk: int, h: float, *, offset: bool = False) -> ArxModel:
    """Least-squares ARX model of one run `(u, y)` or several; h [s], `offset` estimates c too.

    One pass by plain products; where the condition it finds is too high for these, a second one
    in pairs of doubles, as accurate as QR (see arx_factor). Constant memory in both.
    Raises BadLog (no numbers, lengths, too short), BadModel (orders, h), NotIdentifiable.
    """
    runs = as_runs(logs)
    for exact in (False, True):
        factor = factor_of(runs, Order(na, nb, nk), exact=exact)
        try:
            model = arx_of_factor(factor, factor.order, h, offset=offset)
        except NotIdentifiable:
            if exact:
                raise
            continue
        if factor.trusted(model.condition, model.residual_rms):
            break
    return model


def factor_of(runs: Sequence[Run], order: Order, *, exact: bool = True) -> Factor:
    """The triangular factor of all runs, for `order` and every smaller model in it."""
    accumulator = ArxAccumulator(order.na, order.nb, order.nk, exact=exact)
    for number, (u, y) in enumerate(runs):
        if number:
            accumulator.new_run()
        accumulator.update(u, y)
    return accumulator.factor()


def arx_of_factor(factor: Factor, order: Order, h: float, *, offset: bool = False) -> ArxModel:
    """The model of `order` from a factor of it or of a larger one (on the larger one's samples).

    Raises BadLog where the samples are too few, NotIdentifiable where a regressor is zero or a
    combination of the others, BadModel where h is not a positive time.
    """
    if not (isfinite(h) and h > 0.0):
        raise BadModel(f"sampling period h = {h} s; it must be positive")
    places = factor.columns(order, offset)
    R = factor.R[:, places]
    size = len(places) - 1
    if factor.rows <= size:
        raise BadLog(
            f"{factor.rows} samples after the first {factor.order.lag} of each run; "
            f"{size} coefficients need at least {size + 1}: use a longer log or a lower order"
        )
    norms = np.sqrt(np.sum(R[:, :-1] ** 2, axis=0))
    _refuse_zero(norms, order, offset)
    scaled: Array = R / np.append(norms, 1.0)
    T = np.asarray(np.linalg.qr(scaled, mode="r"), dtype=np.float64)
    angles = np.abs(np.diagonal(T)[:size])
    _refuse_dependent(angles, order, offset)
    triangle: Array = T[:size, :size]
    solved = _back_substituted(triangle, np.column_stack([T[:size, size], np.eye(size)]))
    theta, inverse = solved[:, 0] / norms, solved[:, 1:] / norms[:, None]
    rss = float(T[size, size] ** 2) if T.shape[0] > size else 0.0
    variance = rss / (factor.rows - size)
    covariance = variance * (inverse @ inverse.T)
    sd = np.sqrt(np.diagonal(covariance))
    sizes = np.linalg.svd(triangle, compute_uv=False)
    moving = float(np.sum(factor.R[1:, -1] ** 2))
    c = int(offset)
    return ArxModel(
        A=frozen(np.concatenate([[1.0], -theta[c : c + order.na]])),
        B=frozen(
            np.concatenate([np.zeros(order.nk), theta[c + order.na :]]) if order.nb else [0.0]
        ),
        na=order.na,
        nb=order.nb,
        nk=order.nk,
        h=h,
        offset=float(theta[0]) if offset else None,
        covariance=frozen(_signed(covariance[c:, c:], order)),
        sd_a=frozen(sd[c : c + order.na]),
        sd_b=frozen(sd[c + order.na :]),
        sd_offset=float(sd[0]) if offset else None,
        noise_variance=variance,
        residual_rms=float(np.sqrt(rss / factor.rows)),
        relative_error=float(np.sqrt(rss / moving)) if moving > 0.0 else 0.0,
        rows=factor.rows,
        condition=float(sizes[0] / sizes[-1]),
    )


def _back_substituted(T: Array, right: Array) -> Array:
    """X with T X = right for upper triangular T (LAPACK's wakes its threads for a 5 by 5)."""
    X = np.zeros_like(right)
    for i in reversed(range(len(T))):
        X[i] = (right[i] - T[i, i + 1 :] @ X[i + 1 :]) / T[i, i]
    return X


def _signed(covariance: Array, order: Order) -> Array:
    """Covariance of `[a, b]` from that of `[-a, b]`."""
    sign = np.array([-1.0] * order.na + [1.0] * order.nb)
    return np.asarray(covariance * np.outer(sign, sign), dtype=np.float64)


def _names(order: Order, offset: bool) -> list[str]:
    names = ["the offset"] if offset else []
    names += [f"y(t-{i})" for i in range(1, order.na + 1)]
    return names + [f"u(t-{order.nk + j})" for j in range(order.nb)]


def _refuse_zero(norms: Array, order: Order, offset: bool) -> None:
    for name, norm in zip(_names(order, offset), norms, strict=True):
        if norm == 0.0:
            raise NotIdentifiable(
                f"{name} is zero on every sample, so its coefficient is not identifiable; "
                "excite that signal"
            )


def _refuse_dependent(angles: Array, order: Order, offset: bool) -> None:
    for name, angle in zip(_names(order, offset), angles, strict=True):
        if angle <= SMALLEST_ANGLE:
            raise NotIdentifiable(
                f"{name} is a combination of the regressors before it (what is left of it: "
                f"{angle:.1e}, more than {SMALLEST_ANGLE:.0e} needed): constant input, linear "
                "feedback or too high an order; vary the input more, or lower the order"
            )


def predict_one_step(model: ArxModel, u: Array, y: Array) -> Array:
    """Prediction of y(t) from the samples before it, shape of `y`; NaN for the first `model.lag`.

    Raises BadLog where `u` and `y` differ in length.
    """
    u, y = _pair(model, u, y)
    out = _driven(model, u) + lfilter(np.concatenate([[0.0], -model.A[1:]]), [1.0], y)
    out[: model.lag] = np.nan
    return np.asarray(out, dtype=np.float64)


def one_step_errors(model: ArxModel, u: Array, y: Array) -> Array:
    """`e(t) = A y - B u - c` for every sample with a full past, shape (n - model.lag,)."""
    u, y = _pair(model, u, y)
    return np.asarray((lfilter(model.A, [1.0], y) - _driven(model, u))[model.lag :])


def simulate_arx(model: ArxModel, u: Array, start: Array | None = None) -> Array:
    """Response of the model to `u` alone, shape of `u`.

    start: first outputs, at least `model.lag` of them, kept as they are; at rest (zero before the
    first sample) if None. Raises BadLog where `start` is too short or longer than `u`.
    """
    u = np.asarray(u, dtype=np.float64)
    driven = _driven(model, u)
    if start is None:
        return np.asarray(lfilter([1.0], model.A, driven), dtype=np.float64)
    start = np.asarray(start, dtype=np.float64)
    given = len(start)
    if not model.lag <= given <= len(u):
        raise BadLog(f"{given} first outputs; {model.lag} to {len(u)} needed to start the model")
    state = lfiltic([1.0], model.A, start[::-1][: model.na])
    rest, _ = lfilter([1.0], model.A, driven[given:], zi=state)
    return np.concatenate([start, rest])


def simulation_errors(model: ArxModel, u: Array, y: Array) -> Array:
    """Measured less simulated y after a start on the first `model.lag` samples, (n - lag,)."""
    u, y = _pair(model, u, y)
    return (y - simulate_arx(model, u, y[: model.lag]))[model.lag :]


def _driven(model: ArxModel, u: Array) -> Array:
    return np.asarray(lfilter(model.B, [1.0], u) + (model.offset or 0.0), dtype=np.float64)


def _pair(model: ArxModel, u: Array, y: Array) -> Run:
    u, y = np.asarray(u, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if u.ndim != 1 or u.shape != y.shape or len(y) <= model.lag:
        raise BadLog(
            f"u of shape {u.shape} and y of shape {y.shape}; both must be (n,) with the same n "
            f"above {model.lag}"
        )
    return u, y
