"""What acts on a body beside the applied force, and by how much its motion follows that force."""

from dataclasses import dataclass, replace

import numpy as np

from identification.effects._base import Acting
from identification.effects._library import built_in
from identification.log import Log


@dataclass(frozen=True)
class Size:
    """A size and its standard deviation; both 0 where it does not show."""

    value: float = 0.0
    sd: float = 0.0


NOT_SHOWN = Size()


@dataclass(frozen=True)
class Surroundings:
    """What acts beside the applied force.

    lag [s]: of the motion behind the column of the force; force [N]: that is always there, towards
    +y; sine, cosine [N m]: gravity's of the angle. gives [N per unit of u]: a motor's, whose force
    is its command's; None elsewhere. sampled: its column is a current measured at instants, no
    command that is held until the next.
    """

    lag: Size = NOT_SHOWN
    force: Size = NOT_SHOWN
    sine: Size = NOT_SHOWN
    cosine: Size = NOT_SHOWN
    gives: float | None = None
    sampled: bool = False

    @property
    def none(self) -> bool:
        """Whether nothing shows."""
        return not any(one.value for one in (self.lag, self.force, self.sine, self.cosine))

    def taken_out(self, log: Log) -> Log:
        """The log with the whole force that drives its body in place of the applied one.

        Samples at its ends whose force is not known are left out.
        """
        if self.none:
            return log
        whole, behind = self._with_whole_force(log)
        unknown, n = int(np.ceil(abs(behind))), len(log)
        first, last = (unknown, n) if behind > 0.0 else (0, n - unknown)
        return whole.part(first, last)

    def of_one_instant(self, log: Log) -> Log:
        """The log with its force or command moved to the instants of its position, all samples."""
        return replace(self, force=NOT_SHOWN, sine=NOT_SHOWN, cosine=NOT_SHOWN)._with_whole_force(
            log
        )[0]

    def _with_whole_force(self, log: Log) -> tuple[Log, float]:
        """The log with the whole force, and by how many samples its column was moved."""
        # What a measured current is until the next sample is its mean between both.
        behind, n = self.lag.value / log.h - 0.5 * self.sampled, len(log)
        y, at = np.asarray(log["y"]), np.arange(n)
        force = np.interp(at - behind, at, log["F"]) + self.force.value
        force = force - self.sine.value * np.sin(y) - self.cosine.value * np.cos(y)
        signals = {"F": force}
        if self.gives:
            signals["u"] = force / self.gives
        elif "u" in log:  # of an actuator: its force and command are of one instant
            signals["u"] = np.interp(at - behind, at, log["u"])
        return log.with_signals(**signals), behind

    @property
    def effects(self) -> tuple[Acting, ...]:
        """The same as effects of a plant, which then runs by the log as it is.

        A motion that comes before its force is no effect but a fault of the log's columns.
        """
        known, out = built_in(), []
        if self.sine.value or self.cosine.value:
            sizes = {"a": self.sine.value, "b": self.cosine.value}
            out.append(known["gravity"].acting(sizes))
        if self.force.value:
            out.append(known["constant_force"].acting({"F_0": self.force.value}))
        if self.gives and self.lag.value > 0.0:
            out.append(known["input_delay"].acting({"tau": self.lag.value}))
        return tuple(out)


NO_SURROUNDINGS = Surroundings()
