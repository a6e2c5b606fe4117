"""One controller on many plants at once: its margins, and how many of the plants keep them.

For plants drawn from what is not sure of a machine. `design.margins` says more of one plant, and to
more digits; here one grid of frequencies serves all, and the highest peak of each is zoomed into.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from design.polynomial import ComplexArray
from design.rst import RST
from identification.arrays import Array
from identification.errors import BadSpecification

if TYPE_CHECKING:
    from design.tune import Goals

LOWEST = 1e-6  # theta = w h of the grid's first point
GRID_LOG, GRID_EVEN = 400, 400  # points by ratio up to pi, and by distance
ZOOMS, ZOOM_POINTS = 3, 9  # each narrows the highest peak of a plant four times


@dataclass(frozen=True, eq=False)
class DrawnPlants:
    """Plants A (k, n), B (k, m) in ascending powers of z^-1, A[:, 0] = 1, and the share of them on
    which a loop has to keep its goals.

    lost: plants beside these on which no loop is stable. Raises BadSpecification where there is no
    plant, or the share is not within 0 to 1.
    """

    A: Array
    B: Array
    probability: float
    lost: int = 0

    def __post_init__(self) -> None:
        if len(self.A) == 0 or len(self.A) != len(self.B):
            raise BadSpecification(
                f"{len(self.A)} plants A and {len(self.B)} plants B drawn; give at least one pair"
            )
        if not 0.0 < self.probability < 1.0:
            raise BadSpecification(
                f"probability {self.probability:g}; give one above 0 and below 1, as 0.95"
            )

    @classmethod
    def of(
        cls, plants: Sequence[tuple[Array, Array]], probability: float, lost: int = 0
    ) -> "DrawnPlants":
        """Plants (A, B) of any lengths, padded to one."""
        n = max((a.size for a, _ in plants), default=1)
        m = max((b.size for _, b in plants), default=1)
        return cls(
            np.array([np.pad(a, (0, n - a.size)) for a, _ in plants]).reshape(-1, n),
            np.array([np.pad(b, (0, m - b.size)) for _, b in plants]).reshape(-1, m),
            probability,
            lost,
        )

    def missed(self, controller: RST, goals: "Goals") -> tuple[str, ...]:
        """The goals that too few of the plants keep under the controller, in words."""
        found = loop_margins(self.A, self.B, controller)
        every = (
            (found.modulus >= goals.modulus, f"modulus margin {goals.modulus:g}"),
            (found.delay >= goals.delay, f"delay margin of {goals.delay:g} samples"),
        )
        return tuple(
            f"{what} on {100 * share:.0f} % of the machines drawn, {100 * self.probability:g} asked"
            for met, what in every
            if (share := self.share(met)) < self.probability
        )

    def share(self, met: NDArray[np.bool_]) -> float:
        """The share of all plants, the lost ones among them, that keep something, by plant (k,)."""
        return float(np.sum(met)) / (len(self.A) + self.lost)


@dataclass(frozen=True, eq=False)
class LoopMargins:
    """Margins (k,) on each plant, 0 where the loop is not stable: modulus [-] and delay in samples,
    infinite where no delay makes it unstable; effort: largest |S_up| (k,), infinite there."""

    modulus: Array
    delay: Array
    effort: Array


def loop_margins(A: Array, B: Array, controller: RST) -> LoopMargins:
    """The margins of a controller on plants A (k, n), B (k, m), A[:, 0] = 1.

    As `design.margins` defines them; of each, the modulus within 1e-6 and the others within 1e-2.
    """
    forward = _product(B, controller.R)
    back = _product(A, controller.S)
    above = _product(A, controller.R)
    size = max(forward.shape[1], back.shape[1], above.shape[1])
    forward, back = _padded(forward, size), _padded(back, size)
    stable = _radius(forward + back) < 1.0
    theta = np.unique(
        np.concatenate(
            [np.geomspace(LOWEST, np.pi, GRID_LOG), np.linspace(0.0, np.pi, GRID_EVEN)[1:]]
        )
    )
    powers = np.exp(-1j * np.outer(np.arange(size), theta))
    n: ComplexArray = np.asarray(forward @ powers)
    d: ComplexArray = np.asarray(back @ powers)
    modulus = _least_distance(forward, back, theta, _distance(n, d))
    with np.errstate(divide="ignore", invalid="ignore"):
        effort = np.max(np.abs(_padded(above, size) @ powers) / np.abs(n + d), axis=1)
    return LoopMargins(
        modulus=np.where(stable, modulus, 0.0),
        delay=np.where(stable, _delay(theta, n, d), 0.0),
        effort=np.where(stable, effort, np.inf),
    )


def _padded(c: Array, size: int) -> Array:
    """Polynomials c (k, n) as (k, size)."""
    return np.pad(c, ((0, 0), (0, size - c.shape[1])))


def _product(c: Array, by: Array) -> Array:
    """Polynomials c (k, n), each times `by` (m,): (k, n + m - 1)."""
    out = np.zeros((len(c), c.shape[1] + by.size - 1))
    for i, factor in enumerate(by.tolist()):
        out[:, i : i + c.shape[1]] += factor * c
    return out


def _radius(P: Array) -> Array:
    """The largest |z| of the roots of each P (k, n), in ascending powers of z^-1, P[:, 0] != 0."""
    n = P.shape[1] - 1
    companion = np.zeros((len(P), n, n))
    companion[:, 0] = -P[:, 1:] / P[:, :1]
    companion[:, np.arange(1, n), np.arange(n - 1)] = 1.0
    return np.asarray(np.max(np.abs(np.linalg.eigvals(companion)), axis=1))


def _least_distance(forward: Array, back: Array, theta: Array, distance: Array) -> Array:
    """The least |1 + L| (k,), its place between grid points zoomed into."""
    rows, order = np.arange(len(distance)), np.arange(forward.shape[1])
    at = np.argmin(distance, axis=1)
    best = distance[rows, at]
    low, high = theta[np.maximum(at - 1, 0)], theta[np.minimum(at + 1, theta.size - 1)]
    for _ in range(ZOOMS):
        near = np.linspace(low, high, ZOOM_POINTS, axis=1)
        powers = np.exp(-1j * near[:, :, np.newaxis] * order)
        n = np.einsum("kpi,ki->kp", powers, forward)
        d = np.einsum("kpi,ki->kp", powers, back)
        found = _distance(n, d)
        at = np.argmin(found, axis=1)
        best = np.minimum(best, found[rows, at])
        low, high = (
            near[rows, np.maximum(at - 1, 0)],
            near[rows, np.minimum(at + 1, ZOOM_POINTS - 1)],
        )
    return np.asarray(best)


def _distance(n: ComplexArray, d: ComplexArray) -> Array:
    """|1 + n/d|, infinite where d = 0."""
    size = np.abs(d)
    return np.asarray(np.abs(n + d) / np.where(size > 0.0, size, 1e-300))


def _delay(theta: Array, n: ComplexArray, d: ComplexArray) -> Array:
    """The least delay (k,), in samples, that takes a crossing of |L| = 1 to -1."""
    excess = np.abs(n) ** 2 - np.abs(d) ** 2
    crosses = np.signbit(excess[:, 1:]) != np.signbit(excess[:, :-1])
    with np.errstate(invalid="ignore", divide="ignore"):
        share = excess[:, :-1] / (excess[:, :-1] - excess[:, 1:])
        at = theta[:-1] + share * np.diff(theta)
        response = n / d
        there = response[:, :-1] + share * np.diff(response, axis=1)
        lag = np.mod(np.angle(there) + np.pi, 2.0 * np.pi)
        least = np.min(np.where(crosses, lag / at, np.inf), axis=1)
        # |L| > 1 up to half the sampling rate: -1 is passed within one sample of delay.
        end, other = np.real(n[:, -1]), np.real(d[:, -1])
        last = np.arccos(np.clip(-other / end, -1.0, 1.0)) / np.pi
    return np.asarray(np.where(np.abs(end) > np.abs(other), np.minimum(least, last), least))
