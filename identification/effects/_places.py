"""What each place of action means, in one object each: asked of everywhere else by these words."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

Acts = Literal["slip", "stiction", "friction", "bristle", "force", "actuator", "command", "delay",
               "sensor"]  # fmt: skip


@dataclass(frozen=True)
class Place:
    """Where an effect acts, and what follows from that.

    gives: what its `value` returns; unit: of that; rubs: friction added while sliding; holds:
    added to the stick limit; elastic: it replaces sticking; drives: a force on the
    body; feeds: a rate added to the actuator's force; on_command: it changes the command, delays:
    by its time; shows: it changes what the transducer shows; sign: of its value in the residual of
    its equation, 0 for that of the motion, None where its value is no part of a sum there.
    """

    acts: Acts
    gives: str
    unit: str
    rubs: bool = False
    holds: bool = False
    elastic: bool = False
    drives: bool = False
    feeds: bool = False
    on_command: bool = False
    delays: bool = False
    shows: bool = False
    sign: float | None = None

    @property
    def in_actuator(self) -> bool:
        """Whether it lies between command and force, where a measured force has it in it."""
        return self.feeds or self.on_command

    @property
    def on_signals(self) -> bool:
        """Whether it changes a logged signal, and is taken out of the log once it is known."""
        return self.on_command or self.shows

    @property
    def adds(self) -> bool:
        """Whether its value is added to a force, a limit or a rate."""
        return self.rubs or self.holds or self.drives or self.feeds

    @property
    def in_stops(self) -> bool:
        """Whether it shows in the breakaways alone."""
        return self.holds and not self.rubs

    @property
    def at_rest(self) -> bool:
        """Whether it shows in stops and reversals, more than while the body slides."""
        return self.elastic or self.in_stops

    @property
    def any_speed(self) -> bool:
        """Whether it acts alike in slow and in quick motion."""
        return (self.rubs and self.holds) or self.drives or self.on_command


_ALL = (
    Place(
        "slip", "friction added while sliding [N], positive against the motion", "N",
        rubs=True, sign=0.0,
    ),
    Place("stiction", "force added to the stick limit in direction d [N]", "N", holds=True),
    Place(
        "friction", "friction added while sliding and to the stick limit [N]", "N",
        rubs=True, holds=True, sign=0.0,
    ),
    Place(
        "bristle", "slope dF/dy of the elastic friction force z [N/m]; it replaces sticking", "N/m",
        elastic=True,
    ),
    Place(
        "force", "driving force added [N], positive towards +y", "N", drives=True, sign=-1.0
    ),
    Place("actuator", "rate added to dF/dt [N/s]", "N/s", feeds=True, sign=1.0),
    Place(
        "command", "command that reaches the actuator in place of u [V]", "V", on_command=True
    ),
    Place(
        "delay", "time by which the command is late [s]", "s", on_command=True, delays=True
    ),
    Place("sensor", "position that the transducer shows in place of y [m]", "m", shows=True),
)  # fmt: skip
PLACES: Mapping[str, Place] = MappingProxyType({one.acts: one for one in _ALL})
