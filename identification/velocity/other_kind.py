"""The other way to move: a body that the command accelerates against friction, in seven numbers.

v' = k u(t - delay) + f_0 - (f_p + f_vp v where v > 0, -f_n + f_vn v where v < 0), at rest while
that holds it. Only to decide which kind of rig a log is of: friction has a fit of its own.
"""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares

from identification.arrays import Array, BoolArray
from identification.compiled import compiled
from identification.velocity.fit import LONGEST_DEADTIME, OUTLYING
from identification.velocity.model import Valve
from identification.velocity.record import AHEAD, MOST_FOLDS, Record, chosen, folds

FIRST_SPEED_OVER = (
    0.05  # s to either side of a window's start, over which its first velocity is measured
)
SHORTEST_OF_BODY = 1e-3  # s, of a lag
STEP_OF_BODY = 1e-4  # of a number's scale
GAINS_TRIED = (-10.0, -1.0, 1.0, 10.0)


@compiled
def _slides(u: Array, h: float, v: float, x: Array) -> Array:
    """Position (n,) from 0 at velocity v under u (n,); x: k, f_p, f_n, f_vp, f_vn, f_0."""
    y = np.zeros(len(u))
    for i in range(1, len(u)):
        free = v + h * (x[0] * u[i - 1] + x[5])
        if free > 0.0:
            new = max(free - h * x[1], 0.0) / (1.0 + h * x[3])
        else:
            new = min(free + h * x[2], 0.0) / (1.0 + h * x[4])
        y[i] = y[i - 1] + 0.5 * h * (v + new)
        v = new
    return y


def _errors(record: Record, x: Array) -> list[Array]:
    """Measured less predicted position in each window of each run; x: k, f_p, f_n, f_vp, f_vn,
    f_0, delay."""
    out = []
    for run in record.runs:
        size, reach = round(AHEAD / run.h), max(1, round(FIRST_SPEED_OVER / run.h))
        late = np.interp(np.arange(len(run.u)) - x[6] / run.h, np.arange(len(run.u)), run.u)
        rows = []
        for a in run.starts(AHEAD):
            v = (run.y[a + reach] - run.y[a - reach]) / (2 * reach * run.h)
            rows.append(run.y[a : a + size] - _slides(late[a : a + size], run.h, v, x[:6]))
        out.append(np.array(rows).reshape(len(rows), size))  # of a short run none
    return out


def body_squares(record: Record, valve: Valve) -> Array:
    """Mean square error [m²] of each window, (windows,), by a body fitted to other stretches.

    valve: as fitted, the body that moves most like which is one start of the search.
    """
    count = min(MOST_FOLDS, record.windows // 2)
    of, out = folds(record, count), np.empty(record.windows)
    starts = [_like(valve), *(_pushed(record, k) for k in GAINS_TRIED)]
    for k in range(count):
        best = _fitted(record, of != k, starts)
        starts = [best]
        rows = [one for part in _errors(record, best) for one in part]
        squares = np.array([np.mean((one - one[0]) ** 2) for one in rows])
        out[of == k] = squares[of == k]
    return out


def _like(valve: Valve) -> Array:
    """A body with the valve's dead zones, gains and lag."""
    lag = max(valve.lag, SHORTEST_OF_BODY)
    gain = np.array([valve.g_p, valve.g_n])
    k = float(gain[np.argmax(np.abs(gain))]) / lag
    f_v = k / np.where(gain * k > 0.0, gain, k * lag)
    return np.array([k, abs(k) * valve.d_p, abs(k) * valve.d_n, *f_v, 0.0, valve.delay])


def _pushed(record: Record, gain: float) -> Array:
    """A body that the largest command accelerates by `gain` times the speeds seen, in 0.1 s."""
    speed = max(float(np.std(np.diff(run.y)) / run.h) for run in record.runs)
    k = 10.0 * gain * speed / record.u_max
    return np.array([k, abs(gain) * speed, abs(gain) * speed, 1.0, 1.0, 0.0, 0.01])


def _fitted(record: Record, where: BoolArray, starts: Sequence[Array]) -> Array:
    """The numbers of the body by the windows `where`, from the best of several starts."""
    kept = chosen(record, where)
    speed = max(float(np.std(np.diff(run.y)) / run.h) for run in record.runs)
    unit = np.array([10.0 * speed / record.u_max, speed, speed, 1.0, 1.0, speed, 0.02])
    low = np.array([-np.inf, 0.0, 0.0, 0.0, 0.0, -np.inf, 0.0])
    high = np.append(np.full(6, np.inf), LONGEST_DEADTIME / unit[6])

    def errors(x: Array) -> Array:
        parts = _errors(record, x * unit)
        return np.concatenate([
            (rows[use] - rows[use].mean(axis=1, keepdims=True)).ravel()
            for rows, use in zip(parts, kept, strict=True)
        ])  # fmt: skip

    best, least = starts[0], np.inf
    for one in starts:
        x = np.clip(one / unit, low, high)
        for _ in range(2):  # the second with the spread that the first leaves
            spread = 1.4826 * float(np.median(np.abs(errors(x)))) + 1e-3 * record.noise
            x = least_squares(
                errors, x, bounds=(low, high), loss="soft_l1", f_scale=OUTLYING * spread,
                max_nfev=30, x_scale=np.maximum(np.abs(x), 0.1), gtol=None,
                diff_step=[STEP_OF_BODY] * 7,
            ).x  # fmt: skip
        left = float(np.mean(np.abs(errors(x))))
        if left < least:
            best, least = x * unit, left
    return np.asarray(best)
