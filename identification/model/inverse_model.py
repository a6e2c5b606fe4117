"""Inverse model: the applied force as a linear function of motion, by least squares.

F_e = m a + F_cp [v > 0] - F_cn [v < 0] + F_vp v [v > 0] + F_vn v [v < 0] on sliding samples. Motion
comes from the smoothed position; every column and the force pass the same low-pass (parallel
filtering), so the filter does not bias the fit. This is the IDIM-LS procedure of Janot, Gautier
and Brunot (2019), without their decimation: every sample is kept, and one in `factor` is counted.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from identification.arrays import Array, frozen
from identification.errors import BadLog, NotIdentifiable
from identification.log import Log
from identification.model.karnopp import Karnopp, friction
from identification.signals.differentiate import Method, Motion, differentiate, parallel_filter

Viscous = Literal["symmetric", "directional"]
BoolArray = NDArray[np.bool_]
SLIDING_NAMES = ("m", "F_cp", "F_cn", "F_vp", "F_vn")
SURE_SLIDING = 5.0
MIN_SLIDING = 20
MAX_CONDITION = 100.0

# One viscous coefficient for both directions: columns m, F_cp, F_cn, F_v.
ONE_VISCOUS = np.array(
    [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [0, 0, 0, 1]], dtype=np.float64
)


@dataclass(frozen=True)
class Smoothing:
    """How a log becomes a regression.

    `cutoff` [Hz] of the position's smoothing (from the log where None) and its `method`; `factor`:
    the parallel filter passes 0.8/factor of the band (0.4 `cutoff` where None); `zoh`: the force
    is a command, constant over each period, so a central difference sees the mean of two
    neighbours; `threshold` [m/s]: slower samples count as stuck (five times the velocity's noise
    where None).
    """

    cutoff: float | None = None
    method: Method = "butterworth"
    factor: int | None = None
    zoh: bool = False
    threshold: float | None = None


@dataclass(frozen=True)
class Regression:
    """Filtered columns (n, 5) in the order of `SLIDING_NAMES`, force [N] (n,), while sliding.

    `index` (n,) says which samples of the log they are; `factor` of them count as one.
    """

    columns: Array
    force: Array
    index: Array
    motion: Motion
    threshold: float
    factor: int


@dataclass(frozen=True)
class ForceError:
    """Relative force error ||F - F_hat|| / ||F|| and its root mean square [N]."""

    relative: float
    rms: float


@dataclass(frozen=True)
class InverseModel:
    """The Karnopp parameters that sliding shows, with standard deviations and force error.

    m [kg], F_cp, F_cn [N], F_vp, F_vn [N s/m]. `sd` holds these and F_c, offset; `covariance`
    (5, 5) is in the order of `SLIDING_NAMES`. `samples` counts independent sliding samples;
    `cutoff` [Hz], `noise` [m] and `threshold` [m/s] are those of the smoothing used.
    """

    viscous: Viscous
    m: float
    F_cp: float
    F_cn: float
    F_vp: float
    F_vn: float
    sd: Mapping[str, float]
    covariance: Array
    error: ForceError
    samples: int
    cutoff: float
    noise: float
    threshold: float

    @property
    def array(self) -> Array:
        """The five parameters in the order of `SLIDING_NAMES`."""
        return np.array([getattr(self, name) for name in SLIDING_NAMES], dtype=np.float64)

    @property
    def F_c(self) -> float:
        """Coulomb friction common to both directions [N]."""
        return 0.5 * (self.F_cp + self.F_cn)

    @property
    def offset(self) -> float:
        """Constant force [N]: it is not distinguishable from unequal F_cp = F_c + offset, F_cn =
        ..."""
        return 0.5 * (self.F_cp - self.F_cn)


def regression(log: Log, how: Smoothing | None = None) -> Regression:
    """The log's sliding samples as a linear regression in the five parameters of `SLIDING_NAMES`.

    Raises BadLog where the clock is uneven, NotIdentifiable where too little of it slides.
    """
    how = how or Smoothing()
    h = _even_period(log)
    motion = differentiate(log["y"], h, how.cutoff, how.method)
    threshold = SURE_SLIDING * motion.v_noise if how.threshold is None else how.threshold
    force = zoh_force(log["F"]) if how.zoh or log.zoh else np.array(log["F"])
    up, down = motion.v > threshold, motion.v < -threshold
    columns = np.column_stack([motion.a, up, -1.0 * down, motion.v * up, motion.v * down])
    factor = max(1, round(1.0 / (motion.cutoff * h))) if how.factor is None else how.factor
    edge = max(motion.edge, 5 * factor)
    inner = slice(edge, len(force) - edge)
    filtered = parallel_filter(np.column_stack([columns, force])[inner], factor)
    keep = _sliding((up | down)[inner], factor)
    _enough(log.name, up[inner][keep], down[inner][keep], factor, threshold)
    index = np.flatnonzero(keep) + edge
    data = filtered[keep]
    return Regression(data[:, :-1], data[:, -1], frozen(index), motion, threshold, factor)


def fit_inverse(
    log: Log, viscous: Viscous = "directional", how: Smoothing | None = None
) -> InverseModel:
    """Mass, Coulomb and viscous friction of a log by least squares on its sliding samples.

    log: needs y [m] and F [N]. viscous: one viscous coefficient ("symmetric") or one a direction;
    unequal F_cp and F_cn take up a constant offset in both. Raises NotIdentifiable where the log
    does not slide enough, in both directions. Source: IDIM-LS, Janot et al. 2019 (see above).
    """
    data = regression(log, how)
    basis = ONE_VISCOUS if viscous == "symmetric" else np.eye(len(SLIDING_NAMES))
    columns = data.columns @ basis
    _independent(log.name, columns)
    q, r = np.linalg.qr(columns)
    theta = np.linalg.solve(r, q.T @ data.force)
    residual = data.force - columns @ theta
    samples = len(residual) // data.factor
    variance = float(np.sum(residual**2)) / data.factor / max(samples - len(theta), 1)
    # The parallel filter leaves one independent sample in `factor`.
    inverse = np.linalg.inv(r)
    covariance = basis @ (inverse @ inverse.T * variance * data.factor) @ basis.T
    m, F_cp, F_cn, F_vp, F_vn = (float(x) for x in basis @ theta)
    return InverseModel(
        viscous, m, F_cp, F_cn, F_vp, F_vn,
        _deviations(covariance), frozen(covariance), _error(residual, data.force), samples,
        data.motion.cutoff, data.motion.noise, data.threshold,
    )  # fmt: skip


def force_error(
    log: Log, model: InverseModel | Karnopp, how: Smoothing | None = None
) -> ForceError:
    """Error of the inverse model's force on the sliding samples of a log, filtered as for a fit."""
    data = regression(log, how)
    theta = np.array([getattr(model, name) for name in SLIDING_NAMES], dtype=np.float64)
    return _error(data.force - data.columns @ theta, data.force)


def force_predicted(log: Log, p: Karnopp, how: Smoothing | None = None) -> Array:
    """Force the inverse model needs for the log's motion [N], shape (n,).

    m a + friction (1). Inside the band friction is the applied force within [F_sn, F_sp], as the
    model says of a stuck body: there this is no prediction, only a check of the limits.
    """
    how = how or Smoothing()
    motion = differentiate(log["y"], _even_period(log), how.cutoff, how.method)
    return p.m * motion.a + friction(motion.v, log["F"], p)


def zoh_force(F: Array) -> Array:
    """Mean of each sample of a zero-order-hold force and the one before it: what a central
    difference sees."""
    out = np.array(F, dtype=np.float64)
    out[1:] = 0.5 * (F[1:] + F[:-1])
    return out


def _independent(name: str, columns: Array) -> None:
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    condition = float(np.linalg.cond(columns / size))
    if condition > MAX_CONDITION:
        raise NotIdentifiable(
            f"{name}: mass, Coulomb and viscous friction are not separable (condition"
            f" {condition:.0f}, at most {MAX_CONDITION:.0f} needed); log motion of varied speed"
        )


def _error(residual: Array, force: Array) -> ForceError:
    return ForceError(
        float(np.linalg.norm(residual) / np.linalg.norm(force)),
        float(np.sqrt(np.mean(residual**2))),
    )


def _deviations(covariance: Array) -> Mapping[str, float]:
    """Standard deviations of the five and of F_c and the offset, half their sum and difference."""
    each = dict(zip(SLIDING_NAMES, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    for name, sign in (("F_c", 1.0), ("offset", -1.0)):
        mix = np.array([0.0, 0.5, 0.5 * sign, 0.0, 0.0])
        each[name] = float(np.sqrt(mix @ covariance @ mix))
    return MappingProxyType(each)


def _even_period(log: Log) -> float:
    h = log.h
    worst = float(np.max(np.abs(np.diff(log["t"]) - h)))
    if worst > 0.01 * h:
        raise BadLog(
            f"{log.name}: period varies by {worst:g} s around {h:g} s, at most 1 % is allowed for"
            " derivatives; put the log on an even clock first"
        )
    return h


def _sliding(moving: BoolArray, factor: int) -> BoolArray:
    """Samples to keep: moving, and further than the parallel filter reaches from any stop.

    A reversal shorter than `factor` samples is not a stop: the sign is known on either side of it.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[True], moving, [True]]).astype(np.int8)))
    keep = moving.copy()
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        if stop - start >= factor:
            keep[max(start - 2 * factor, 0) : stop + 2 * factor] = False
    return keep


def _enough(name: str, up: BoolArray, down: BoolArray, factor: int, threshold: float) -> None:
    for way, part in (("positive", up), ("negative", down)):
        found = int(np.count_nonzero(part)) // factor
        if found < MIN_SLIDING:
            raise NotIdentifiable(
                f"{name}: {found} independent sliding samples in the {way} direction (faster than"
                f" {threshold:.3g} m/s), at least {MIN_SLIDING} needed; log longer or faster motion"
            )
