"""The other way to move: a body that the command accelerates against friction, in six numbers.

v' = k u(t - delay) + f_0 - f_v v - (f_p where v > 0, -f_n where v < 0), at rest while that holds
it. Only for telling which kind of rig a log looks like: what friction is, a fit of its own tells.
"""

import numpy as np
from scipy.optimize import least_squares

from identification.arrays import Array, BoolArray
from identification.compiled import compiled
from identification.velocity.record import WINDOW, Record, chosen, folds

SLOPE = 0.05  # s to either side of a window's start, over which its first velocity is measured
STEP_OF_BODY = 1e-4  # of a number's scale
GAINS_TRIED = (-30.0, -3.0, -0.3, 0.3, 3.0, 30.0)  # of the scale


@compiled
def _slides(u: Array, h: float, v: float, x: Array) -> Array:
    """Position (n,) from 0 at velocity v under u (n,); x: k, f_p, f_n, f_v, f_0."""
    y = np.zeros(len(u))
    for i in range(1, len(u)):
        free = v + h * (x[0] * u[i - 1] + x[4])
        if free > 0.0:
            new = max(free - h * x[1], 0.0) / (1.0 + h * x[3])
        else:
            new = min(free + h * x[2], 0.0) / (1.0 + h * x[3])
        y[i] = y[i - 1] + 0.5 * h * (v + new)
        v = new
    return y


def _errors(record: Record, x: Array) -> list[Array]:
    """Measured less predicted position in each window of each run; x: k, f_p, f_n, f_v, f_0,
    delay."""
    out = []
    for run in record.runs:
        size, reach = round(WINDOW / run.h), max(1, round(SLOPE / run.h))
        late = np.interp(np.arange(len(run.u)) - x[5] / run.h, np.arange(len(run.u)), run.u)
        rows = []
        for a in run.starts(WINDOW):
            v = (run.y[a + reach] - run.y[a - reach]) / (2 * reach * run.h)
            rows.append(run.y[a : a + size] - _slides(late[a : a + size], run.h, v, x[:5]))
        out.append(np.array(rows))
    return out


def body_squares(record: Record) -> Array:
    """Mean square error [m²] of each window, (windows,), by a body fitted to other stretches."""
    count = min(5, record.windows // 2)
    of, out = folds(record, count), np.empty(record.windows)
    start: Array | None = None
    for k in range(count):
        start = _fitted(record, of != k, start)
        rows = [one for part in _errors(record, start) for one in part]
        squares = np.array([np.mean((one - one[0]) ** 2) for one in rows])
        out[of == k] = squares[of == k]
    return out


def _fitted(record: Record, where: BoolArray, start: Array | None) -> Array:
    """The numbers of the body by the windows `where`, from a start or from several."""
    kept = chosen(record, where)
    spread = max(float(np.std(np.diff(run.y)) / run.h) for run in record.runs)
    unit = np.array([10.0 * spread / record.u_max, spread, spread, 1.0, spread, 0.02])

    def errors(x: Array) -> Array:
        parts = _errors(record, x * unit)
        return np.concatenate([
            (rows[use] - rows[use].mean(axis=1, keepdims=True)).ravel()
            for rows, use in zip(parts, kept, strict=True)
        ])  # fmt: skip

    several = [
        np.array([k, 0.1 * abs(k), 0.1 * abs(k), 1.0, 0.0, 0.5]) for k in GAINS_TRIED
    ]  # fmt: skip
    starts = several if start is None else [start / unit]
    low = np.array([-np.inf, 0.0, 0.0, 0.0, -np.inf, 0.0])
    high = np.array([np.inf, np.inf, np.inf, np.inf, np.inf, 10.0])
    best = min(
        (
            least_squares(
                errors, one, bounds=(low, high), loss="soft_l1", f_scale=record.noise + 1e-9,
                max_nfev=40, x_scale=np.maximum(np.abs(one), 0.1), diff_step=[STEP_OF_BODY] * 6,
            )
            for one in starts
        ),
        key=lambda found: found.cost,
    )  # fmt: skip
    return np.asarray(best.x * unit)
