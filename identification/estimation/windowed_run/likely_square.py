"""Robust square sums of many plants' runs in windows at once: what the likelihood is made of.

A block holds WIDTH plants in lanes, as in `simulation/karnopp_lanes`. Those without effects are
simulated in it, a chunk at a time, so that a run is still in the cache when its errors are summed;
runs of any other plant come from outside. What compares a run with its log is common to all lanes.
"""

from dataclasses import dataclass

import numpy as np

from identification.arrays import Array, IntArray
from identification.compiled import compiled, compiled_inline
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.windowed_run.run_errors import ROBUST_FROM
from identification.estimation.windowed_run.windows import Freed, compared, driven_by
from identification.model.estimates import Drive
from identification.model.plant import Motor, Plant
from identification.simulation.free_run import force_slope
from identification.simulation.karnopp_lanes import (
    WIDTH,
    march,
    march_corrected,
    march_forced,
    place,
    prepare_lanes,
    work_space,
)

SAMPLES_TOGETHER = 64  # samples of all lanes that stay in the cache until their errors are summed
LARGE = 1e100  # product of factors of which the logarithm is taken, far from what overflows
START_STATES = 3  # of a window: y, v, F


@dataclass(frozen=True, eq=False)
class LikelyLog:
    """A log in windows as the kernel takes it: what drives plants along it, and what compares them.

    h [s]; u [V], force [N] and its slope [N/s] (n,); forced: the force drives, else the command;
    then the run's force is corrected by `gain` of its distance to the measured one. at (k,), begun
    (3, k): where windows begin. seen (2, n): position [m], force [N]; weight (2, n): of a distance
    to these, 0 where it does not count. B (3, 2, n), inverse (k, 3, 3): as in `windows.Freed`;
    errors and B are in parts of `far`, from which an error counts less.
    """

    h: float
    u: Array
    force: Array
    slope: Array
    forced: bool
    gain: float
    at: IntArray
    begun: Array
    seen: Array
    weight: Array
    B: Array
    inverse: Array
    far: float

    @classmethod
    def of(
        cls, plant: Plant, one: MotionLog, drive: Drive, own: Freed, far: float = ROBUST_FROM
    ) -> "LikelyLog":
        """Of plants with this one's drive, in the windows of `own`."""
        log, forced = driven_by(one, drive), one.is_forced(drive)
        u = np.array(log["u"]) if "u" in log else np.zeros(len(log))
        force = np.array(log["F"])
        if isinstance(plant.actuator, Motor):
            force = plant.actuator.k_a * u
        states = np.array([own.begun.y, own.begun.v, own.begun.F])
        if forced:
            states[2] = force[own.begun.at]
        signals, share, sd = compared(one, drive)
        rows, seen = len(signals), np.zeros((2, len(log)))
        weight, B = np.zeros_like(seen), np.zeros((START_STATES, *seen.shape))
        seen[:rows], B[:, :rows] = signals, own.B / far
        weight[:rows] = own.weight * (share / sd / far)[:, np.newaxis]
        return cls(
            log.h, u, force, force_slope(force, log.h, hold=one.zoh or not forced), forced,
            0.0 if forced else one.noise.corrected, own.begun.at, states, seen, weight, B,
            own.inverse, far,
        )  # fmt: skip

    def simulated(self, p: Array) -> Array:
        """Robust square sums (k,) of plants without effects, rows of kernel parameters (k, 11)."""
        rows = np.concatenate([p, np.repeat(p[:1], -len(p) % WIDTH, axis=0)])
        out = np.empty((int(np.max(np.diff(self.at, append=len(self.u)))), 2, WIDTH))
        blocks = [self._squares(rows[low : low + WIDTH], out) for low in range(0, len(p), WIDTH)]
        return np.concatenate(blocks)[: len(p)]

    def shown(self, runs: Array) -> Array:
        """Robust square sums (WIDTH,) of runs (n, 2, WIDTH): positions shown and forces."""
        return self._squares(np.empty((0, 0)), runs)

    def _squares(self, p: Array, out: Array) -> Array:
        square = np.zeros(WIDTH)
        square_kernel(
            p, self.h, self.u, self.force, self.slope, self.forced, self.gain, self.at, self.begun,
            self.seen, self.weight, self.B, self.inverse, self.far, out, square,
        )  # fmt: skip
        return np.where(np.isfinite(square), square, np.inf)


@compiled
def square_kernel(
    p: Array, h: float, u: Array, force: Array, slope: Array, forced: bool, gain: float,
    at: IntArray, begun: Array, seen: Array, weight: Array, B: Array, inverse: Array, far: float,
    out: Array, square: Array,
) -> None:  # fmt: skip
    """Robust square sums (WIDTH,) of a block's weighted errors less what is likeliest of the states
    in which the windows begin, and the square of these; of a run that is lost, not finite.

    p (WIDTH, 11): the plants, which are run into `out`, as long as a window; none: `out` (n, 2,
    WIDTH) holds runs. The states are the best linear prediction of a normal random effect
    (Robinson, Statistical Science 6 (1991) 15); robust as Cauchy's function (Holland, Welsch 1977).
    """
    s, modes, tables = work_space()
    if len(p) > 0:
        prepare_lanes(p, h, tables, s)
    states, sums = np.zeros((START_STATES, WIDTH)), np.zeros((START_STATES, WIDTH))
    square[:] = 0.0
    for w in range(len(at)):
        first, end = at[w], at[w + 1] if w + 1 < len(at) else len(u)
        begins = 0 if len(p) == 0 else first  # of `out`, as a sample
        for i in range(len(p)):
            place(s, modes, tables, p, i, begun[0, w], begun[1, w], begun[2, w])
        sums[:] = 0.0
        for low in range(first, end, SAMPLES_TOGETHER):
            high = min(low + SAMPLES_TOGETHER, end)
            part, driving = out[low - begins : high - begins], force[low:high]
            if len(p) > 0 and forced:  # nothing draws it to the log: k2 is 0
                march_forced(
                    p, tables, s, modes, seen[0, low:high], driving, slope[low:high],
                    slope[low:high], h, part,
                )  # fmt: skip
            elif len(p) > 0 and gain > 0.0:  # a window begins in the measured force itself
                march_corrected(p, tables, s, modes, u[low:high], driving, gain, h, part)
            elif len(p) > 0:
                march(p, tables, s, modes, u[low:high], h, part)
            _add_state_sums(part, seen, weight, B, low, sums)
        for i in range(WIDTH):
            for j in range(START_STATES):
                state = 0.0
                for other in range(START_STATES):
                    state += inverse[w, j, other] * sums[other, i] * far * far
                states[j, i] = state
                square[i] += state * state
            if not np.isfinite(out[end - begins - 1, 0, i]):
                square[i] = np.inf
        _add_robust(out[first - begins : end - begins], B, first, states, far, square)


@compiled
def _add_state_sums(
    out: Array, seen: Array, weight: Array, B: Array, low: int, sums: Array
) -> None:
    """Turn runs from sample `low` on, in `out`, into their errors r; add B'r to sums (3, WIDTH)."""
    runs, flat = out.reshape(-1), sums.reshape(-1)
    for k in range(len(out)):
        n, at = low + k, 2 * WIDTH * k
        y, F, w_y, w_F = seen[0, n], seen[1, n], weight[0, n], weight[1, n]
        y_0, y_1, y_2, F_0, F_1, F_2 = _changes(B, n)
        for i in range(WIDTH):
            r_y, r_F = (runs[at + i] - y) * w_y, (runs[at + WIDTH + i] - F) * w_F
            runs[at + i], runs[at + WIDTH + i] = r_y, r_F
            flat[i] += y_0 * r_y + F_0 * r_F
            flat[WIDTH + i] += y_1 * r_y + F_1 * r_F
            flat[2 * WIDTH + i] += y_2 * r_y + F_2 * r_F


@compiled
def _add_robust(r: Array, B: Array, low: int, states: Array, far: float, square: Array) -> None:
    """Add robust squares of r - B z, errors r (n, 2, WIDTH) from sample `low` on, z (3, WIDTH)."""
    errors, z, product = r.reshape(-1), states.reshape(-1), np.ones(WIDTH)
    for k in range(len(r)):
        at, large = 2 * WIDTH * k, 0
        y_0, y_1, y_2, F_0, F_1, F_2 = _changes(B, low + k)
        for i in range(WIDTH):
            a, b, c = z[i], z[WIDTH + i], z[2 * WIDTH + i]
            e_y = errors[at + i] - y_0 * a - y_1 * b - y_2 * c
            e_F = errors[at + WIDTH + i] - F_0 * a - F_1 * b - F_2 * c
            factor = product[i] * ((1.0 + e_y * e_y) * (1.0 + e_F * e_F))
            product[i] = factor
            large |= int(factor > LARGE) << i
        if large or k + 1 == len(r):
            for i in range(WIDTH):
                square[i] += np.log(product[i]) * far * far
                product[i] = 1.0


@compiled_inline
def _changes(B: Array, n: int) -> tuple[float, float, float, float, float, float]:
    """How the errors of position and force at sample n change with the three states."""
    return B[0, 0, n], B[1, 0, n], B[2, 0, n], B[0, 1, n], B[1, 1, n], B[2, 1, n]
