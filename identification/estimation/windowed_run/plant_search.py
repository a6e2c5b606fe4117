"""A plant of the nine parameters by search, where no run follows from what the equations give.

Differential evolution on the runs of many plants in windows at once: the square sums are those of
the likelihood, but count in full while they are far off.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array
from identification.estimation.global_search import evolved
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.regression.first_estimate import first_estimate
from identification.estimation.windowed_run.likely_square import LikelyLog
from identification.estimation.windowed_run.parameters import kernel_rows
from identification.estimation.windowed_run.stick_search import SHORT_WINDOW
from identification.estimation.windowed_run.windows import Freed, compared, starts
from identification.model.estimates import Drive
from identification.model.karnopp import NAMES, NEGATIVE, Karnopp
from identification.model.plant import Plant
from identification.simulation.karnopp_lanes import WIDTH

POPULATION, GENERATIONS = 64, 150
BEGUN_APART = 0.15  # of the box, between the members that begin near the plant
# Errors count in full within so many deviations of the noise, and such a share of the motion's
FULL_WITHIN, SHARE_WITHIN = 30.0, 0.02
SIGN = np.array([-1.0 if name in NEGATIVE else 1.0 for name in NAMES])
LOGARITHMIC = np.isin(NAMES, ("m", "dv_p", "dv_n"))


@dataclass(frozen=True, eq=False)
class Box:
    """Where the nine are searched: low, high (9,) of their sizes, or of their logarithms."""

    low: Array
    high: Array

    @classmethod
    def about(cls, logs: Sequence[MotionLog]) -> "Box":
        """That which holds every log's range about its first estimate."""
        firsts = [first_estimate(one) for one in logs]
        ends = np.array([np.min([first.low for first in firsts], axis=0),
                         np.max([first.high for first in firsts], axis=0)])  # fmt: skip
        ends[:, LOGARITHMIC] = np.log(np.maximum(ends[:, LOGARITHMIC], 1e-300))
        return cls(*ends)

    def nine(self, z: Array) -> Array:
        """The nine (k, 9) of points (k, 9) in the unit cube."""
        sizes = self.low + (self.high - self.low) * z
        sizes[:, LOGARITHMIC] = np.exp(sizes[:, LOGARITHMIC])
        return np.asarray(SIGN * sizes)

    def around(self, nine: Array, count: int, rng: np.random.Generator) -> Array:
        """First members (count, 9): half of them near these nine, half anywhere in the box."""
        sizes = np.abs(nine)
        sizes[LOGARITHMIC] = np.log(np.maximum(sizes[LOGARITHMIC], 1e-300))
        center = (sizes - self.low) / np.maximum(self.high - self.low, 1e-300)
        z, near = rng.random((count, len(nine))), count // 2
        z[:near] = center + BEGUN_APART * rng.standard_normal((near, len(nine)))
        z[0] = center
        return np.clip(z, 0.001, 0.999)


@dataclass(frozen=True, eq=False)
class PlantCost:
    """Square sums of plants like one over the logs, whose windows begin where they are measured."""

    plant: Plant
    drive: Drive
    logs: tuple[LikelyLog, ...]

    @classmethod
    def of(cls, plant: Plant, logs: Sequence[MotionLog], drive: Drive) -> "PlantCost":
        """For plants with this one's actuator."""
        posed = []
        for one in logs:
            rows = len(compared(one, drive)[0])
            own = Freed.of_known(starts(one, drive, SHORT_WINDOW), rows, len(one.log))
            far = max(FULL_WITHIN, SHARE_WITHIN * float(np.std(one.log["y"])) / one.noise.y)
            posed.append(LikelyLog.of(plant, one, drive, own, far))
        return cls(plant, drive, tuple(posed))

    def __call__(self, nine: Array) -> Array:
        """Of members (k, 9), (k,), on all cores; infinite of those that cannot be followed."""
        rows = kernel_rows(self.plant, NAMES, self.drive, nine)
        blocks = np.array_split(rows, max(1, len(rows) // WIDTH))
        with ThreadPoolExecutor() as pool:
            return np.concatenate(list(pool.map(self._of_block, blocks)))

    def _of_block(self, rows: Array) -> Array:
        return np.asarray(np.sum([one.simulated(rows) for one in self.logs], axis=0))


def searched_plant(
    plant: Plant, logs: Sequence[MotionLog], drive: Drive, rng: np.random.Generator
) -> Plant:
    """The plant of one global search for the nine parameters, without intervals.

    plant: the first one, whose actuator stays. Raises Halted where the logs' `halt` says so.
    Source: differential evolution, Storn, Price (1997), of the paper's plant.
    """
    box, cost_of = Box.about(logs), PlantCost.of(plant, logs, drive)

    def cost(z: Array) -> Array:
        logs[0].halt.ask()
        return cost_of(box.nine(z))

    first = box.around(plant.friction.array, POPULATION, rng)
    best = evolved(cost, first, GENERATIONS, rng)
    return replace(plant, friction=Karnopp.from_array(box.nine(best[np.newaxis])[0]))
