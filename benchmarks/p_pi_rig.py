"""Machines of `drives` under a program of ours in place of their own loop, on the same physics."""

from dataclasses import dataclass

import numpy as np

from benchmarks.drives_kernel import ALGEBRAIC, RATE, STUCK, run, through
from benchmarks.drives_rig import Machine, stream, trajectory
from design.closed_loop.driven_loop import DrivenLoop
from design.servo import servo_law, servo_memory
from design.servo_kernels import Law, Memory, servo_step
from identification.arrays import Array
from identification.compiled import compiled

SIZES_OF_NONE = 25  # effects of `drives_kernel`, all 0
LAST_OF_A_DWELL = 0.05  # s, over which a dwell's error is taken
SHORTEST_JUDGED = 0.1  # s, of a dwell


@dataclass(frozen=True, eq=False)
class Ride:
    """A run along a reference at the loop's ticks: reference and position [m], force [N], (n,)
    each."""

    h: float
    r: Array
    y: Array
    F: Array

    @property
    def rms(self) -> float:
        """Of the error along all of the reference [m]."""
        return float(np.sqrt(np.mean((self.r - self.y) ** 2)))

    @property
    def worst(self) -> float:
        """Largest error [m]."""
        return float(np.max(np.abs(self.r - self.y)))

    @property
    def peak(self) -> float:
        """Largest force [N]."""
        return float(np.max(np.abs(self.F)))

    @property
    def standing(self) -> float:
        """Root mean square error at the end of dwells [m]; 0 where there is none."""
        still = np.concatenate([[True], np.diff(self.r) == 0.0])
        count = np.zeros(len(still))
        for k in range(1, len(still)):
            count[k] = count[k - 1] + 1 if still[k] else 0
        ends = np.flatnonzero((count > SHORTEST_JUDGED / self.h) & (np.append(count[1:], 0) == 0))
        n = round(LAST_OF_A_DWELL / self.h)
        errors = [self.r[e - n : e] - self.y[e - n : e] for e in ends.tolist()]
        return float(np.sqrt(np.mean(np.concatenate(errors) ** 2))) if errors else 0.0


def reference_of(one: Machine, seed: int, part: str, path: str) -> tuple[Array, Array]:
    """Reference and the controller's own sensors' noise (2, n), at the loop's ticks."""
    rng = stream(seed, one.family, part)
    r = trajectory(one, path, rng)
    how = one.how
    noise = rng.standard_normal((2, len(r))) * [[how.noise_y], [how.noise_force * one.most]]
    return r, noise


def by_present(one: Machine, r: Array, noise: Array) -> Ride:
    """The run under the machine's own loop."""
    tick = RATE // one.how.loop_rate
    at = tick * np.arange(len(r))
    dr = np.gradient(r, 1.0 / one.how.loop_rate)
    effects = np.zeros(SIZES_OF_NONE)
    motion = run(
        one.nine.array, one.act, effects, one.loop, r, dr, noise, tick, at, np.zeros(len(r)), tick
    )
    return Ride(1.0 / one.how.loop_rate, r, motion[0], motion[2])


def by_program(one: Machine, loop: DrivenLoop, r: Array, noise: Array, per_output: float) -> Ride:
    """The run under the program of a design; per_output: command for each unit of its output."""
    h = 1.0 / one.how.loop_rate
    law = servo_law(loop.servo, h, loop.k_a or 0.0)
    memory = servo_memory(loop.servo, law, float(r[0]), 0.0)
    numbers = np.array([one.limit, one.how.count, per_output])
    tick = RATE // one.how.loop_rate
    y, F = _run(
        one.nine.array, one.act, np.zeros(SIZES_OF_NONE), law, memory, numbers, r, noise, tick
    )
    return Ride(h, r, y, F)


@compiled
def _run(
    p: Array, act: Array, e: Array, law: Law, memory: Memory, numbers: Array, r: Array,
    noise: Array, tick: int,
) -> tuple[Array, Array]:  # fmt: skip
    """Position and force (n,) at every tick; numbers: limit, encoder's count, per output."""
    limit, count, per_output = numbers
    y, F = np.zeros(len(r)), np.zeros(len(r))
    x = (r[0], 0.0, 0.0, 0.0, 0.0, r[0], 0.0, 0.0)
    mode, turned, dt = STUCK, 0.0, 1.0 / RATE
    for i in range(len(r)):
        seen = x[0] + noise[0, i]
        if count > 0.0:
            seen = count * np.round(seen / count)
        force = act[1] * 0.0 if act[0] == ALGEBRAIC else x[2] + noise[1, i]
        u = per_output * servo_step(law, memory, r[i], seen, force, 0.0)
        u = min(max(u, -limit), limit)
        y[i] = x[0]
        F[i] = act[1] * u if act[0] == ALGEBRAIC else x[2]
        for j in range(tick):
            x, mode = through(x, u, (i * tick + j) * dt, turned, mode, act, p, e, dt)
    return y, F
