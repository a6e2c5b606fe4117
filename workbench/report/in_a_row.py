"""All logs on one axis of time, one behind the other."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from workbench.logs.sources import Source
from workbench.report.chart import Mark, Part


@dataclass(frozen=True, eq=False)
class InARow:
    """Time of all logs in a row [s], with an empty sample between two of them."""

    t: Array
    lengths: tuple[int, ...]
    parts: tuple[Part, ...]

    def joined(self, values: Sequence[Array]) -> Array:
        """Values of every log as one column of `t`'s length; NaN between the logs."""
        gap = np.array([np.nan])
        pieces = [piece for one in values for piece in (np.asarray(one, dtype=np.float64), gap)]
        return np.concatenate(pieces[:-1])

    def none(self) -> list[Array]:
        """No values, for every log."""
        return [np.full(n, np.nan) for n in self.lengths]

    @property
    def marks(self) -> tuple[Mark, ...]:
        """Where each log but the first begins."""
        return tuple(Mark(part.low, "x") for part in self.parts[1:])

    @property
    def label(self) -> str:
        """Name of the axis."""
        return "time [s]" if len(self.parts) == 1 else "time, logs in a row [s]"


def in_a_row(sources: Sequence[Source]) -> InARow:
    """The logs of the sources, each from where the one before it ended."""
    begin, times, parts = 0.0, [], []
    for number, source in enumerate(sources):
        t = begin + source.log["t"] - source.log["t"][0]
        times.append(t)
        name = source.file if len(sources) == 1 else f"{number + 1}: {source.file}"
        parts.append(Part(name, float(t[0]), float(t[-1])))
        begin = float(t[-1]) + 2 * source.log.h
        if number + 1 < len(sources):
            times.append(np.array([float(t[-1]) + source.log.h]))
    lengths = tuple(len(source.log) for source in sources)
    return InARow(np.concatenate(times), lengths, tuple(parts))


def liveliest(y: Array, share: float = 0.12) -> slice:
    """The stretch of a log, that share of it, in which the position moves most."""
    size = max(50, round(share * len(y)))
    if len(y) <= size:
        return slice(0, len(y))
    # Blocks keep the noise of a fast log from counting as motion.
    block = max(1, size // 50)
    coarse = y[::block]
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(coarse)))])
    wide = max(2, size // block)
    gain = way[wide:] - way[:-wide]
    start = int(np.argmax(gain)) * block if gain.size else 0
    return slice(start, min(start + size, len(y)))
