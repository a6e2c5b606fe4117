"""Sliding friction and effects by the prediction errors of the position: the values that make what
was measured while the body slides likeliest.

    e_k = (y_k - E[y_k | y_1 .. y_(k-1)]) / sd_k,  sum e_k^2 least over the parameters         (1)

of the chain of `latent_force`, whose force is the measured one with its noise, and which restarts
wherever the body may rest. Sources: prediction-error method, Ljung, System Identification, 2nd ed.
(1999), 7.2; likelihood ratio, Wilks, Ann. Math. Stat. 9 (1938) 60; deviations by the scatter from
stretch to stretch, Liang, Zeger, Biometrika 73 (1986) 13.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from identification.arrays import Array, IntArray
from identification.estimation.gauss_newton import gauss_newton
from identification.estimation.latent_force import LatentForces, latent_forces, prediction_errors
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.windowed_run.parameters import (
    AT_ZERO,
    plant_with,
    units_in,
    values_of,
)
from identification.model.plant import Plant
from identification.thresholds import CHANCE_LEVEL, MATERIAL

ROUNDS = 2  # in which the latent force, by which errors are weighed, converges
STEPS = 3  # of each: the errors are nearly linear in the parameters
SCORE_STRETCHES = 40  # of time, by whose scatter the deviations go


@dataclass(frozen=True, eq=False)
class PredictionErrorFit:
    """The plant, its parameters `names` (k,) of largest likelihood; covariance (k, k); gain: twice
    the logarithm by which they are likelier than those that it began with; latent: what it lacks.
    """

    plant: Plant
    names: tuple[str, ...]
    covariance: Array
    gain: float
    latent: LatentForces

    @property
    def is_likelier(self) -> bool:
        """Whether the logs are significantly likelier, and nothing of account is missing that a
        latent force, rather than these parameters, would stand for."""
        p = self.plant.friction
        share = self.latent.share(max(p.F_cp, p.F_cn))
        known = share is not None and share <= MATERIAL and np.all(np.diag(self.covariance) > 0.0)
        return bool(known) and significant(self.gain, len(self.names))


def prediction_error_fit(
    plant: Plant, names: Sequence[str], logs: Sequence[MotionLog], slowest: float,
) -> PredictionErrorFit | None:  # fmt: skip
    """The parameters of a plant that make the position measured above a speed [m/s] likeliest, from
    those that it has; None where none of them is more than 0.

    By (1): prediction-error method, Ljung (1999), 7.2.
    """
    own = tuple(n for n, x in zip(names, values_of(plant, names), strict=True) if abs(x) > AT_ZERO)
    if not own:
        return None
    unit = units_in(plant, own, values_of(plant, own))
    begun = noise = latent_forces(plant, logs, slowest)
    x = values_of(plant, own) / unit
    for k in range(ROUNDS):

        def errors(at: Array, noise: LatentForces = noise) -> Array:
            return prediction_errors(plant_with(plant, own, at * unit), logs, slowest, noise)

        found = gauss_newton(errors, x, STEPS)
        x, best = found.x, plant_with(plant, own, found.x * unit)
        noise = latent_forces(best, logs, slowest, begun.rougher if k < ROUNDS - 1 else None)
    covariance = found.covariance(_stretches(logs)) * np.outer(unit, unit)
    gain = 2.0 * (noise.log_likelihood - begun.log_likelihood)
    return PredictionErrorFit(best, own, covariance, gain, noise)


def significant(gain: float, parameters: int) -> bool:
    """Whether twice a logarithm of likelihoods is more than so many free parameters gain by chance.

    Source: Wilks (1938).
    """
    return bool(gain > chdtri(parameters, CHANCE_LEVEL))


def _stretches(logs: Sequence[MotionLog]) -> IntArray:
    """Number of the stretch of every sample over all logs, (n,): as many of each."""
    n = sum(len(one.log) for one in logs)
    return np.arange(n) * SCORE_STRETCHES // n
