"""Samples excluded from a log: which samples of which signal, when, and what became of them."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

Kind = Literal["missing", "spike", "jump", "wrap", "frozen", "saturated"]
Done = Literal["interpolated", "offset removed", "cut out", "kept"]

_SAID: dict[Kind, str] = {
    "missing": "missing samples",
    "spike": "spikes",
    "jump": "a jump that stays",
    "wrap": "a counter that wraps",
    "frozen": "a value that stands still",
    "saturated": "an end of its range",
}


@dataclass(frozen=True)
class BadSamples:
    """One finding in a log.

    first, last [s]: times of the first and the last bad sample; samples: how many are bad; size:
    the largest error in the signal's unit, None where it is not known; done: what became of them.
    """

    log: str
    signal: str
    kind: Kind
    first: float
    last: float
    samples: int
    size: float | None
    done: Done

    def as_json(self) -> dict[str, Any]:
        """The finding as results carry it."""
        return asdict(self)

    @property
    def line(self) -> str:
        """The finding in words."""
        when = f"t = {self.first:.6g} s"
        if self.last > self.first:
            when += f" to {self.last:.6g} s"
        size = "" if self.size is None else f", {self.size:.3g} at most"
        many = f" ({self.samples} sample{'s' * (self.samples > 1)}{size})"
        if self.kind == "saturated" and self.signal == "u":
            return f"{self.log}: the command is at its limit in {self.samples} samples, {when}"
        if self.kind == "saturated":
            where = "at an end of its range"
            if self.done == "kept":
                where = "at its largest or smallest value"
            return (
                f"{self.log}: the sensor of {self.signal!r} is {where} in {self.samples} samples,"
                f" {when}: {self.done}"
            )
        return f"{self.log}: {self.signal!r} has {_SAID[self.kind]} at {when}{many}: {self.done}"


def lines(found: Sequence[BadSamples]) -> tuple[str, ...]:
    """A line each."""
    return tuple(one.line for one in found)
