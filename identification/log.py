"""Log: immutable signals of one continuous run, in SI units."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import Literal

import numpy as np

from identification.arrays import Array, BoolArray, frozen
from identification.errors import BadLog

Motion = Literal["linear", "rotary"]
RigKind = Literal["electro-pneumatic", "force", "motor", "velocity"]


@dataclass(frozen=True)
class Rig:
    """What a card says of the machine; areas [m^2], pressure [Pa], stroke [m].

    `command_unit` is that of u (V, A, 1, %, N): `control_limit` is in it, and `force_per_command`
    [N per such unit] is the motor's k_a. `motion` "rotary" reads rad, N m and kg m^2.
    `motor_inertia` [kg] is that of the motor alone, without its load.
    """

    kind: RigKind
    area_p: float | None = None
    area_n: float | None = None
    supply_pressure: float | None = None
    force_per_command: float | None = None
    control_limit: float | None = None
    stroke: tuple[float, float] | None = None
    motion: Motion = "linear"
    command_unit: str = "V"
    motor_inertia: float | None = None


@dataclass(frozen=True)
class Log:
    """Signals of one run by canonical name, each of shape (n,), with their time `t` [s].

    `y` position [m], `F` applied force F_e [N], `u` command [V, or the
    rig's command_unit], `r` reference [m]; any further
    name is a signal that effects may use. lost (n,): rows that the logger has lost, whose values
    lie between those of their neighbours. zoh: F is a zero-order hold, constant from each row to
    the next. of_place (n,): the part of F [N] that acts at a place, over each sample, and is not
    commanded (gravity, cogging), None for none. Arrays are read-only copies. Raises BadLog where
    the lengths differ or `t` is missing.
    """

    name: str
    signals: Mapping[str, Array]
    lost: BoolArray | None = None
    zoh: bool = False
    of_place: Array | None = None

    def __post_init__(self) -> None:
        signals = {key: frozen(values) for key, values in self.signals.items()}
        if "t" not in signals:
            raise BadLog(f"{self.name}: no time signal 't'; every log needs one")
        lengths = {key: values.shape for key, values in signals.items()}
        if len(set(lengths.values())) != 1 or signals["t"].ndim != 1:
            raise BadLog(f"{self.name}: signals of different lengths {lengths}; all must be (n,)")
        object.__setattr__(self, "signals", MappingProxyType(signals))

    def __getitem__(self, key: str) -> Array:
        if key not in self.signals:
            have = ", ".join(self.signals)
            raise BadLog(
                f"{self.name}: no signal {key!r} (has {have}); name its column in the card"
            )
        return self.signals[key]

    def __contains__(self, key: object) -> bool:
        return key in self.signals

    def __len__(self) -> int:
        return len(self.signals["t"])

    @cached_property
    def h(self) -> float:
        """Median sampling period [s]."""
        return float(np.median(np.diff(self.signals["t"])))

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return float(self.signals["t"][-1] - self.signals["t"][0])

    def with_signals(self, **signals: Array) -> "Log":
        """The same log with these signals added or replaced."""
        return replace(self, signals={**self.signals, **signals})

    def part(self, start: int, stop: int) -> "Log":
        """Samples `start` to `stop` (exclusive) as a log of its own."""
        own = {k: v[start:stop] for k, v in self.signals.items()}
        lost = None if self.lost is None else self.lost[start:stop]
        of_place = None if self.of_place is None else self.of_place[start:stop]
        return replace(self, signals=own, lost=lost, of_place=of_place)

    @property
    def commanded(self) -> Array:
        """F without what acts at a place, (n,) [N]."""
        return self["F"] if self.of_place is None else self["F"] - self.of_place
