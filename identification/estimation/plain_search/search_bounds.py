"""The box of the global search, and its map to kernel parameters."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.arrays import Array, IntArray
from identification.estimation.regression.three_step import FirstEstimate
from identification.simulation.karnopp_step import DV_N, DV_P, F_SN, K1, K2, PARAMETERS, M

BoolArray = NDArray[np.bool_]
SIGN = np.ones(PARAMETERS)
SIGN[[DV_N, F_SN]] = -1.0
LOGARITHMIC = (M, DV_P, DV_N, K2)


@dataclass(frozen=True)
class Box:
    """Free parameters (d,), their magnitudes' bounds, and the fixed row (11,) around them."""

    free: IntArray
    low: Array
    high: Array
    row: Array

    def rows(self, z: Array) -> Array:
        """Kernel parameters (k, 11) of points (k, d) in the unit cube."""
        low, high, logs = self._scaled()
        values = low + (high - low) * z
        values[:, logs] = np.exp(values[:, logs])
        rows: Array = np.tile(self.row, (len(z), 1))
        rows[:, self.free] = values * SIGN[self.free]
        return rows

    def point(self, row: Array) -> Array:
        """Point (d,) in the unit cube of a row of kernel parameters, moved inside."""
        low, high, logs = self._scaled()
        values = np.abs(row[self.free])
        values[logs] = np.log(np.maximum(values[logs], 1e-300))
        z: Array = np.clip((values - low) / np.maximum(high - low, 1e-300), 0.001, 0.999)
        return z

    def around(self, row: Array, count: int, spread: float, rng: np.random.Generator) -> Array:
        """First members (count, d): half near `row`, half anywhere in the box."""
        z = rng.random((count, len(self.free)))
        near = count // 2
        center = self.point(row)
        z[:near] = np.clip(center + spread * rng.standard_normal((near, len(z[0]))), 0.001, 0.999)
        z[0] = center
        return z

    def wider(self, factor: float) -> "Box":
        """The box with the bounds of the nine moved out by `factor`; a coupling keeps its own."""
        by = np.where(self.free == K2, 1.0, factor)
        return replace(self, low=self.low / by, high=self.high * by)

    def _scaled(self) -> tuple[Array, Array, BoolArray]:
        logs = np.isin(self.free, LOGARITHMIC)
        low, high = self.low.copy(), self.high.copy()
        low[logs] = np.log(np.maximum(low[logs], 1e-300))
        high[logs] = np.log(np.maximum(high[logs], 1e-300))
        return low, high, logs


def search_box(
    firsts: Sequence[FirstEstimate], k1: float, k2: float, stiffness: tuple[float, float] | None
) -> tuple[Box, Array]:
    """The box that holds every log's range, and its middle as a row of kernel parameters.

    k1, k2: of the actuator, or 0. stiffness: bounds of the coupling k2 of a force-driven run.
    """
    low = np.min([first.low for first in firsts], axis=0)
    high = np.max([first.high for first in firsts], axis=0)
    nine = np.median([first.nine for first in firsts], axis=0)
    free: IntArray = np.arange(9, dtype=np.int64)
    row = np.concatenate([nine, [k1, k2]])
    if stiffness:
        free = np.append(free, K2)
        low, high = np.append(low, stiffness[0]), np.append(high, stiffness[1])
        row[K2] = np.sqrt(stiffness[0] * stiffness[1])
    row[K1] = k1
    return Box(free, low, high, row), row
