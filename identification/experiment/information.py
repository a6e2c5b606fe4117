"""Fisher information of a plant's parameters in a run, by the exact simulation.

Residuals in units of the sensors' noise have the sensitivities J with the parameters, these in
units of their own values; J'J is then the information, and its inverse the covariance that no
unbiased estimator beats (Rao, Bull. Calcutta Math. Soc. 37 (1945) 81; Cramer, Mathematical Methods
of Statistics (1946), chapter 32). Stops and breakaways are in it as the exact run has them: a stick
limit shows in nothing but when the body leaves. An effect that the machine may have is a direction
beside the parameters.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array, IntArray
from identification.effects._base import Acting
from identification.errors import BadModel
from identification.estimation.gauss_newton import jacobian
from identification.estimation.windowed_run.parameters import (
    even,
    names_of,
    plant_with,
    units_in,
    values_of,
)
from identification.estimation.windowed_run.run_errors import CANNOT_BE_FOLLOWED, Judge, soft
from identification.estimation.windowed_run.windows import RUN_WINDOW
from identification.log import Log
from identification.model.estimates import Drive
from identification.model.plant import Motor, Plant
from identification.simulation.free_run import free_run

NO_INFORMATION = 1e-9  # of the largest, an eigenvalue of the information that is rounding
LEAST_NOISE = 1e-12  # N or m, of a signal that is taken to be exact
LASTING_STEP = 1e-3  # of a parameter, over which a sensitivity has to hold to be counted on
LASTING_SHARE = 0.1  # of a sensitivity, by which it may differ to either side over that step
# in units of the noise, difference of both sides from which a run is sensitive to chance
BY_CHANCE = 3.0
FAR_CHANGE = 10.0  # in units of the noise, from which what an effect changes counts less
NOT_FOLLOWED = 6.0  # in units of the noise, error of the plant itself at which it is not followed


@dataclass(frozen=True, eq=False)
class Information:
    """What runs identify of a plant's parameters `names` (d,).

    matrix (d, d): J'J in sizes of the parameters; chaotic: share of the samples in which the run is
    sensitive to chance. The matrices of runs of their own add up.
    """

    names: tuple[str, ...]
    matrix: Array
    chaotic: float = 0.0

    @property
    def deviations(self) -> Array:
        """Least standard deviations (d,) of the parameters' errors, in their sizes; infinite where
        the runs say nothing."""
        size = np.sqrt(np.maximum(np.diag(self.matrix), 0.0))
        silent = size <= 0.0
        scale = np.where(silent, 1.0, size)
        values, vectors = np.linalg.eigh(self.matrix / np.outer(scale, scale))
        kept = values > NO_INFORMATION * max(float(values[-1]), 1e-300)
        variance = np.sum(vectors[:, kept] ** 2 / values[kept], axis=1)
        # A direction without information makes every parameter in it unknown.
        lost = silent | (np.sum(vectors[:, ~kept] ** 2, axis=1) > NO_INFORMATION)
        return np.where(lost, np.inf, np.sqrt(variance) / scale)


def information(
    plant: Plant, errors_of: Judge, drive: Drive, rivals: Sequence[Acting] = (), *,
    lost: float = NOT_FOLLOWED,
) -> Information:  # fmt: skip
    """What the runs with these errors (n,), in units of the sensors' noise, identify of the plant,
    as far as it is to be counted on (`lasting_jacobian`), and behind its parameters of each rival
    effect at its size, by the rival's key.

    plant: without the rivals; lost: error of the plant itself from which a sample says nothing. A
    shape of an effect that is at its default is not asked for, as in a fit. A rival that changes
    nothing has zeros.
    """
    names, x, unit = unknowns(plant, drive)
    J, chaotic = lasting_jacobian(
        lambda at: errors_of(plant_with(plant, names, at * unit)), x, lost
    )
    columns, here = [J], errors_of(plant) if rivals else np.zeros(0)
    for one in rivals:
        changed = errors_of(replace(plant, effects=(*plant.effects, one))) - here
        changed = np.where(np.isfinite(changed), changed, 0.0)
        columns.append(soft(changed, FAR_CHANGE)[:, np.newaxis])
    both, every = np.hstack(columns), (*names, *(one.key for one in rivals))
    return Information(every, both.T @ both, chaotic)


def unknowns(plant: Plant, drive: Drive) -> tuple[tuple[str, ...], Array, Array]:
    """Names (d,) of what a fit would look for, their values in units of their sizes, and these."""
    fixed = even(plant)
    names = tuple(name for name in names_of(plant, drive) if name not in fixed)
    values = values_of(plant, names)
    unit = units_in(plant, names, values)
    return names, values / unit, unit


def lasting_jacobian(
    fun: Callable[[Array], Array], x: Array, lost: float = NOT_FOLLOWED
) -> tuple[Array, float]:
    """Derivatives of `fun` (n, k) at x (k,) where they hold as far as a fit comes from, else 0, and
    the share of `fun`'s values that is sensitive to chance.

    Where a stop turns on next to nothing, a run depends on a parameter beyond all measure, but only
    within next to nothing: no fit finds the parameter by that, and many find a wrong one.
    """
    here = fun(x)
    down, up = (jacobian(fun, x, here, step) for step in (-LASTING_STEP, LASTING_STEP))
    apart = np.abs(up - down)
    lasts = apart <= LASTING_SHARE * np.maximum(np.abs(up), np.abs(down))
    lasts &= (np.abs(here) < lost)[:, np.newaxis] & np.isfinite(apart)
    by_chance = np.any(~lasts & ~(apart * LASTING_STEP < BY_CHANCE), axis=1)
    return np.where(lasts, 0.5 * (up + down), 0.0), float(np.mean(by_chance))


def run_errors(log: Log, body: Array, rests: IntArray, noise_y: float, noise_F: float) -> Judge:
    """Errors of runs by the command, begun anew at rests, in units of the noise [m], [N].

    log: without noise; body (n,): its position [m], of which y is what the transducer shows; rests
    (k,): samples at which it surely rests, the first among them. F counts where an actuator makes
    it.
    """
    sd_y, sd_F = max(noise_y, LEAST_NOISE), max(noise_F, LEAST_NOISE)
    y, F = np.asarray(log["y"]), np.asarray(log["F"])
    start = (float(body[0]), 0.0, float(F[0]))
    again = (rests, body[rests], np.zeros(len(rests)), F[rests])

    def errors_of(plant: Plant) -> Array:
        with_force = not isinstance(plant.actuator, Motor)
        try:
            run = free_run(plant, log, start, "command", restarts=again)
        except BadModel:
            return np.full(len(log) * (2 if with_force else 1), CANNOT_BE_FOLLOWED)
        position = (run.shown - y) / sd_y
        return np.concatenate([position, (run.F - F) / sd_F]) if with_force else position

    return errors_of


def rests_of(v: Array, h: float, seconds: float = RUN_WINDOW) -> IntArray:
    """Samples (k,) at rest, about so many seconds apart or more, of a run of velocity v [m/s], (n,)
    that begins at rest."""
    still = np.flatnonzero(v == 0.0)
    out, step = [0], round(seconds / h)
    while True:
        after = still[still >= out[-1] + step]
        if not len(after):
            return np.array(out, dtype=np.int64)
        out.append(int(after[0]))
