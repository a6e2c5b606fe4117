"""What acts on a body beside the applied force, and by how much its motion follows that force."""

from dataclasses import dataclass

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
        # What a measured current is until the next sample is its mean between both.
        behind, n = self.lag.value / log.h - 0.5 * self.sampled, len(log)
        y, at = np.asarray(log["y"]), np.arange(n)
        force = np.interp(at - behind, at, log["F"]) + self.force.value
        force = force - self.sine.value * np.sin(y) - self.cosine.value * np.cos(y)
        signals = {"F": force, "u": force / self.gives} if self.gives else {"F": force}
        unknown = int(np.ceil(abs(behind)))
        first, last = (unknown, n) if behind > 0.0 else (0, n - unknown)
        return log.with_signals(**signals).part(first, last)

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
