"""Closed loop in simulation: position controller, force loop, noise, actuator, Karnopp plant.

Paper, figure 5, its sampled version, figure 10, and figure 1, upper part (a motor); without the
compensator. Continuous controllers are sampled at h by `design.pid`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.signal import lfilter

from design.force_pi import ForcePI
from design.loop_kernels import (
    RECORD_F,
    RECORD_MODE,
    RECORD_U,
    RECORD_V,
    RECORD_Y,
    RECORDS,
    loop_kernel,
    loops_kernel,
    motor_kernel,
)
from design.rst import RST
from identification.arrays import Array, IntArray, frozen
from identification.errors import BadModel
from identification.model.plant import Actuator, Motor, Plant
from identification.simulation.karnopp_lanes import WIDTH
from identification.simulation.karnopp_step import kernel_parameters


@dataclass(frozen=True, eq=False)
class Cascade:
    """Position controller above a force loop, the command |u| [V] at most `control_limit`.

    position: (T r - R y)/S gives the force reference [N], with a Motor the command [V]; force:
    from the force error to the command, None with a Motor.
    """

    position: RST
    force: ForcePI | None
    control_limit: float | None = None


@dataclass(frozen=True, eq=False)
class LoopNoise:
    """Noise of the sensors, added to y [m] and F [N] at every sample: (n,), or (n, plants)."""

    y: Array
    F: Array

    @classmethod
    def draw(cls, n: int, sd_y: float, sd_F: float, rng: np.random.Generator) -> "LoopNoise":
        """White noise of these standard deviations, `n` samples."""
        return cls(frozen(sd_y * rng.standard_normal(n)), frozen(sd_F * rng.standard_normal(n)))


@dataclass(frozen=True, eq=False)
class LoopRun:
    """One run of the loop: t [s], r, y [m], v [m/s], F [N], u [V] and mode, shape (n,).

    y, v, F are the plant's own; y_measured, F_measured what the controllers see of them. From
    `simulate_loops` all but t and r have the shape (n, plants).
    """

    t: Array
    r: Array
    y: Array
    v: Array
    F: Array
    y_measured: Array
    F_measured: Array
    u: Array
    mode: IntArray


@dataclass(frozen=True, eq=False)
class LoopCosts:
    """Sums over the samples of a window, per plant: (r - y)^2 [m^2] and u^2 [V^2], (plants,)."""

    squared_error: Array
    squared_command: Array


@dataclass(frozen=True, eq=False)
class PreparedLoop:
    """A loop as the kernels take it; the position controller runs at every `ratio`-th sample."""

    motor: bool
    ratio: int
    reference: Array
    feed: Array
    R: Array
    S: Array
    x: Array
    pi: tuple[float, float]
    limit: float
    noise: LoopNoise
    start: tuple[float, float, float]


def simulate_loop(
    plant: Plant,
    cascade: Cascade,
    reference: ArrayLike,
    h: float,
    *,
    noise: LoopNoise | None = None,
    start: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> LoopRun:
    """The loop of figure 5 (figure 10) with an Actuator, of figure 1 with a Motor.

    cascade: sampled at h [s]; reference: r [m], (n,); start: y [m], v [m/s], F [N] at the first
    sample, before which the loop was at rest with r = y and no command.

    A clipped command holds the PI's integral while the error would drive it further; with a Motor
    the controller's recursion takes the command as clipped. The plant is stepped exactly: the run
    does not depend on an internal step. Raises BadModel where the parts do not fit together.
    """
    _refuse_effects([plant])
    loop, p = prepared_loop([plant], cascade, reference, h, noise, start)
    return one_run(loop, p, h)


def one_run(loop: PreparedLoop, p: Array, h: float) -> LoopRun:
    """The run of one plant p (1, 11) in its loop, sampled at h [s]."""
    n, x = len(loop.reference), loop.x.copy()
    # One block for all: several would be given back to the system and fetched again every time.
    block, modes = np.empty((7, n)), np.empty(n, dtype=np.int64)
    out, (y, v, F, u, y_measured, F_measured, t) = block[:4], block
    y_noise, f_noise = loop.noise.y[:, 0], loop.noise.F[:, 0]
    common = (loop.feed, loop.R, loop.S, x)
    if loop.motor:
        motor_kernel(p, h, *common, loop.limit, y_noise, loop.start, out, modes)
    else:
        sensors = (y_noise, f_noise)
        loop_kernel(
            p, h, loop.ratio, *common, loop.pi, loop.limit, *sensors, loop.start, out, modes
        )
    np.add(y, y_noise, out=y_measured)
    np.add(F, f_noise, out=F_measured)
    np.multiply(h, np.arange(n), out=t)
    return LoopRun(t, loop.reference, y, v, F, y_measured, F_measured, u, modes)


def simulate_loops(
    plants: Sequence[Plant],
    cascade: Cascade,
    reference: ArrayLike,
    h: float,
    *,
    noise: LoopNoise | None = None,
    start: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> LoopRun:
    """`simulate_loop` for many plants under one cascade, all at once: traces (n, plants).

    noise: (n,) for all plants, or (n, plants). All plants have an Actuator, or all a Motor.
    """
    _refuse_effects(plants)
    loop, p = prepared_loop(plants, cascade, reference, h, noise, start)
    traces, _ = _many(p, loop, h, (0, 0), record=True)
    recorded = traces[:, :, : len(plants)]
    y, F = recorded[RECORD_Y], recorded[RECORD_F]
    return LoopRun(
        t=h * np.arange(len(loop.reference), dtype=np.float64),
        r=loop.reference,
        y=y,
        v=recorded[RECORD_V],
        F=F,
        y_measured=y + loop.noise.y,
        F_measured=F + loop.noise.F,
        u=recorded[RECORD_U],
        mode=recorded[RECORD_MODE].astype(np.int64),
    )


def loop_costs(
    plants: Sequence[Plant],
    cascade: Cascade,
    reference: ArrayLike,
    h: float,
    *,
    noise: LoopNoise | None = None,
    start: tuple[float, float, float] = (0.0, 0.0, 0.0),
    window: tuple[int, int] | None = None,
) -> LoopCosts:
    """Squared error and command of `simulate_loops` over the samples `window`, no trace kept.

    window: first sample and the one after the last; all samples where it is None.
    """
    _refuse_effects(plants)
    loop, p = prepared_loop(plants, cascade, reference, h, noise, start)
    _, costs = _many(p, loop, h, window or (0, len(loop.feed)), record=False)
    return LoopCosts(costs[0, : len(plants)], costs[1, : len(plants)])


def _refuse_effects(plants: Sequence[Plant]) -> None:
    """These kernels know the Karnopp plant alone."""
    keys = sorted({one.key for plant in plants for one in plant.effects})
    if keys:
        raise BadModel(f"plant with effects {', '.join(keys)}: simulate it by simulate_servo")


def _many(
    p: Array, loop: PreparedLoop, h: float, window: tuple[int, int], record: bool
) -> tuple[Array, Array]:
    """Traces and costs of the plants p (plants, 11), and of copies of the last to fill a block."""
    padded = -(-len(p) // WIDTH) * WIDTH
    p = np.pad(p, ((0, padded - len(p)), (0, 0)), mode="edge")
    n = len(loop.feed)
    traces, costs = np.empty((RECORDS, n if record else 0, padded)), np.empty((2, padded))
    common = (h, loop.motor, loop.reference, loop.feed, loop.R, loop.S, loop.x, loop.pi, loop.limit)
    weights = np.zeros(n)
    weights[window[0] : window[1]] = 1.0
    noise = tuple(_in_blocks(a, padded) for a in (loop.noise.y, loop.noise.F))
    loops_kernel(p, *common, noise[0], noise[1], loop.start, weights, traces, costs)
    return traces, costs


def _in_blocks(noise: Array, width: int) -> Array:
    """Noise (n, plants) as the kernel takes it: (blocks, n, WIDTH); (n, 1) as (1, n, 1)."""
    n, plants = noise.shape
    if plants == 1:
        return noise[np.newaxis]
    blocks = np.pad(noise, ((0, 0), (0, width - plants))).reshape(n, -1, WIDTH)
    return np.ascontiguousarray(blocks.transpose(1, 0, 2))


def _parameters(plants: Sequence[Plant]) -> Array:
    return np.stack([kernel_parameters(p.friction.array, *_actuation(p)) for p in plants])


def _actuation(plant: Plant) -> tuple[float, float]:
    match plant.actuator:
        case Actuator(k1, k2):
            return k1, k2
        case Motor(k_a):
            return k_a, 0.0  # the kernels take k_a in the place of k1
        case None:
            raise BadModel("the plant has no actuator: a loop needs one, or a motor")


def prepared_loop(
    plants: Sequence[Plant],
    cascade: Cascade,
    reference: ArrayLike,
    h: float,
    noise: LoopNoise | None = None,
    start: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ratio: int = 1,
) -> tuple[PreparedLoop, Array]:
    """What the kernels take of a loop, and its plants' parameters (plants, 11).

    ratio: samples h of the force loop in one of the position controller. Raises BadModel where the
    parts do not fit together.
    """
    r, controller = frozen(reference), cascade.position
    force, limit = cascade.force, cascade.control_limit
    motors = {isinstance(plant.actuator, Motor) for plant in plants}
    if len(motors) != 1:
        raise BadModel(
            f"{len(plants)} plants, of {len(motors)} kinds: need one or more of one kind"
        )
    motor = motors.pop()
    if motor == (force is not None):
        need = "no force controller" if motor else "a force controller"
        raise BadModel(
            f"the loop of a plant with {'a motor' if motor else 'an actuator'} has {need}"
        )
    if abs(controller.h - ratio * h) > 1e-6 * h:
        raise BadModel(
            f"controller sampled at {controller.h:g} s, loop at {ratio * h:g} s; must be one"
        )
    if r.ndim != 1 or r.size == 0 or not np.all(np.isfinite(r)):
        raise BadModel(f"reference of shape {r.shape}: need finite values, one per sample")
    if limit is not None and not limit > 0:
        raise BadModel(f"control limit {limit:g} V, must be > 0")
    R, S, x = observer_form(controller, start[0])
    k_i, T_i = (force.k_i, force.T_i) if force else (0.0, 1.0)
    loop = PreparedLoop(
        motor=motor,
        ratio=ratio,
        reference=r,
        feed=_feed(controller, r[::ratio], start[0]),
        R=R,
        S=S,
        x=x,
        pi=(k_i, k_i * h / T_i),
        limit=math.inf if limit is None else limit,
        noise=checked_noise(noise, len(r), len(plants), motor),
        start=(0.0 + start[0], 0.0 + start[1], 0.0 + start[2]),
    )
    return loop, _parameters(plants)


def checked_noise(noise: LoopNoise | None, n: int, plants: int, motor: bool) -> LoopNoise:
    """Noise as (n, 1) or (n, plants); a motor's force is not measured."""
    if noise is None:
        return LoopNoise(np.zeros((n, 1)), np.zeros((n, 1)))
    columns = []
    for name, values in (("y", noise.y), ("F", noise.F)):
        # A copy: numba would compile once more for read-only arrays.
        a = np.array(values, dtype=np.float64, order="C")
        a = a[:, np.newaxis] if a.ndim == 1 else a
        if a.shape not in ((n, 1), (n, plants)):
            raise BadModel(f"noise of {name}: shape {values.shape}, need ({n},) or ({n}, {plants})")
        columns.append(a)
    return LoopNoise(columns[0], np.zeros((n, 1)) if motor else columns[1])


def observer_form(controller: RST, y_0: float) -> tuple[Array, Array, Array]:
    """R, S of one length (deg+1,), deg >= 2, S[0] = 1; the state that a past of y = y_0 leaves."""
    size = max(controller.R.size, controller.S.size, 3)
    R = np.pad(controller.R, (0, size - controller.R.size)) / controller.S[0]
    S = np.pad(controller.S, (0, size - controller.S.size)) / controller.S[0]
    x = y_0 * np.append(-np.cumsum(R[:0:-1])[::-1], 0.0)
    return R, S, x


def _feed(controller: RST, r: Array, y_0: float) -> Array:
    """T B_m/A_m r, (n,), after a past of r = y_0."""
    b = np.convolve(controller.T, controller.B_m) / controller.S[0]
    if controller.A_m.size == 1:
        past = np.full(b.size - 1, y_0)
        moved = np.convolve(np.concatenate([past, r]), b / controller.A_m[0], "valid")
        return np.asarray(moved, dtype=np.float64)[: r.size]
    steady = y_0 * b.sum() / controller.A_m.sum()
    size = max(b.size, controller.A_m.size)
    b = np.pad(b, (0, size - b.size)) / controller.A_m[0]
    a = np.pad(controller.A_m, (0, size - controller.A_m.size)) / controller.A_m[0]
    # State of the direct form II transposed at rest: input y_0, output `steady`.
    z = np.cumsum((y_0 * b - steady * a)[:0:-1])[::-1]
    return np.asarray(lfilter(b, a, r, zi=z)[0], dtype=np.float64)
