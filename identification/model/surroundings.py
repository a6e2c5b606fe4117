"""What acts on a body beside the applied force, and by how much its motion follows that force."""

from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array
from identification.effects._base import Acting
from identification.effects._library import built_in, numbered
from identification.log import Log
from identification.model.resonance import Resonance
from identification.model.size import NOT_SHOWN, Size


@dataclass(frozen=True)
class Order:
    """A force that repeats `order` times in a turn: sizes of its sine and cosine [N m]."""

    order: int
    sine: Size
    cosine: Size

    @property
    def size(self) -> float:
        """Amplitude."""
        return float(np.hypot(self.sine.value, self.cosine.value))

    @property
    def sd(self) -> float:
        """Standard deviation of the amplitude."""
        both = (self.sine, self.cosine)
        return float(np.sqrt(sum((one.value * one.sd) ** 2 for one in both))) / max(
            self.size, 1e-300
        )

    def force(self, y: Array) -> Array:
        """Force [N m] at angles y [rad], (n,)."""
        turned = self.order * y
        return self.sine.value * np.sin(turned) + self.cosine.value * np.cos(turned)


@dataclass(frozen=True)
class Surroundings:
    """What acts beside the applied force.

    lag [s]: of the motion behind the column of the force; force [N]: that is always there, towards
    +y; sine, cosine [N m]: gravity's of the angle; orders: of a turn, in which cogging repeats,
    the largest first; resonance: of a second mass, which is not taken out. gives [N per unit of
    u]: a motor's, whose force is its command's; None elsewhere. sampled: its column is a current
    measured at instants, no command that is constant until the next; zoh: the column of a measured
    force is such a command.
    """

    lag: Size = NOT_SHOWN
    force: Size = NOT_SHOWN
    sine: Size = NOT_SHOWN
    cosine: Size = NOT_SHOWN
    orders: tuple[Order, ...] = ()
    gives: float | None = None
    sampled: bool = False
    resonance: Resonance | None = None
    zoh: bool = False

    @property
    def none(self) -> bool:
        """Whether nothing shows."""
        sizes = (self.lag, self.force, self.sine, self.cosine)
        return not (self.orders or any(one.value for one in sizes))

    def taken_out(self, log: Log) -> Log:
        """The log with the whole force that drives its body in place of the applied one, held where
        that is.

        Samples at its ends whose force is not known are left out.
        """
        if self.none:
            return replace(log, zoh=True) if self.zoh and not log.zoh else log
        whole, behind = self._with_whole_force(log)
        unknown, n = int(np.ceil(abs(behind))), len(log)
        first, last = (unknown, n) if behind > 0.0 else (0, n - unknown)
        return whole.part(first, last)

    def of_one_instant(self, log: Log) -> Log:
        """The log with its force or command moved to the instants of its position, all samples."""
        late = Surroundings(self.lag, gives=self.gives, sampled=self.sampled, zoh=self.zoh)
        return late._with_whole_force(log)[0]

    def of_angle(self, y: Array) -> Array:
        """Gravity and the orders of a turn at angles y [rad], (n,) [N m]: at each sample, or over
        the period that follows it where the force is held for so long."""
        force = sum((one.force(y) for one in self.orders), np.zeros(len(y)))
        force = force - self.sine.value * np.sin(y) - self.cosine.value * np.cos(y)
        stands = self.gives or self.zoh
        return 0.5 * (force + np.append(force[1:], force[-1:])) if stands else force

    @property
    def of_place(self) -> "Surroundings":
        """The orders of a turn alone."""
        return Surroundings(orders=self.orders, gives=self.gives)

    def _with_whole_force(self, log: Log) -> tuple[Log, float]:
        """The log with the whole force, and by how many samples its column was moved."""
        # What a measured current is until the next sample is its mean between both.
        behind, n = self.lag.value / log.h - 0.5 * self.sampled, len(log)
        y, at = np.asarray(log["y"]), np.arange(n)
        of_place = self.of_angle(y)
        force = np.interp(at - behind, at, log["F"]) + self.force.value + of_place
        signals = {"F": force}
        if self.gives:
            signals["u"] = force / self.gives
        elif "u" in log:  # of an actuator: its force and command are of one instant
            signals["u"] = np.interp(at - behind, at, log["u"])
        whole = log.with_signals(**signals)
        known = of_place if log.of_place is None else log.of_place + of_place
        return replace(whole, zoh=log.zoh or self.zoh, of_place=known), behind

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
        out += self.cogging
        if self.gives and self.lag.value > 0.0:
            out.append(known["input_delay"].acting({"tau": self.lag.value}))
        return tuple(out)

    @property
    def cogging(self) -> tuple[Acting, ...]:
        """The orders of a turn as effects, in their order."""
        out = []
        for i, one in enumerate(self.orders):
            sizes = {"a": one.sine.value, "b": one.cosine.value, "a_2": 0.0, "b_2": 0.0}
            effect = numbered(built_in()["cogging"], i + 1)
            effect = replace(
                effect, meaning=f"a torque {one.order} times in a turn (magnets, teeth)"
            )
            out.append(effect.acting({**sizes, "period": 2.0 * np.pi / one.order}))
        return tuple(out)


NO_SURROUNDINGS = Surroundings()
