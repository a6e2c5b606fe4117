"""Ten lines of least squares: what any model of a measured machine has to beat.

signal(t - lag) = m a + F_cp [v > 0] - F_cn [v < 0] + F_vp v+ + F_vn v- + c
                  + g1 sin y + g2 cos y + sum_n (a_n sin n y + b_n cos n y),

in weak form: both sides are weighted with a bump of a few samples, whose second derivative takes
that of the position; direction and speed are read by a finer one first. `signal` is the measured
force, or the command where no force is measured, in the unit of the log: nothing that a fit makes
stands on the left. Width of the bump and lag are chosen on the training logs. Knows numpy alone,
none of the packages that it judges.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

WIDTHS = (4, 8, 16, 32, 64)  # samples, half of the bump
NEARLY, AS_WELL = 1.1, 0.005  # times the least share, or more than it: the narrowest bump is taken
FINER = 4  # times narrower: the bump that shows direction and speed
ONE_WAY = 0.02  # of the rows: fewer of a direction are noise
LAG_STEP, LAGS = 0.25, 5.0  # samples
GAP = 3.5  # periods without a row
UNSURE = 0.1  # share of a bump in which the direction may be unsure
SLOW = 0.02  # of the fast speeds: slower is no sliding
LEAST = 50  # rows
SUB_STEPS = 4
FLOOR = 1e-12


@dataclass(frozen=True)
class Record:
    """A log on an even clock: position, measured signal and others, (n,); h [s].

    good: samples that do not lie in a gap of the rows.
    """

    t: Array
    y: Array
    signal: Array
    h: float
    good: BoolArray
    others: Mapping[str, Array] = field(default_factory=dict)


@dataclass(frozen=True)
class Terms:
    """Which terms stand beside the five and the constant; counts: harmonics of y [1/rad, 1/m]."""

    gravity: bool = False
    counts: tuple[float, ...] = ()
    longest_lag: float = 0.0  # s, where it is more than LAGS samples


@dataclass(frozen=True)
class Fit:
    """Parameters by name in units of the signal; width [samples], lag [s], share left in training.

    A reader of `values` finds m, F_cp, F_cn, F_vp, F_vn, c, and "sin n", "cos n" of each count.
    """

    values: Mapping[str, float]
    terms: Terms
    width: int
    lag: float
    share: float


def record(t: Array, y: Array, signal: Array, others: Mapping[str, Array] | None = None) -> Record:
    """Rows (n,) on an even clock of their median period."""
    extra = dict(others or {})
    ok = np.isfinite(t) & np.isfinite(y) & np.isfinite(signal)
    ok[ok] &= np.concatenate([[True], t[ok][1:] > np.maximum.accumulate(t[ok])[:-1]])
    t, y, signal = t[ok], y[ok], signal[ok]
    step = np.diff(t)
    h = float(np.median(step))
    even = t[0] + h * np.arange(int((t[-1] - t[0]) / h) + 1)
    at = np.clip(np.searchsorted(t, even, "right") - 1, 0, len(step) - 1)
    put = {key: np.interp(even, t, x[ok]) for key, x in extra.items()}
    return Record(
        even, np.interp(even, t, y), np.interp(even, t, signal), h, step[at] < GAP * h, put
    )


@dataclass(frozen=True)
class Bump:
    """Weights of a mean, a first and a second derivative over 2 width + 1 samples."""

    mean: Array
    first: Array
    second: Array

    @classmethod
    def of(cls, width: int, h: float) -> "Bump":
        """(1 - x^2)^4 and its derivatives, exact for parabolas."""
        k = np.arange(-width, width + 1, dtype=np.float64)
        x = k / (width + 1)
        mean = (1 - x**2) ** 4
        first, second = x * (1 - x**2) ** 3, (7 * x**2 - 1) * (1 - x**2) ** 2
        mean = mean / np.sum(mean)
        second -= np.sum(second) * mean
        return cls(mean, first / np.sum(first * k) / h, second * 2 / np.sum(second * k**2) / h**2)


def weighed(x: Array, weights: Array) -> Array:
    """The sum of x times the weights about every sample, (n,)."""
    if len(weights) % 2 == 0 or len(weights) > len(x):
        raise ValueError("a bump of an odd number of samples, no longer than the log")
    padded = np.pad(x, len(weights) // 2, mode="reflect", reflect_type="odd")
    return np.asarray(np.correlate(padded, weights, "valid"))


def norm(x: Array) -> float:
    """Root of the sum of squares."""
    return float(np.linalg.norm(x))


def sensor_noise(y: Array) -> float:
    """One sigma of white noise, or of the steps of a count."""
    third = np.diff(y, 3)
    steps = np.abs(np.diff(y))
    steps = steps[steps > FLOOR]
    count = float(np.min(steps)) / np.sqrt(12.0) if len(np.unique(y)) < len(y) / 4 else 0.0
    return max(float(np.median(np.abs(third)) / 0.6745 / np.sqrt(20.0)), float(count))


@dataclass(frozen=True)
class Sliding:
    """Speed, its finer reading, acceleration in weak form, and the samples at which the body surely
    slides, (n,)."""

    v: Array
    fine: Array
    a: Array
    keep: BoolArray
    slowest: float
    bump: Bump

    @classmethod
    def of(cls, log: Record, width: int) -> "Sliding":
        """The motion of a log as a bump of that width shows it."""
        bump = Bump.of(width, log.h)
        v = weighed(log.y, bump.first)
        noise = sensor_noise(log.y) * float(np.linalg.norm(bump.first))
        slowest = max(5.0 * noise, SLOW * float(np.quantile(np.abs(v), 0.95)))
        unsure = weighed((np.abs(v) < slowest).astype(np.float64), bump.mean)
        gap = weighed((~log.good).astype(np.float64), bump.mean)
        keep = (np.abs(v) > slowest) & (unsure < UNSURE) & (gap < FLOOR)
        keep[: 2 * width] = keep[len(keep) - 2 * width :] = False
        fine = weighed(log.y, Bump.of(max(2, width // FINER), log.h).first)
        return cls(v, fine, weighed(log.y, bump.second), keep, slowest, bump)


def force_terms(log: Record, v: Array, terms: Terms) -> dict[str, Array]:
    """Every term but the inertia at every sample, by the name of its factor."""
    up, down = v > 0, v < 0
    out: dict[str, Array] = {
        "F_cp": up.astype(np.float64),
        "F_cn": -down.astype(np.float64),
        "F_vp": v * up,
        "F_vn": v * down,
    }
    out["c"] = np.ones(len(v))
    counts = ((1.0,) if terms.gravity else ()) + terms.counts
    for n in counts:
        out |= {f"sin {n:g}": np.sin(n * log.y), f"cos {n:g}": np.cos(n * log.y)}
    return out


def shifted(log: Record, lag: float) -> Array:
    """The signal as it was `lag` [s] before each sample."""
    return np.interp(log.t - lag, log.t, log.signal)


def fitted(logs: Sequence[Record], terms: Terms) -> Fit | None:
    """The least squares of the logs; None where too little of them slides."""
    shortest = min(len(one.t) for one in logs)
    tried = [_at_width(logs, terms, width) for width in WIDTHS if 20 * width < shortest]
    found = [one for one in tried if one is not None]
    if not found:
        return None
    least = min(one.share for one in found)
    return next(one for one in found if one.share <= max(NEARLY * least, least + AS_WELL))


def _at_width(logs: Sequence[Record], terms: Terms, width: int) -> Fit | None:
    columns, moves, names = list[Array](), list[Sliding](), list[str]()
    for log in logs:
        move = Sliding.of(log, width)
        parts = force_terms(log, move.fine, terms)
        names = ["m", *parts]
        rows = [move.a, *(weighed(x, move.bump.mean) for x in parts.values())]
        columns.append(np.column_stack(rows)[move.keep])
        moves.append(move)
    X = np.concatenate(columns)
    if len(X) < LEAST:
        return None
    up = X[:, names.index("F_cp")] > -X[:, names.index("F_cn")]
    rare = min(float(np.mean(up)), float(np.mean(~up)))
    both = up == (np.mean(up) > 0.5) if rare < ONE_WAY else np.ones(len(X), dtype=np.bool_)
    X = X[both]
    size = np.maximum(np.sqrt(np.mean(X**2, axis=0)), FLOOR)
    base, spread, _ = np.linalg.svd(X / size, full_matrices=False)
    base = base[:, spread > 1e-6 * spread[0]]
    best = (np.inf, 0.0, np.zeros(0))
    for lag in lags(logs[0].h, terms.longest_lag):
        pairs = zip(logs, moves, strict=True)
        s = np.concatenate([weighed(shifted(log, lag), m.bump.mean)[m.keep] for log, m in pairs])[
            both
        ]
        left = norm(s - base @ (base.T @ s)) / max(norm(s), FLOOR)
        if left < best[0]:
            best = (left, float(lag), s)
    share, lag, s = best
    values = np.linalg.lstsq(X / size, s, rcond=1e-6)[0] / size
    return Fit(dict(zip(names, values.tolist(), strict=True)), terms, width, lag, share)


def lags(h: float, longest: float) -> Array:
    """The lags tried [s]."""
    most = max(LAGS, longest / h)
    return np.asarray(np.arange(-most, most + LAG_STEP / 2, LAG_STEP) * h)


def share_left(
    logs: Sequence[Record], width: int, lag: float, predicted: Sequence[tuple[Array, float]]
) -> float | None:
    """Root mean square of signal less prediction over that of the signal, while sliding.

    predicted: of each log what its motion needs at every sample but the inertia's part, and the
    mass, in units of the signal; both sides are weighed with the same bump, at the same samples.
    """
    left = [_sides(log, width, lag, *one) for log, one in zip(logs, predicted, strict=True)]
    measured = np.concatenate([one[0] for one in left])
    needed = np.concatenate([one[1] for one in left])
    return ratio(measured, needed)


def _sides(log: Record, width: int, lag: float, needs: Array, mass: float) -> tuple[Array, Array]:
    move = Sliding.of(log, width)
    measured = weighed(shifted(log, lag), move.bump.mean)[move.keep]
    return measured, (weighed(needs, move.bump.mean) + mass * move.a)[move.keep]


def ratio(measured: Array, predicted: Array) -> float | None:
    """rms(measured - predicted) / rms(measured); None without rows."""
    if len(measured) < LEAST:
        return None
    return norm(measured - predicted) / max(norm(measured), FLOOR)


def own_share(logs: Sequence[Record], fit: Fit) -> float | None:
    """What the fit leaves of the signal on logs that it may not have seen."""
    needs = []
    for log in logs:
        parts = force_terms(log, Sliding.of(log, fit.width).fine, fit.terms)
        force = np.sum([fit.values[name] * x for name, x in parts.items()], axis=0)
        needs.append((force, fit.values["m"]))
    return share_left(logs, fit.width, fit.lag, needs)


def run_errors(logs: Sequence[Record], fit: Fit, window: float) -> float | None:
    """Position error (rms) of runs begun anew every `window` [s]; None where the mass is none."""
    if not fit.values["m"] > 0:
        return None
    errors = np.concatenate([_run(log, fit, window) for log in logs])
    return float(np.sqrt(np.mean(errors**2))) if len(errors) else None


def _run(log: Record, fit: Fit, window: float) -> Array:
    """Measured less simulated position of every window, Karnopp's model with F_s = F_c."""
    p, step = fit.values, max(2, round(window / log.h))
    move = Sliding.of(log, fit.width)
    starts = np.arange(0, len(log.t) - step, step)
    y = weighed(log.y, move.bump.mean)[starts]
    v = np.where(np.abs(move.v[starts]) > move.slowest, move.v[starts], 0.0)
    signal, dt = shifted(log, fit.lag), log.h / SUB_STEPS
    counts = ((1.0,) if fit.terms.gravity else ()) + fit.terms.counts
    up, down = max(p["F_cp"], 0.0), max(p["F_cn"], 0.0)
    errors = []
    for k in range(step):
        errors.append(log.y[starts + k] - y)
        given = 0.5 * (signal[starts + k] + signal[starts + k + 1]) - p["c"]
        for _ in range(SUB_STEPS):
            free = given.copy()
            for n in counts:
                free -= p[f"sin {n:g}"] * np.sin(n * y) + p[f"cos {n:g}"] * np.cos(n * y)
            way = np.sign(
                np.where(v != 0, v, np.where(free > up, 1, np.where(free < -down, -1, 0)))
            )
            rubs = np.where(
                way > 0, up + p["F_vp"] * v, np.where(way < 0, p["F_vn"] * v - down, free)
            )
            new = v + dt * (free - rubs) / p["m"]
            v = np.clip(np.where(new * v < 0, 0.0, new), -1e6, 1e6)
            y = y + dt * v
    return np.asarray(np.concatenate(errors))
