"""Two masses and a spring between them: a motor that is measured, and a load behind its shaft.

The position of the first mass in windows of free run (at most 0.5 s), of a linear system whose
friction acts on it along the measured motion:
    y = G(s) [F - (+-)F_c - F_v v] / (m_1 + m_2) + free motion,
    G(s) = (w_r/w_a)^2 (s^2 + 2 z_a w_a s + w_a^2) / (s^2 (s^2 + 2 z w_r s + w_r^2)),
    w_a^2 = k/m_2 (the motor stands still), w_r^2 = k (1/m_1 + 1/m_2), z_a w_r = z w_a.
F comes late by what a log puts between its columns, which an anti-resonance is not to take up. All
but the two frequencies, the damping and this lag are linear and solved within (variable
projection), so these four alone are searched. One body in the same windows, at its own lag, is
what it has to beat. In every window the body goes one way: at a reversal or a stop the friction is
none that the motion prescribes. Windows that leave three times the median square, in which it
stopped unseen, are left out of both.
Sources: drives with an elastic shaft, Schroeder, Elektrische Antriebe - Regelung von
Antriebssystemen, 4th ed., chapter 19; variable projection, Golub, Pereyra, SIAM J. Numer. Anal. 10
(1973) 413.
"""

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import optimize
from scipy.signal import cont2discrete, lfilter

from identification.arrays import Array, BoolArray
from identification.errors import UserError
from identification.estimation.estimates import reported_estimate
from identification.estimation.regression.motion_log import motion_log
from identification.estimation.regression.weighted_rows import (
    least_squares,
    left_out,
    spread_of_left_out,
)
from identification.log import Log, Rig
from identification.model.estimates import Estimate
from identification.model.karnopp import Karnopp
from identification.model.plant import units_of
from identification.model.resonance import Resonance
from identification.model.size import Size
from identification.thresholds import ASTRAY, BEYOND_CHANCE, FAR_LESS, WORSE

RUN_SECONDS, SHORTEST_RUN = 0.5, 0.05  # s
LEAST_CYCLES = 2.0  # of the resonance in a window of full length
HIGHEST_SHARE = 0.25  # of the sampling rate
SAMPLES_TAKEN = 12_000
HERTZ_TRIED = 24  # tried, on a scale of ratios
APART_TRIED = (1.1, 1.5, 2.2)  # of resonance to anti-resonance
# Where the search may go, in logarithms: the slowest below half the rate of samples; resonance and
# anti-resonance apart (a load 400 times the motor); dampings.
SLOWEST_SWING, MOST_APART, DAMPING_RANGE = 12.0, 3.0, (-10.0, 2.0)
BEGUN = 0.03  # damping with which the search begins
SEARCHES_RUN, EACH_SEARCH = 3, 25  # of the search
GRADIENT_STEP = 1e-5  # of the logarithms, for the gradient: recursions round off at 1e-10
FEWEST_RUNS = 8
MOST_LAG = 4  # samples between force and position, to either side
ONE_BODY = (np.ones(1), np.array([1.0, 0.0, 0.0]))  # y = F / (m s^2), for a unit mass


@dataclass(frozen=True, eq=False)
class _Window:
    """Position [m] from its first sample on, (n,), force [N] from MOST_LAG samples before it to as
    many after its last, and friction of unit size in columns (n, 4): Coulomb each way, viscous each
    way."""

    y: Array
    force: Array
    friction: Array

    def inputs(self, lag: float) -> Array:
        """Force, late by so many samples, and friction, (n, 5)."""
        whole = int(np.floor(lag))
        first = MOST_LAG - whole
        now, before = (self.force[at : at + len(self.y)] for at in (first, first - 1))
        late = now + (lag - whole) * (before - now)
        return np.column_stack([late, self.friction])


@dataclass(frozen=True, eq=False)
class _Linear:
    """A linear system from force to position as its polynomials in s, of unit mass, and its free
    motion at times t [s] of a window (n,), in columns."""

    top: Array
    below: Array
    free: Callable[[Array], Array]

    @classmethod
    def of(cls, p: Array, h: float) -> "_Linear":
        """Two masses of this shape."""
        w_a, w_r, damping = _shape(p, h)
        top = np.array([1.0, 2.0 * damping * w_a**2 / w_r, w_a**2]) * (w_r / w_a) ** 2
        below = np.array([1.0, 2.0 * damping * w_r, w_r**2, 0.0, 0.0])
        decay, turn = damping * w_r, w_r * np.sqrt(max(1.0 - min(damping, 0.99) ** 2, 1e-4))

        def free(t: Array) -> Array:
            decaying = np.exp(-decay * t)
            return np.column_stack(
                [_drift(t), decaying * np.cos(turn * t), decaying * np.sin(turn * t)]
            )

        return cls(top, below, free)


def two_masses(logs: Sequence[Log], rig: Rig) -> Resonance | None:
    """A resonance of two masses, where it explains most of what one body leaves; None elsewhere.

    logs: each with y [m] and F [N], without what acts beside the applied force. Intervals are by
    the scatter between windows. Sources: elastic shaft, Schroeder, chapter 19; variable projection,
    Golub, Pereyra (1973); Levenberg (1944), Marquardt (1963); jackknife, Tukey (1958).
    """
    h = logs[0].h
    try:
        cut = _windows(logs, zoh=rig.kind == "motor")
    except UserError:
        return None
    lowest, highest = LEAST_CYCLES / RUN_SECONDS, HIGHEST_SHARE / h
    if len(cut) < FEWEST_RUNS or not lowest < highest:
        return None
    tried = [
        np.append(np.log([2.0 * np.pi * f / ratio, 2.0 * np.pi * f, BEGUN]), 0.0)
        for f in np.geomspace(lowest, highest, HERTZ_TRIED)
        for ratio in APART_TRIED
    ]
    starts = sorted(tried, key=lambda p: _square(p, cut, h))[:SEARCHES_RUN]
    every = [_nearest(p, cut, h, 4 * EACH_SEARCH) for p in starts]
    found = min(every, key=lambda p: _square(p, cut, h))
    each = _of_windows(_left_of(found, cut, h), cut)
    cut = [one for one, left in zip(cut, each, strict=True) if left <= ASTRAY * np.median(each)]
    found = _nearest(found, cut, h, 4 * EACH_SEARCH)
    w_a, w_r, damping = _shape(found, h)
    inside = 2.0 * np.pi * lowest < w_r < 2.0 * np.pi * highest and shows_a_load(w_r, w_a)
    if not inside or not are_two(_one_body(cut, h), _square(found, cut, h)):
        return None
    return _resonance(found, cut, h, damping)


def position_errors(
    found: Resonance, train: Sequence[Log], test: Sequence[Log], rig: Rig
) -> tuple[float, float] | None:
    """Root mean square [m] of the position of test logs in windows of at most RUN_SECONDS, beside
    free motion, that one body and two masses leave, both with the numbers that fit the training
    logs best; None where the test logs have no such window.

    Held-out prediction of a measured signal: Stone, J. R. Stat. Soc. B 36 (1974) 111.
    """
    h, zoh = train[0].h, rig.kind == "motor"
    cut, seen = _windows(train, zoh=zoh), _windows(test, zoh=zoh)
    if not seen:
        return None
    shape = np.log([2.0 * np.pi * found.anti_resonance.value, 2.0 * np.pi * found.frequency.value,
                    found.damping.value])  # fmt: skip
    out = []
    for system in (_Linear(*ONE_BODY, _drift), _Linear.of(shape, h)):
        lag = _best_lag(cut, system, h)
        theta = _left(cut, system, lag, h)[1]
        X, b = _columns(seen, system, lag, h)
        out.append(float(np.sqrt(np.mean((b - X @ theta) ** 2))))
    return out[0], out[1]


def _one_body(cut: Sequence[_Window], h: float) -> float:
    """The square that one body leaves of all windows, at its best lag."""
    system = _Linear(*ONE_BODY, _drift)
    left = _left(cut, system, _best_lag(cut, system, h), h)[0]
    return float(left @ left)


def _best_lag(cut: Sequence[_Window], system: _Linear, h: float) -> float:
    """The lag of the force in samples at which a system leaves least of all windows."""

    def square(lag: float) -> float:
        left = _left(cut, system, lag, h)[0]
        return float(left @ left)

    most = MOST_LAG - 1.0
    return float(optimize.minimize_scalar(square, bounds=(-most, most), method="bounded").x)


def _of_windows(left: Array, cut: Sequence[_Window]) -> Array:
    """The square left of each window."""
    ends = np.cumsum([len(one.y) for one in cut])[:-1]
    return np.array([part @ part for part in np.split(left, ends)])


def shows_a_load(resonance: float, anti_resonance: float) -> bool:
    """Whether a resonance lies so far above its anti-resonance that a second mass shows."""
    return resonance > WORSE * anti_resonance


def are_two(one_body: float, left: float) -> bool:
    """Whether two masses that leave this of a square, in place of one body's, explain it."""
    return left <= FAR_LESS * one_body


def of_two_masses(
    found: Resonance, friction: Karnopp, estimates: Mapping[str, Estimate]
) -> tuple[Karnopp, dict[str, Estimate]]:
    """Friction and estimates of one body with the mass and the friction of sliding that two masses
    show, which one body's motion bends."""
    sizes = {"m": found.mass, "F_cp": found.F_cp, "F_cn": found.F_cn, "F_vp": found.F_vp}
    sizes["F_vn"] = found.F_vn
    values = {name: max(one.value, 0.0) for name, one in sizes.items()}
    reported = {
        name: reported_estimate(one.value, estimates[name].unit, one.sd, bounds=(0.0, np.inf))
        for name, one in sizes.items()
    }
    return replace(friction, **values), {**estimates, **reported}


def resonance_estimates(found: Resonance, rig: Rig) -> dict[str, Estimate]:
    """Frequencies, damping and both masses with their intervals."""
    unit = units_of(rig.motion)["m"]
    sizes = {
        "frequency": (found.frequency, "Hz"), "anti_resonance": (found.anti_resonance, "Hz"),
        "damping": (found.damping, "1"), "m_1": (found.m_1, unit), "m_2": (found.m_2, unit),
    }  # fmt: skip
    return {name: reported_estimate(one.value, unit, one.sd) for name, (one, unit) in sizes.items()}


def _nearest(p: Array, cut: Sequence[_Window], h: float, runs: int) -> Array:
    """The nearest minimum of what two masses leave (Levenberg 1944, Marquardt 1963)."""
    size = np.sqrt(np.mean(_left_of(p, cut, h) ** 2))  # in m or rad a gradient is soon "small"

    def left(tried: Array) -> Array:
        return np.asarray(_left_of(tried, cut, h) / size)

    apart = np.full(len(p), GRADIENT_STEP)
    found = optimize.least_squares(left, p, method="lm", max_nfev=runs, diff_step=apart)
    return np.asarray(found.x)


def _resonance(p: Array, cut: Sequence[_Window], h: float, damping: float) -> Resonance | None:
    """The resonance with its deviations, by leaving out a tenth of the windows in turn."""
    whole = _numbers(p, cut, h)

    def without(kept: BoolArray) -> Array:
        some = [one for one, stays in zip(cut, kept, strict=True) if stays]
        return _numbers(_nearest(p, some, h, EACH_SEARCH), some, h)

    sd = spread_of_left_out(left_out(np.arange(len(cut)) % min(10, len(cut)), without))
    sizes = [Size(float(value), float(s)) for value, s in zip(whole, sd, strict=True)]
    made = Resonance(*sizes)
    sure = all(one.value > BEYOND_CHANCE * one.sd for one in (made.frequency, made.m_1, made.m_2))
    return made if sure and damping < 1.0 else None


def _numbers(p: Array, cut: Sequence[_Window], h: float) -> Array:
    """Resonance and anti-resonance [Hz], damping, both masses [kg], and the friction (4,) [N]."""
    _, theta = _two_bodies(p, cut, h)
    w_a, w_r, damping = _shape(p, h)
    mass = 1.0 / theta[0]
    first = mass * (w_a / w_r) ** 2
    own = [w_r / (2.0 * np.pi), w_a / (2.0 * np.pi), damping, first, mass - first]
    return np.array([*own, *(mass * theta[1:])])


def _shape(p: Array, h: float) -> tuple[float, float, float]:
    """Anti-resonance and resonance [rad/s], as a log of samples every h [s] can hold them, and
    damping."""
    fastest = np.log(np.pi / h)
    anti = np.clip(p[0], fastest - SLOWEST_SWING, fastest)
    near = np.clip(p[1], anti - MOST_APART, min(anti + MOST_APART, fastest))
    w_a, w_r, damping = np.exp([anti, near, np.clip(p[2], *DAMPING_RANGE)]).tolist()
    return w_a, w_r, damping


def _square(p: Array, cut: Sequence[_Window], h: float) -> float:
    """The square that two masses leave of all windows."""
    left = _left_of(p, cut, h)
    return float(left @ left)


def _left_of(p: Array, cut: Sequence[_Window], h: float) -> Array:
    return _two_bodies(p, cut, h)[0]


def _two_bodies(p: Array, cut: Sequence[_Window], h: float) -> tuple[Array, Array]:
    """What two masses leave of every window, and the linear parameters (5,) over the mass."""
    lag = float(np.clip(p[3], 1.0 - MOST_LAG, MOST_LAG - 1.0))
    return _left(cut, _Linear.of(p, h), lag, h)


def _drift(t: Array) -> Array:
    """Free motion of one body: place and velocity at the begin of a window."""
    return np.asarray(np.column_stack([np.ones(len(t)), t]), dtype=np.float64)


def _left(cut: Sequence[_Window], system: _Linear, lag: float, h: float) -> tuple[Array, Array]:
    """What a linear system leaves of all windows beside its free motion under a force late by `lag`
    samples, and its inputs' sizes."""
    X, b = _columns(cut, system, lag, h)
    theta = least_squares(X, b)
    return np.asarray(b - X @ theta), theta


def _columns(cut: Sequence[_Window], system: _Linear, lag: float, h: float) -> tuple[Array, Array]:
    """What each input of unit size makes of the position in all windows, (r, 5), and the position
    (r,), both beside the system's free motion."""
    sampled: Any = cont2discrete((system.top, system.below), h, "zoh")
    top, below = np.ravel(sampled[0]), sampled[1]
    columns, y = [], []
    bases: dict[int, Array] = {}
    for one in cut:
        n = len(one.y)
        if n not in bases:
            t = np.asarray(h * np.arange(n), dtype=np.float64)
            bases[n] = np.linalg.qr(system.free(t))[0]
        q = bases[n]
        x = lfilter(top, below, one.inputs(lag), axis=0)
        columns.append(x - q @ (q.T @ x))
        y.append(one.y - q @ (q.T @ one.y))
    return np.vstack(columns), np.concatenate(y)


def _windows(logs: Sequence[Log], *, zoh: bool) -> list[_Window]:
    """Windows of the logs in which the body goes one way."""
    out: list[_Window] = []
    for log in logs:
        one = motion_log(log, zoh=zoh, by_command=False)
        y, d = np.asarray(log["y"]), np.asarray(one.signals["d"])
        # The mean of each interval: a smoothed velocity lacks what swings fast.
        v = np.diff(y, append=y[-1]) / log.h
        up, down = 1.0 * (d > 0.0), 1.0 * (d < 0.0)
        F = np.pad(np.asarray(log["F"]), MOST_LAG, mode="edge")
        friction = np.column_stack([-up, down, -v * up, -v * down])
        taken = min(len(log), SAMPLES_TAKEN // len(logs))
        longest, shortest = (max(2, round(s / log.h)) for s in (RUN_SECONDS, SHORTEST_RUN))
        turns = [0, *(np.flatnonzero(np.diff(d[:taken])) + 1), taken]
        for begin, end in itertools.pairwise(turns):
            for first in range(begin, end if d[begin] else begin, longest):
                at = slice(first, min(first + longest, end))
                on = d[begin] * y[at]
                back = np.max(np.maximum.accumulate(on) - on)
                if len(on) >= shortest and back <= BEYOND_CHANCE * one.noise.y:
                    force = F[first : at.stop + 2 * MOST_LAG]
                    out.append(_Window(y[at] - y[first], force, friction[at]))
    return out
