"""The valve's numbers by least squares on the position in windows, each from its own start.

A window's first position is free, its first velocity follows from the command before it. Delay and
dead zones are scanned, gains solved for each; the best few starts are then refined together, with a
loss that is linear in what stands out.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise, product

import numpy as np
from scipy.optimize import least_squares

from identification.arrays import Array, BoolArray
from identification.errors import NotIdentifiable
from identification.progress import KeepGoing, without_end
from identification.velocity.model import NUMBERS, Valve, lagged
from identification.velocity.record import AHEAD, Record, Run, chosen

LONGEST_DEADTIME = 0.5  # s
SCANNED_LAGS = (0.005, 0.03, 0.1, 0.3)  # s, that are scanned
LONGEST_FOLLOWING = 20.0  # s; as long, the command sets the acceleration
WIDEST_ZONE = 0.95  # of the largest command
SCANNED_ZONES = 12  # dead zones scanned each way
SCANNED_STEP = 0.02  # s between scanned delays
SCANNED_SAMPLES = 6000
STARTS = 3
STEP_OF_SLOPE = 1e-4  # of a number's scale
OPEN_WAY = 1e-9  # of the largest curvature, below which numbers are not separable
LOADED = 1e-3  # part of a number in such a combination
OUTLYING = 3.0  # deviations, beyond which an error counts as its size


@dataclass(frozen=True, eq=False)
class ValveFit:
    """The fitted valve; free: names of the numbers fitted; covariance (d, d) in their order.

    cost: mean size of the errors [m], by which starts are compared; clusters: windows fitted to.
    """

    valve: Valve
    free: tuple[str, ...]
    covariance: Array
    cost: float
    clusters: int


def scales(record: Record, valve: Valve) -> Mapping[str, float]:
    """A size of each number, by which a search measures its steps."""
    gain = max(abs(valve.g_p), abs(valve.g_n))
    speed = gain * record.u_max
    return {
        "g_p": gain, "g_n": gain, "d_p": record.u_max, "d_n": record.u_max,
        "delay": 0.05, "lag": 0.05, "creep": 0.1 * speed,
    }  # fmt: skip


def bounds_of(record: Record) -> Mapping[str, tuple[float, float]]:
    """Between what each number lies; gains have either sign."""
    zone = (0.0, WIDEST_ZONE * record.u_max)
    return {
        "d_p": zone, "d_n": zone, "delay": (0.0, LONGEST_DEADTIME), "lag": (0.0, LONGEST_FOLLOWING),
        "second_lag": (0.0, 0.98), "lag_other": (-0.95, 20.0),
    }  # fmt: skip


def fit(record: Record, *, keep_going: KeepGoing = without_end) -> ValveFit:
    """The plain model of the record, from a scan; raises NotIdentifiable where nothing follows."""
    silent = f"_{_silent(record)}"
    free = tuple(name for name in NUMBERS if not silent[1:] or not name.endswith(silent))
    best: ValveFit | None = None
    for start in _scanned(record)[:STARTS]:
        found = refined(record, start, free)
        if best is None or found.cost < best.cost:
            best = found
        if not keep_going():
            break
    if best is None:
        raise NotIdentifiable(
            f"{record.runs[0].name}: the position does not follow the command at any delay up to"
            f" {LONGEST_DEADTIME:g} s; check the columns of the card"
        )
    return best


def _silent(record: Record) -> str:
    """The last letter of the way in which no command is ever given, empty where there is none."""
    low = min(float(run.u.min()) for run in record.runs)
    high = max(float(run.u.max()) for run in record.runs)
    return "p" if high <= 0.0 else "n" if low >= 0.0 else ""


def refined(
    record: Record, start: Valve, free: Sequence[str], where: BoolArray | None = None
) -> ValveFit:
    """The valve with the numbers `free` fitted to the windows `where` (windows,), by default all.

    The search starts at `start`, which gives the other numbers too.
    """
    names = tuple(free)
    wide, bounds = scales(record, start), bounds_of(record)
    scale = np.array([wide.get(name, 1.0) for name in names])
    low, high = (
        np.array([bounds.get(n, (-np.inf, np.inf))[i] for n in names]) / scale for i in (0, 1)
    )
    kept = chosen(record, np.ones(record.windows, dtype=np.bool_) if where is None else where)

    def valve(x: Array) -> Valve:
        return replace(start, **dict(zip(names, (x * scale).tolist(), strict=True)))

    def errors(x: Array) -> Array:
        return np.concatenate([rows.ravel() for rows in _centred(record, valve(x), kept)])

    def slopes(x: Array) -> Array:
        return _slopes(errors, x, low, high)

    x = np.clip(np.array([asdict(start)[name] for name in names]) / scale, low, high)
    for _ in range(2):  # the second with the spread that the first leaves
        spread = max(1.4826 * float(np.median(np.abs(errors(x)))), 1e-3 * record.noise, 1e-12)
        found = least_squares(
            errors, x, slopes, bounds=(low, high), loss="soft_l1", f_scale=OUTLYING * spread,
            x_scale=1.0, max_nfev=60, gtol=None,
        )  # fmt: skip
        x = found.x
    # A time that is none is left out; a dead zone is not, which is confounded with a gain.
    inside = np.array([n[:2] == "d_" for n in names]) | (x > low + 1e-9) & (x < high - 1e-9)
    weight = 1.0 / np.sqrt(1.0 + (found.fun / (OUTLYING * spread)) ** 2)
    sizes = [rows.shape[1] for rows in _centred(record, valve(x), kept) for _ in rows]
    covariance = np.full((len(x), len(x)), np.nan)
    part = _jackknife(found.fun, slopes(x)[:, inside], weight, sizes)
    covariance[np.ix_(inside, inside)] = part * np.outer(scale[inside], scale[inside])
    return ValveFit(valve(x), names, covariance, float(np.mean(np.abs(found.fun))), len(sizes))


def _centred(record: Record, valve: Valve, kept: Sequence[BoolArray]) -> list[Array]:
    """The errors in the windows kept, each less its mean: the window's free first position."""
    rows = record.split(record.errors(valve), AHEAD)
    taken = [one[use] for one, use in zip(rows, kept, strict=True)]
    return [one - one.mean(axis=1, keepdims=True) for one in taken]


def _slopes(errors: Callable[[Array], Array], x: Array, low: Array, high: Array) -> Array:
    """Central differences of `errors` at x (d,), within the bounds, (n, d)."""
    columns = []
    for i in range(len(x)):
        up, down = x.copy(), x.copy()
        up[i] = min(x[i] + STEP_OF_SLOPE, high[i])
        down[i] = max(x[i] - STEP_OF_SLOPE, low[i])
        columns.append((errors(up) - errors(down)) / (up[i] - down[i]))
    return np.column_stack(columns)


def _jackknife(errors: Array, slopes: Array, weight: Array, sizes: Sequence[int]) -> Array:
    """Covariance (d, d) by leaving out one window after the other, to first order.

    Infinite where a number is not separable from others. The windows' errors may be of any colour.
    Source: Bell & McCaffrey (2002), Bias reduction in standard errors for linear regression with
    multi-stage samples (the jackknife of clusters).
    """
    borders = np.cumsum([0, *sizes])
    unit = np.linalg.norm(slopes, axis=0)
    unit[unit == 0.0] = 1.0  # of a number that changes nothing
    scaled = slopes / unit
    whole = scaled.T @ (weight[:, np.newaxis] * scaled)
    size, ways = np.linalg.eigh(whole)
    open_ways = ways[:, size < OPEN_WAY * size[-1]]
    moves = []
    for a, b in pairwise(borders):
        part = scaled[a:b].T * weight[a:b]
        rest = np.linalg.pinv(whole - part @ scaled[a:b], rcond=OPEN_WAY, hermitian=True)
        moves.append(rest @ (part @ errors[a:b]))
    count = len(sizes)
    out = (count - 1.0) / count * np.einsum("ki,kj->ij", moves, moves) / np.outer(unit, unit)
    lost = np.any(np.abs(open_ways) > LOADED, axis=1)
    out[lost], out[:, lost] = np.inf, np.inf
    return np.asarray(out)


def _scanned(record: Record) -> list[Valve]:
    """Starts, best first: of each delay and lag the best dead zones, gains by least squares."""
    zones = np.linspace(0.0, 0.8 * record.u_max, SCANNED_ZONES)
    step = max(SCANNED_STEP, min(run.h for run in record.runs))
    delays = np.arange(0.0, LONGEST_DEADTIME, step)
    every = max(1, sum(len(run.y) for run in record.runs) // SCANNED_SAMPLES)
    runs = list(enumerate(record.runs))
    target = np.concatenate([_flat(run, run.y[:, np.newaxis], 0, every) for _, run in runs])[:, 0]
    found = list[tuple[float, Valve]]()
    for lag in SCANNED_LAGS:
        columns = [_columns(run.u, run.h, zones, lag) for run in record.runs]
        for delay in delays:
            X = np.concatenate([
                _flat(run, columns[i], round(float(delay) / run.h), every) for i, run in runs
            ])  # fmt: skip
            cost, p, n, gains = _best_pair(X, target)
            valve = Valve(gains[0], gains[1], float(zones[p]), float(zones[n]), float(delay), lag)
            found.append((cost, valve))
    found.sort(key=lambda one: one[0])
    return _apart([valve for cost, valve in found if np.isfinite(cost)])


def _apart(ranked: Sequence[Valve]) -> list[Valve]:
    """The best starts of different lags."""
    out = dict[float, Valve]()
    for one in ranked:
        out.setdefault(one.lag, one)
    return list(out.values())


def _columns(u: Array, h: float, zones: Array, lag: float) -> Array:
    """Positions for a gain of 1 each way and without delay, (n, 2 zones)."""
    ways = [np.maximum(s * u - d, 0.0) * s for s, d in product((1.0, -1.0), zones)]
    return np.column_stack([lagged(w, h, 0.0, lag).y for w in ways])


def _flat(run: Run, columns: Array, late: int, every: int) -> Array:
    """Columns (n, d) of a run, later by so many samples, every so manieth one less its window's
    mean."""
    size = round(AHEAD / run.h)
    rows = run.starts(AHEAD)[:, np.newaxis] + np.arange(0, size, every)
    taken = columns[np.maximum(rows - late, 0)]
    flat = taken - taken.mean(axis=1, keepdims=True)
    return np.asarray(flat.reshape(-1, columns.shape[1]))


def _best_pair(X: Array, y: Array) -> tuple[float, int, int, tuple[float, float]]:
    """The pair of columns, one of either half of X, that leaves least of y, and their factors."""
    half = X.shape[1] // 2
    gram, to_y = X.T @ X, X.T @ y
    a, d = np.diag(gram)[:half, np.newaxis], np.diag(gram)[np.newaxis, half:]
    b = gram[:half, half:]
    tiny = 1e-12 * max(float(np.max(np.diag(gram))), 1e-300)
    a, d = a + tiny, d + tiny
    p, n = to_y[:half, np.newaxis], to_y[np.newaxis, half:]
    det = np.maximum(a * d - b**2, tiny**2)
    g_p, g_n = (d * p - b * n) / det, (a * n - b * p) / det
    left = float(y @ y) - (g_p * p + g_n * n)
    at = np.unravel_index(int(np.argmin(left)), left.shape)
    return float(left[at]), int(at[0]), int(at[1]), (float(g_p[at]), float(g_n[at]))
