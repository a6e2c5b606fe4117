"""Two masses and a spring between them: a motor that is measured, and a load behind its shaft.

The position of the first mass in windows of free run (0.5 s), of a linear system whose friction
acts on it along the measured motion:
    y = G(s) [F - (+-)F_c - F_v v] / (m_1 + m_2) + free motion,
    G(s) = (w_r/w_a)^2 (s^2 + 2 z_a w_a s + w_a^2) / (s^2 (s^2 + 2 z w_r s + w_r^2)),
    w_a^2 = k/m_2 (the motor stands still), w_r^2 = k (1/m_1 + 1/m_2), z_a w_r = z w_a.
All but the two frequencies and the damping are linear and solved within (variable projection), so
these three alone are searched. One body in the same windows is what it has to beat. Windows that
leave three times the median square, in which the body stops, are left out of both.
Sources: drives with an elastic shaft, Schroeder, Elektrische Antriebe - Regelung von
Antriebssystemen, 4th ed., chapter 19; variable projection, Golub, Pereyra, SIAM J. Numer. Anal. 10
(1973) 413.
"""

from collections.abc import Callable, Sequence
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
from identification.model.estimates import Estimate, KarnoppFit
from identification.model.plant import units_of
from identification.model.resonance import Resonance
from identification.model.size import Size
from identification.thresholds import ASTRAY, BEYOND_CHANCE, FAR_LESS, WORSE

RUN_SECONDS = 0.5  # s
LEAST_CYCLES = 2.0  # of the resonance in a window
HIGHEST_SHARE = 0.25  # of the sampling rate
SAMPLES_TAKEN = 12_000
HERTZ_TRIED = 24  # tried, on a scale of ratios
APART_TRIED = (1.1, 1.5, 2.2)  # of resonance to anti-resonance
BEGUN = 0.03  # damping with which the search begins
SEARCHES_RUN, EACH_SEARCH = 3, 25  # of the search
FEWEST_RUNS = 8
ONE_BODY = (np.ones(1), np.array([1.0, 0.0, 0.0]))  # y = F / (m s^2), for a unit mass


@dataclass(frozen=True, eq=False)
class _Window:
    """Position [m] from its first sample on, (n,), and inputs in columns (n, 5): force, Coulomb
    friction each way, viscous friction each way, of unit size."""

    y: Array
    inputs: Array


def two_masses(logs: Sequence[Log], rig: Rig) -> Resonance | None:
    """A resonance of two masses, where it explains most of what one body leaves; None elsewhere.

    logs: each with y [m] and F [N], without what acts beside the applied force. Intervals are by
    the scatter between windows. Sources: elastic shaft, Schroeder, chapter 19; variable projection,
    Golub, Pereyra (1973); Levenberg (1944), Marquardt (1963); jackknife, Tukey (1958).
    """
    h = logs[0].h
    try:
        cut = _windows(logs, zoh=rig.kind == "motor", length=round(RUN_SECONDS / h))
    except UserError:
        return None
    lowest, highest = LEAST_CYCLES / RUN_SECONDS, HIGHEST_SHARE / h
    if len(cut) < FEWEST_RUNS or not lowest < highest:
        return None
    tried = [
        np.log([2.0 * np.pi * f / ratio, 2.0 * np.pi * f, BEGUN])
        for f in np.geomspace(lowest, highest, HERTZ_TRIED)
        for ratio in APART_TRIED
    ]
    starts = sorted(tried, key=lambda p: float(np.sum(_left_of(p, cut, h) ** 2)))[:SEARCHES_RUN]
    every = [_nearest(p, cut, h, 4 * EACH_SEARCH) for p in starts]
    found = min(every, key=lambda one: float(one.cost))
    each = _of_windows(found.fun, cut)
    cut = [one for one, left in zip(cut, each, strict=True) if left <= ASTRAY * np.median(each)]
    found = _nearest(found.x, cut, h, 4 * EACH_SEARCH)
    one_body = _left(cut, ONE_BODY, h, _drift)[0]
    w_a, w_r, damping = (float(x) for x in np.exp(found.x))
    inside = 2.0 * np.pi * lowest < w_r < 2.0 * np.pi * highest and shows_a_load(w_r, w_a)
    if not inside or not are_two(float(one_body @ one_body), float(found.fun @ found.fun)):
        return None
    return _resonance(found.x, cut, h, damping)


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


def of_two_masses(fit: KarnoppFit, found: Resonance) -> KarnoppFit:
    """The fit with the mass and the friction of sliding that two masses show, which one body's
    motion bends."""
    sizes = {"m": found.mass, "F_cp": found.F_cp, "F_cn": found.F_cn, "F_vp": found.F_vp}
    sizes["F_vn"] = found.F_vn
    values = {name: max(one.value, 0.0) for name, one in sizes.items()}
    reported = {
        name: reported_estimate(one.value, fit.estimates[name].unit, one.sd, bounds=(0.0, np.inf))
        for name, one in sizes.items()
    }
    return replace(
        fit, friction=replace(fit.friction, **values), estimates={**fit.estimates, **reported}
    )  # fmt: skip


def resonance_estimates(found: Resonance, rig: Rig) -> dict[str, Estimate]:
    """Frequencies, damping and both masses with their intervals."""
    unit = units_of(rig.motion)["m"]
    sizes = {
        "frequency": (found.frequency, "Hz"), "anti_resonance": (found.anti_resonance, "Hz"),
        "damping": (found.damping, "1"), "m_1": (found.m_1, unit), "m_2": (found.m_2, unit),
    }  # fmt: skip
    return {name: reported_estimate(one.value, unit, one.sd) for name, (one, unit) in sizes.items()}


def _nearest(p: Array, cut: Sequence[_Window], h: float, runs: int) -> Any:
    """The nearest minimum of what two masses leave (Levenberg 1944, Marquardt 1963)."""
    return optimize.least_squares(_left_of, p, method="lm", max_nfev=runs, args=(cut, h))


def _resonance(p: Array, cut: Sequence[_Window], h: float, damping: float) -> Resonance | None:
    """The resonance with its deviations, by leaving out a tenth of the windows in turn."""
    whole = _numbers(p, cut, h)

    def without(kept: BoolArray) -> Array:
        some = [one for one, stays in zip(cut, kept, strict=True) if stays]
        return _numbers(_nearest(p, some, h, EACH_SEARCH).x, some, h)

    sd = spread_of_left_out(left_out(np.arange(len(cut)) % min(10, len(cut)), without))
    sizes = [Size(float(value), float(s)) for value, s in zip(whole, sd, strict=True)]
    made = Resonance(*sizes)
    sure = all(one.value > BEYOND_CHANCE * one.sd for one in (made.frequency, made.m_1, made.m_2))
    return made if sure and damping < 1.0 else None


def _numbers(p: Array, cut: Sequence[_Window], h: float) -> Array:
    """Resonance and anti-resonance [Hz], damping, both masses [kg], and the friction (4,) [N]."""
    _, theta = _two_bodies(p, cut, h)
    w_a, w_r, damping = np.exp(p)
    mass = 1.0 / theta[0]
    first = mass * (w_a / w_r) ** 2
    own = [w_r / (2.0 * np.pi), w_a / (2.0 * np.pi), damping, first, mass - first]
    return np.array([*own, *(mass * theta[1:])])


def _left_of(p: Array, cut: Sequence[_Window], h: float) -> Array:
    return _two_bodies(p, cut, h)[0]


def _two_bodies(p: Array, cut: Sequence[_Window], h: float) -> tuple[Array, Array]:
    """What two masses leave of every window, and the linear parameters (5,) over the mass."""
    w_a, w_r, damping = (float(x) for x in np.exp(np.clip(p, -10.0, 11.0)))
    top = np.array([1.0, 2.0 * damping * w_a**2 / w_r, w_a**2]) * (w_r / w_a) ** 2
    below = np.array([1.0, 2.0 * damping * w_r, w_r**2, 0.0, 0.0])
    decay, turn = damping * w_r, w_r * np.sqrt(max(1.0 - min(damping, 0.99) ** 2, 1e-4))

    def free(t: Array) -> Array:
        decaying = np.exp(-decay * t)
        return np.column_stack(
            [_drift(t), decaying * np.cos(turn * t), decaying * np.sin(turn * t)]
        )

    return _left(cut, (top, below), h, free)


def _drift(t: Array) -> Array:
    """Free motion of one body: place and velocity at the begin of a window."""
    return np.asarray(np.column_stack([np.ones(len(t)), t]), dtype=np.float64)


def _left(
    cut: Sequence[_Window], system: tuple[Array, Array], h: float, free: Callable[[Array], Array]
) -> tuple[Array, Array]:
    """What a linear system, as its polynomials in s, leaves of all windows beside its free motion,
    and its inputs' sizes."""
    sampled: Any = cont2discrete(system, h, "zoh")
    top, below = np.ravel(sampled[0]), sampled[1]
    columns, y = [], []
    bases: dict[int, Array] = {}
    for one in cut:
        n = len(one.y)
        if n not in bases:
            bases[n] = np.linalg.qr(free(np.asarray(h * np.arange(n), dtype=np.float64)))[0]
        q = bases[n]
        x = lfilter(top, below, one.inputs, axis=0)
        columns.append(x - q @ (q.T @ x))
        y.append(one.y - q @ (q.T @ one.y))
    X, b = np.vstack(columns), np.concatenate(y)
    theta = least_squares(X, b)
    return np.asarray(b - X @ theta), theta


def _windows(logs: Sequence[Log], *, zoh: bool, length: int) -> list[_Window]:
    """Windows of the logs in which the body moves."""
    out: list[_Window] = []
    for log in logs:
        one = motion_log(log, zoh=zoh, by_command=False)
        v, F, y = one.signals["v"], np.asarray(log["F"]), np.asarray(log["y"])
        up, down = 1.0 * (v > 0.0), 1.0 * (v < 0.0)
        inputs = np.column_stack([F, -up, down, -v * up, -v * down])
        for begin in range(0, min(len(log), SAMPLES_TAKEN // len(logs)) - length + 1, length):
            at = slice(begin, begin + length)
            if np.any(one.signals["d"][at] != 0.0):
                out.append(_Window(y[at] - y[begin], inputs[at]))
    return out
