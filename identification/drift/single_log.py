"""One log's change against what is no drift: a small change, or what the machine varies by anyhow.

It shows drift where it is neither: surely beyond the margin that does not matter, and beyond what
the machine varies from log to log. Tested over all parameters together, which finds a change of
many, and of each on its own, which finds a change of one. What a test can see is its limit and so
many deviations more: Currie, Anal. Chem. 40 (1968) 586.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import brentq
from scipy.stats import norm

from identification.arrays import Array
from identification.drift.practical_margin import Change
from identification.thresholds import NEARLY_ALL

WIDEST_SEEN = 10.0  # relative change up to which a test's smallest one is looked for
# Deviations beyond its limit at which a test alarms with the chance NEARLY_ALL
SURE_TO_FIND = float(norm.ppf(NEARLY_ALL))


@dataclass(frozen=True, eq=False)
class LogChange:
    """The change (k,) on a log, relative, of those parameters `names` that it tests.

    measured (k, k): covariance of the log's and the model's errors; varied (k,): variance from log
    to log; margin: change that does not matter.
    """

    names: tuple[str, ...]
    change: Array
    measured: Array
    varied: Array
    margin: float

    @cached_property
    def beyond_margin(self) -> Change:
        """The change as one of a machine that stays within the margin on every day."""
        return Change(self.names, self.change, self.measured, self.margin)

    @cached_property
    def beyond_usual(self) -> Change:
        """The change as one of a machine that has not changed but for what it varies by."""
        return Change(self.names, self.change, self.measured + np.diag(self.varied), 0.0)

    @cached_property
    def nearer(self) -> Change:
        """That of the two which explains the change better."""
        return min(self.beyond_margin, self.beyond_usual, key=lambda one: one.square)

    @property
    def alone(self) -> Array:
        """Deviations (k,) by which each parameter on its own is beyond both."""
        size, (measured, usual) = np.abs(self.change), self._deviations
        return np.minimum(np.maximum(size - self.margin, 0.0) / measured, size / usual)

    def detectable(self, alone: float, together: float) -> Array:
        """Smallest change (k,) of each parameter that one of its two tests sees, of these
        thresholds."""
        boxes = (self.beyond_margin, self.beyond_usual)
        of_all = np.maximum(*(detectable_together(one, together) for one in boxes))
        return np.asarray(np.minimum(self.detectable_alone(alone), of_all))

    def detectable_alone(self, square: float) -> Array:
        """Smallest change (k,) of each parameter that its own test sees, with a power of
        NEARLY_ALL (Currie 1968).

        square: threshold of the largest of `alone`, squared. The power is over the errors of the
        log and the model: the parameter lies by so much from the model's on the day of the log.
        """
        limit, (measured, usual) = np.sqrt(square), self._deviations
        beyond = self.margin + (limit + SURE_TO_FIND) * measured
        return np.asarray(np.maximum(beyond, limit * usual + SURE_TO_FIND * measured))

    @property
    def _deviations(self) -> tuple[Array, Array]:
        """Standard deviations (k,) of the errors alone, and of the change of a machine that has not
        changed."""
        square = np.diag(self.measured)
        return np.sqrt(square), np.sqrt(square + self.varied)


def detectable_together(found: Change, square: float) -> Array:
    """Smallest change (k,) of one parameter that the test of all together sees, or at most that.

    square: its threshold. By how far the change lies from the margin's box without errors: errors
    bring it nearer by more than a normal deviation once in 1 / (1 - NEARLY_ALL) at most.
    """
    needed = (float(np.sqrt(square)) + SURE_TO_FIND) ** 2

    def smallest(one: Array) -> float:
        def missing(size: float) -> float:
            return replace(found, change=size * one).square - needed

        if missing(WIDEST_SEEN) < 0.0:
            return float("inf")
        return float(brentq(missing, found.margin, WIDEST_SEEN, rtol=1e-3))

    return np.array([smallest(one) for one in np.eye(len(found.names))])
