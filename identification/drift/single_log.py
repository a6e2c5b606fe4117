"""One log's change against what is no drift: a small change, or what the machine varies by anyhow.

It shows drift where it is neither: surely beyond the margin that does not matter, and beyond what
the machine varies from log to log. Tested over all parameters together, which finds a change of
many, and of each on its own, which finds a change of one.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import brentq
from scipy.stats import norm

from identification.arrays import Array
from identification.drift.mewma import Mean
from identification.drift.practical_margin import beyond_margin
from identification.thresholds import CHANCE_TO_SEE

WIDEST_SEEN = 10.0  # relative change up to which a test's smallest one is looked for


@dataclass(frozen=True, eq=False)
class LogChange:
    """The change (k,) on a log, relative, of those parameters `at` that it tests.

    measured (k, k): covariance of the log's and the model's errors; varied (k,): variance from log
    to log; margin: change that does not matter.
    """

    at: tuple[int, ...]
    change: Array
    measured: Array
    varied: Array
    margin: float

    @cached_property
    def beyond_margin(self) -> Mean:
        """The change as one of a machine that stays within the margin on every day."""
        return Mean(self.at, self.change, self.measured, np.full(len(self.at), self.margin))

    @cached_property
    def beyond_usual(self) -> Mean:
        """The change as one of a machine that has not changed but for what it varies by."""
        covariance = self.measured + np.diag(self.varied)
        return Mean(self.at, self.change, covariance, np.zeros(len(self.at)))

    @cached_property
    def nearer(self) -> Mean:
        """That of the two which explains the change better."""
        one, other = self.beyond_margin, self.beyond_usual
        return one if one.distance.square <= other.distance.square else other

    @cached_property
    def alone(self) -> Array:
        """Deviations (k,) by which each parameter on its own is beyond both."""
        size = np.abs(self.change)
        beyond = np.maximum(size - self.margin, 0.0) / self.measured_sd
        return np.asarray(np.minimum(beyond, size / self.sd))

    @property
    def measured_sd(self) -> Array:
        """Standard deviations (k,) of the errors alone."""
        return np.sqrt(np.diag(self.measured))

    @property
    def sd(self) -> Array:
        """Standard deviations (k,) of the change of a machine that has not changed."""
        return np.sqrt(np.diag(self.beyond_usual.covariance))


def detectable_alone(found: LogChange, square: float) -> Array:
    """Smallest change (k,) of each parameter that its own test sees, with a power of CHANCE_TO_SEE.

    square: threshold of the largest of `alone`, squared. The power is over the errors of the log
    and the model: the parameter lies by so much from the model's on the day of the log.
    """
    limit, more = np.sqrt(square), float(norm.ppf(CHANCE_TO_SEE))
    beyond = found.margin + (limit + more) * found.measured_sd
    return np.asarray(np.maximum(beyond, limit * found.sd + more * found.measured_sd))


def detectable_together(found: Mean, square: float) -> Array:
    """Smallest change (k,) of one parameter that the test of all together sees, or at most that.

    square: its threshold. By how far the change lies from the margin's box without errors: errors
    bring it nearer by more than a normal deviation once in 1 / (1 - CHANCE_TO_SEE) at most.
    """
    needed = (np.sqrt(square) + float(norm.ppf(CHANCE_TO_SEE))) ** 2
    return np.array([_first_beyond(found, i, needed) for i in range(len(found.at))])


def _first_beyond(found: Mean, i: int, square: float) -> float:
    """Change of parameter `i` alone whose square distance to the box is `square`."""
    one = np.zeros(len(found.at))
    one[i] = 1.0

    def missing(size: float) -> float:
        return beyond_margin(size * one, found.covariance, found.margin).square - square

    if missing(WIDEST_SEEN) < 0.0:
        return float("inf")
    return float(brentq(missing, float(found.margin[i]), WIDEST_SEEN, rtol=1e-3))
