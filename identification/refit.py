"""Joint refinement of a plant with effects on its free run, from estimates already close.

The regression gives mass, sliding friction and effects; band and stick limits show only in how
the body starts and stops. All are refined together on the position (and force, where the command
drives) in windows, with the regression's estimates as a prior. No global search is needed.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from identification.arrays import Array, IntArray
from identification.errors import BadModel
from identification.evidence import Moving
from identification.karnopp import NAMES, Karnopp
from identification.plant import Actuator, Motor, Plant
from identification.result import Drive
from identification.simulate import FreeRun, free_run

SECONDS = 2.0  # of a window
ROBUST = 3.0  # residual in noise units from which it counts less
WHOLE = np.inf  # seconds of a window that is the whole log
FOLLOWED = 2.0  # robust square up to which a whole run is followed
LOOSE = 3.0  # times its standard deviation that the regression is trusted as a prior
STEP = 1e-4
TRIES = 6  # of the damping in one step
ENOUGH = 1e-5  # share of the cost below which a step is the last
BANDS = (0.15, 0.5, 1.0)
STICKS = (0.9, 1.0, 1.15, 1.4)


@dataclass(frozen=True, eq=False)
class Refit:
    """The plant refined, standard deviations by name (effects as key.name), and chi-square."""

    plant: Plant
    sd: dict[str, float]
    chi_square: float


def restarts(one: Moving, seconds: float = SECONDS) -> tuple[IntArray, Array, Array]:
    """Samples, positions and velocities from which windows start, at rest where one is near."""
    n, h = len(one.log), one.log.h
    step = max(2, round(min(seconds / h, 2.0 * n)))
    y, v, d = one.log["y"], one.signals["v"], one.signals["d"]
    reach = max(2, round(0.25 * step))
    at = [0]
    for wanted in range(step, n - step // 2, step):
        low, high = wanted - reach, min(wanted + reach, n)
        still = low + np.flatnonzero(d[low:high] == 0)
        at.append(int(still[np.argmin(np.abs(still - wanted))]) if len(still) else wanted)
    index = np.array(at, dtype=np.int64)
    width = 3
    level = np.array([float(np.mean(y[max(k - width, 0) : k + width + 1])) for k in at])
    moving = d[index] != 0
    return (
        index,
        np.where(moving, one.signals["smooth"][index], level),
        np.where(moving, v[index], 0.0),
    )


def window_run(plant: Plant, one: Moving, drive: Drive, seconds: float = SECONDS) -> FreeRun | None:
    """Free run in windows from measured states; None where the model cannot be followed."""
    at, y, v = restarts(one, seconds)
    F = float(one.log["F"][0])
    try:
        run = free_run(plant, one.log, (float(y[0]), float(v[0]), F), drive, restarts=(at, y, v))
        if any(acting.effect.acts == "sensor" for acting in plant.effects):
            body = y - (run.shown[at] - run.y[at])  # the measured start is what the sensor shows
            run = free_run(
                plant, one.log, (float(body[0]), float(v[0]), F), drive, restarts=(at, body, v)
            )
        return run
    except BadModel:
        return None


def position_rms(plant: Plant, logs: Sequence[Moving], drive: Drive) -> float | None:
    """Root mean square of the shown position's error in windows [m], over all logs."""
    squares: list[Array] = []
    for one in logs:
        run = window_run(plant, one, drive)
        if run is None:
            return None
        squares.append((run.shown - one.log["y"]) ** 2)
    return float(np.sqrt(np.mean(np.concatenate(squares))))


def names_of(plant: Plant, drive: Drive) -> list[str]:
    """Names of the parameters that are refined, effects' as key.name."""
    out = list(NAMES)
    if drive == "command" and isinstance(plant.actuator, Actuator):
        out += ["k1", "k2"]
    for acting in plant.effects:
        out += [f"{acting.key}.{p.name}" for p in acting.effect.params]
    return out


def values_of(plant: Plant, names: Sequence[str]) -> Array:
    """Their values."""
    every = dict(zip(NAMES, plant.friction.array.tolist(), strict=True))
    if isinstance(plant.actuator, Actuator):
        every |= {"k1": plant.actuator.k1, "k2": plant.actuator.k2}
    for acting in plant.effects:
        every |= {f"{acting.key}.{k}": v for k, v in acting.values.items()}
    return np.array([every[name] for name in names])


def plant_with(plant: Plant, names: Sequence[str], x: Array) -> Plant:
    """The plant with these values, put at their bounds where they lie outside."""
    every = dict(zip(names, x.tolist(), strict=True))
    nine = [every.get(name, getattr(plant.friction, name)) for name in NAMES]
    for i, name in enumerate(NAMES):
        nine[i] = min(nine[i], -1e-9) if name in ("dv_n", "F_sn") else max(nine[i], 1e-9)
    actuator: Actuator | Motor | None = plant.actuator
    if isinstance(actuator, Actuator) and "k1" in every:
        actuator = Actuator(max(every["k1"], 1e-9), max(every["k2"], 0.0))
    effects = []
    for acting in plant.effects:
        own = {
            p.name: float(
                np.clip(every.get(f"{acting.key}.{p.name}", acting.values[p.name]), p.low, p.high)
            )
            for p in acting.effect.params
        }
        effects.append(acting.effect.acting(own))
    return Plant(Karnopp(*nine), actuator, tuple(effects))


def residuals(
    plant: Plant, logs: Sequence[Moving], drive: Drive, seconds: float = SECONDS
) -> Array:
    """Position (and, by command, force) errors in units of the sensors' noise, all logs."""
    parts: list[Array] = []
    for one in logs:
        run = window_run(plant, one, drive, seconds)
        if run is None:
            parts.append(np.full(len(one.log) * (2 if drive == "command" else 1), 1e6))
            continue
        parts.append((run.shown - one.log["y"]) / one.noise_y)
        if drive == "command" and not one.held:
            parts.append((run.F - one.log["F"]) / max(one.noise_F, 1e-12))
    return np.concatenate(parts)


def loss(r: Array) -> float:
    """Robust cost."""
    return float(np.sum(np.log1p((r / ROBUST) ** 2)) * ROBUST**2)


def start_band(plant: Plant, logs: Sequence[Moving], drive: Drive, band: float) -> Plant:
    """The plant at the best of a few band widths and stick limits."""
    p = plant.friction
    tried = []
    for width, more in product(BANDS, STICKS):
        nine = replace(
            p, dv_p=width * band, dv_n=-width * band, F_sp=more * p.F_sp, F_sn=more * p.F_sn
        )
        tried.append(replace(plant, friction=nine))
    with ThreadPoolExecutor(2) as pool:
        costs = list(pool.map(lambda one: loss(residuals(one, logs, drive)), tried))
    return tried[int(np.argmin(costs))]


def refit(
    plant: Plant, logs: Sequence[Moving], drive: Drive, *, band: float, prior: dict[str, float],
    evaluations: int = 12,
) -> Refit:  # fmt: skip
    """All parameters refined together.

    band [m/s]: about the speed below which sliding friction does not hold; prior: standard
    deviations from the regression by name (others are free).
    """
    plant = start_band(plant, logs, drive, band)
    names = names_of(plant, drive)
    x0 = values_of(plant, names)
    unit = np.where(x0 != 0, np.abs(x0), 1.0)
    unit[[name.endswith("asymmetry") for name in names]] = 1.0
    trust = np.array([prior.get(name, np.inf) for name in names])
    tied = np.flatnonzero(np.isfinite(trust) & (trust > 0))
    # A shape at its bound, or an effect's default, has no say.
    open_ = np.array([i for i, name in enumerate(names) if prior.get(name, 1.0) != 0.0])

    def full(x: Array) -> Array:
        out = x0.copy()
        out[open_] = x * unit[open_]
        return out

    def left(x: Array, seconds: float) -> Array:
        r = residuals(plant_with(plant, names, full(x)), logs, drive, seconds)
        return np.asarray(np.sign(r) * np.sqrt(np.log1p((r / ROBUST) ** 2)) * ROBUST)

    def in_windows(x: Array) -> Array:
        pull = (full(x)[tied] - x0[tied]) / (LOOSE * trust[tied])
        return np.concatenate([left(x, SECONDS), pull])

    slow = any(acting.effect.acts == "bristle" for acting in plant.effects)
    if slow:  # its sub-steps are ten times shorter
        evaluations = min(evaluations, 4)
    x, J, cost = gauss_newton(in_windows, x0[open_] / unit[open_], evaluations)
    if drive == "command" and isinstance(plant.actuator, Actuator) and not slow:
        # F + k2 y follows the command, so a whole run does not drift: no window's start errs in it.
        again = gauss_newton(lambda at: left(at, WHOLE), x, evaluations)
        if again[2] / len(again[1]) < FOLLOWED:
            x, J, cost = again
    best = plant_with(plant, names, full(x))
    r = residuals(best, logs, drive)
    chi = float(np.mean(np.minimum(r**2, 1e6)))
    spread = np.sqrt(np.maximum(np.diag(np.linalg.pinv(J.T @ J)), 0.0) * cost / len(J))
    sd = {names[i]: float(s * unit[i]) for i, s in zip(open_, spread, strict=True)}
    return Refit(best, sd, chi)


def gauss_newton(fun: Callable[[Array], Array], x: Array, steps: int) -> tuple[Array, Array, float]:
    """Minimum of the square sum of `fun` near x, its Jacobian there and the square sum.

    Levenberg and Marquardt's damping, differences for the Jacobian, at most so many steps.
    """
    r = fun(x)
    cost, damping = float(r @ r), 1e-3
    for _ in range(steps):
        J = jacobian(fun, x)
        A, g = J.T @ J, J.T @ r
        size = np.maximum(np.diag(A), 1e-12 * float(np.max(np.diag(A))) + 1e-300)
        for _ in range(TRIES):
            step = np.linalg.lstsq(A + np.diag(damping * size), -g, rcond=1e-14)[0]
            after = fun(x + step)
            gained = cost - float(after @ after)
            if gained > 0:
                break
            damping *= 10.0
        else:
            return x, J, cost
        x, r, cost, damping = x + step, after, cost - gained, damping * 0.1
        if gained < ENOUGH * cost:
            break
    return x, jacobian(fun, x), cost


def jacobian(fun: Callable[[Array], Array], x: Array) -> Array:
    """Derivatives of `fun` (n, k) by central differences, on two cores."""

    def column(i: int) -> Array:
        up, down = x.copy(), x.copy()
        up[i] += STEP
        down[i] -= STEP
        return (fun(up) - fun(down)) / (2 * STEP)

    with ThreadPoolExecutor(2) as pool:
        return np.column_stack(list(pool.map(column, range(len(x)))))
