"""Free run of a plant along a log: positions and forces that the model would have shown."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array, IntArray, read_only
from identification.compiled import compiled
from identification.errors import BadModel
from identification.log import Log
from identification.model.estimates import Drive
from identification.model.karnopp import Karnopp
from identification.model.plant import Actuator, Motor, Plant
from identification.simulation.effect_run import effect_run_kernel, effective_commands, shown_run
from identification.simulation.effect_table import (
    LONGEST_BRISTLE,
    effect_table,
    fewer,
    outside,
    pieces,
    signal_table,
)
from identification.simulation.karnopp_step import (
    COLUMNS,
    F_HI,
    F_LO,
    K1,
    K2,
    MODES,
    STUCK,
    exact_step,
    kernel_parameters,
    mode_at,
    mode_row,
    mode_table,
    parameters,
    resolve,
)

Restarts = tuple[IntArray, Array, Array] | tuple[IntArray, Array, Array, Array]


@dataclass(frozen=True)
class FreeRun:
    """Simulated position y [m], velocity v [m/s], force F [N] and mode at every sample, (n,).

    shown: position that the transducer shows [m]; it is y where no effect acts on the sensor.
    """

    y: Array
    v: Array
    F: Array
    mode: IntArray
    shown: Array


@compiled
def run_kernel(
    p: Array,
    h: float,
    forced: bool,
    gain: float,
    u: Array,
    force: Array,
    slope: Array,
    y_m: Array,
    at: IntArray,
    at_y: Array,
    at_v: Array,
    at_f: Array,
    out: Array,
    modes: IntArray,
) -> None:
    """One plant p (1, 11) along one log: out[:3] takes position, velocity, force; modes (n,).

    forced: take the force from `force` and `slope` at every sample, corrected by k2 (y_m - y);
    gain: share of its distance to `force` by which the run's own force is corrected at a sample,
    where it is not held; at, at_y, at_v, at_f: samples at which the run restarts, and from where.
    """
    table = np.zeros((MODES, COLUMNS))
    plant = parameters(p, 0)
    mode_table(plant, h, table)
    k1, k2 = plant[K1], plant[K2]
    y, v, f, mode = at_y[0], at_v[0], at_f[0], STUCK
    row = mode_row(table, mode)
    window = 0
    for k in range(len(u)):
        g = k1 * u[k]
        before = mode
        moved_here = window < len(at) and k == at[window]
        if moved_here:
            y, v, f = at_y[window], at_v[window], at_f[window]
            window += 1
        if forced:
            f = force[k] + k2 * (y_m[k] - y)
            following = k + 1 if k + 1 < len(u) else k
            g = slope[k] + k2 * (y_m[following] - y_m[k]) / h
        shown = f
        if gain > 0.0 and not moved_here:
            f += gain * (force[k] - f)
        observed = forced or gain > 0.0
        if moved_here or (observed and (f < row[F_LO] or f > row[F_HI])):
            mode = mode_at(plant, v, f)
            v = 0.0 if mode == STUCK else v
        if mode != before:
            row = mode_row(table, mode)
        out[0, k], out[1, k], out[2, k] = y, v, shown
        modes[k] = mode
        moved, v_next, f_next, left = exact_step(row, k2, h, v, f, g)
        if left:
            y, v, f, mode = resolve(plant, y, v, f, mode, g, h)
            row = mode_row(table, mode)
        else:
            y, v, f = y + moved, v_next, f_next


def force_slope(force: Array, h: float, hold: bool) -> Array:
    """Slope of the force between samples [N/s]: 0 where it is a zero-order hold (a motor), else
    linear."""
    if hold:
        return np.zeros(len(force))
    return np.append(np.diff(force) / h, 0.0)


def free_run(
    plant: Plant,
    log: Log,
    start: tuple[float, float, float],
    drive: Drive,
    *,
    stiffness: float = 0.0,
    restarts: Restarts | None = None,
    gain: float = 0.0,
    bristle_step: float = LONGEST_BRISTLE,
) -> FreeRun:
    """Response of `plant` to the log's command or force; it sees the measured position only where
    it restarts and, for `stiffness` > 0, through stiffness * (y_m - y) added to the force.

    start: position [m], velocity [m/s], force [N] at the first sample; restarts: samples (k,)
    from which the run starts anew, positions and velocities there, and forces [N] (the log's where
    they are not given); gain: share of its distance to the measured force by which the force
    of a run by command is corrected after each sample (F is the force before it); bristle_step:
    longest sub-step of a plant with a bristle [s]. The log must have an even clock.
    Raises BadModel where drive is "command" and the plant has no actuator.
    """
    if drive == "command" and not isinstance(plant.actuator, Actuator | Motor):
        raise BadModel("the model has no actuator: drive the run by the force, not by the command")
    motor = isinstance(plant.actuator, Motor)
    forced = drive == "force" or motor
    k1, k2 = 0.0, stiffness
    if isinstance(plant.actuator, Actuator) and not forced:
        k1, k2 = plant.actuator.k1, plant.actuator.k2
    gain = 0.0 if forced else gain
    k_a, force = _force(plant, log, drive, seen=forced or gain > 0.0)
    begun = _begun(log, start, force, restarts)
    out, modes = np.zeros((4, len(log))), np.zeros(len(log), dtype=np.int64)
    u = read_only(log["u"] if "u" in log else np.zeros(len(log)))
    force = read_only(force)
    slope = force_slope(force, log.h, hold=motor or log.zoh or not forced)
    p = kernel_parameters(plant.friction.array, k1, k2)[np.newaxis]
    driven = p, log.h, forced, gain
    if not plant.effects:
        run_kernel(*driven, u, force, slope, log["y"], *begun, out, modes)
        out[3] = out[0]
    else:
        table, signals = effect_table(plant.effects), signal_table(plant.effects, log)
        own = (table.codes, table.addresses, table.p, signals)
        if outside(table.codes):  # the body moves as that of the plain plant, stepped exactly
            acting = effective_commands(*own, np.zeros(len(table.codes)), log["t"], u, log.h)
            force = read_only(k_a * acting) if k_a != 0.0 else force
            run_kernel(*driven, read_only(acting), force, slope, log["y"], *begun, out, modes)
            shown_run(p, log.h, *own, log["t"], u, begun[0], out)
        else:
            count = pieces(table, log.h, bristle_step)
            few = fewer(table, count, bristle_step)
            effect_run_kernel(
                p, log.h, few, count, *own, forced, gain, k_a, log["t"], u, force, slope, log["y"],
                *begun, out, modes,
            )  # fmt: skip
    _refuse_lost(log, out[0])
    return FreeRun(out[0], out[1], out[2], modes, out[3])


def released(
    friction: Sequence[Karnopp], force: Array, h: float, *, hold: bool, level: float
) -> Array:
    """Positions (k, n) [m] of bodies of such friction, which rest at `level` and are free under the
    force (n,) [N], constant between samples or linear.

    Source: as `free_run`.
    """
    rows = np.array([kernel_parameters(one.array, 0.0, 0.0) for one in friction])
    out = np.full((len(rows), len(force)), level)
    slope = force_slope(force, h, hold)
    released_kernel(rows, h, read_only(force), slope, out)
    return out


@compiled
def released_kernel(p: Array, h: float, force: Array, slope: Array, out: Array) -> None:
    """Plants p (k, 11) that begin at rest: out (k, n) holds their positions and takes those of the
    motion."""
    first, rest = np.zeros(1, dtype=np.int64), np.zeros(1)
    for i in range(len(p)):
        run, modes = np.zeros((4, len(force))), np.zeros(len(force), dtype=np.int64)
        run_kernel(
            p[i : i + 1], h, True, 0.0, force, force, slope, out[i], first, out[i, :1].copy(), rest,
            force[:1].copy(), run, modes,
        )  # fmt: skip
        out[i] = run[0]


def _force(plant: Plant, log: Log, drive: Drive, seen: bool) -> tuple[float, Array]:
    """A motor's k_a (0 where it does not drive the run), and the force (n,) [N] that does.

    seen: the measured force has a part in the run.
    """
    if isinstance(plant.actuator, Motor) and drive == "command":
        return plant.actuator.k_a, plant.actuator.k_a * log["u"]
    return 0.0, log["F"] if seen else np.zeros(len(log))


def _refuse_lost(log: Log, y: Array) -> None:
    """Raises BadModel where the run (n,) has come to no number."""
    if not np.all(np.isfinite(y)):
        lost = float(log["t"][int(np.argmin(np.isfinite(y)))])
        raise BadModel(
            f"{log.name}: the simulated run cannot be followed beyond t = {lost:g} s (too many"
            " switches within one sample, or numbers without bound); check mass and band"
        )


def _begun(
    log: Log,
    start: tuple[float, float, float],
    force: Array,
    restarts: Restarts | None,
) -> tuple[IntArray, Array, Array, Array]:
    """Samples (k,) at which the run begins and begins anew, with position, velocity and force."""
    none = (np.zeros(0, dtype=np.int64), *np.zeros((2, 0)))
    at, at_y, at_v, *forces = none if restarts is None else restarts
    keep = at > 0
    at = np.concatenate([[0], at[keep]]).astype(np.int64)
    at_f = log["F"][at] if "F" in log else force[at]
    if forces:
        at_f = np.concatenate([at_f[:1], forces[0][keep]])
    at_f = np.concatenate([[start[2]], at_f[1:]])
    return at, np.append(start[0], at_y[keep]), np.append(start[1], at_v[keep]), at_f
