"""What a machine may do in an experiment, and what a simulated run does of it."""

import math
from dataclasses import dataclass

import numpy as np

from design.loop import LoopRun
from identification.errors import BadSpecification


@dataclass(frozen=True)
class MotionLimits:
    """Limits of a run: stroke (low, high) [m], speed [m/s], force [N], command [its unit], and how
    long it may last [s]; force and command may be infinite. Raises BadSpecification where a limit
    leaves no room."""

    stroke: tuple[float, float]
    speed: float
    seconds: float
    force: float = math.inf
    command: float = math.inf

    def __post_init__(self) -> None:
        low, high = self.stroke
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise BadSpecification(f"stroke {low:g} to {high:g}: the first must be the lower one")
        for name in ("speed", "seconds", "force", "command"):
            if not getattr(self, name) > 0:
                raise BadSpecification(f"limit of {name} = {getattr(self, name):g}, must be > 0")

    @property
    def home(self) -> float:
        """The middle of the stroke [m], where a run begins and ends."""
        return 0.5 * (self.stroke[0] + self.stroke[1])

    @property
    def reach(self) -> float:
        """Half the stroke [m]."""
        return 0.5 * (self.stroke[1] - self.stroke[0])


@dataclass(frozen=True)
class Peaks:
    """Lowest and highest position [m], largest speed [m/s], force [N] and command of a run."""

    low: float
    high: float
    speed: float
    force: float
    command: float

    def share_of(self, limits: MotionLimits) -> float:
        """The largest share of a limit that is used; above 1 one is exceeded."""
        home, reach = limits.home, limits.reach
        return max(
            (home - self.low) / reach,
            (self.high - home) / reach,
            self.speed / limits.speed,
            self.force / limits.force,
            self.command / limits.command,
        )

    def exceeded(self, limits: MotionLimits) -> tuple[str, ...]:
        """Names of the limits that are exceeded."""
        out = []
        if self.low < limits.stroke[0] or self.high > limits.stroke[1]:
            out.append("stroke")
        out += [
            name
            for name in ("speed", "force", "command")
            if getattr(self, name) > getattr(limits, name)
        ]
        return tuple(out)

    def or_more(self, other: "Peaks") -> "Peaks":
        """The extremes of both."""
        return Peaks(
            min(self.low, other.low),
            max(self.high, other.high),
            *(max(getattr(self, n), getattr(other, n)) for n in ("speed", "force", "command")),
        )


def peaks(run: LoopRun) -> Peaks:
    """The extremes of a run; a command counts as it leaves the controller."""
    return Peaks(
        float(np.min(run.y)),
        float(np.max(run.y)),
        float(np.max(np.abs(run.v))),
        float(np.max(np.abs(run.F))),
        float(np.max(np.abs(run.u))),
    )
