"""A column of an unknown log, and what its values by themselves show."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from identification.arrays import Array
from identification.signals.differentiate import Motion, resolution
from identification.signals.noise import local_noise
from identification.signals.relations import motion_of
from workbench.cards.headers import Header, words_of
from workbench.logs.unknown import RawColumn
from workbench.steps.first_card.registers import Register

COLUMN = "column"
MOST_ROWS_READ = 10_000
WAY_BLOCKS = 2000  # means of a column over which its way is reckoned
MOSTLY_NOISE = 0.8  # of a signal's spread, that its white noise is
CURRENTS = ("current", "strom", "電流", "电流", "courant", "corrente", " iq ", " i q ", " isq ",
            " ia ", " i a ", " amp")  # fmt: skip
FEW_LEVELS = 8  # values at most, of a flag, mode or state


@dataclass(frozen=True, eq=False)
class Column:
    """A column with its header; `values` (n,) as in the file, `x` (k,) on the grid looked at, both
    as its register means them; axis: which of several machines of the log it is of ("": of all);
    renewed: samples of `x` from one new value to the next of a column that is held, else 1;
    summed: whether `values` or `x` are the sum of what the file has."""

    raw: RawColumn
    header: Header
    values: Array
    x: Array
    register: Register | None = None
    axis: str = ""
    renewed: float = 1.0
    summed: bool = False

    @property
    def bits(self) -> int | None:
        """Of two's complement, else None."""
        return self.register.bits if self.register else None

    @property
    def shown(self) -> str:
        """The column as a reader finds it in the file."""
        header, number = self.raw.header, self.raw.number
        if not header:
            return f"number {number}"
        return repr(header) if header == self.raw.key else f"{header!r} (number {number})"

    @property
    def answer(self) -> str:
        """The column as an answer names it, beside units."""
        return f"{COLUMN} {self.raw.key}"

    @cached_property
    def numbers(self) -> Array:
        """The first values that are numbers, as many as are looked at."""
        part = self.values[:MOST_ROWS_READ]
        return np.asarray(part[np.isfinite(part)])

    @cached_property
    def motion(self) -> Motion | None:
        """The column as if it were a position."""
        return motion_of(self.x, self.renewed)

    @cached_property
    def noise(self) -> float:
        """White noise and rounding of the column, one sigma."""
        return local_noise(self.x)

    @cached_property
    def noisy(self) -> bool:
        """Whether it is white noise, and next to nothing else."""
        return self.noise > MOSTLY_NOISE * float(np.std(self.x))

    @cached_property
    def levels(self) -> Array:
        """The values that it takes, in order."""
        return np.asarray(np.unique(self.numbers))

    @cached_property
    def step(self) -> float:
        """Step of its values where all are multiples of one, else 0."""
        return resolution(self.numbers)

    @cached_property
    def flag(self) -> bool:
        """Whether it holds a few whole numbers: a switch, a mode or a state."""
        few = self.levels
        whole = 1 < len(few) <= FEW_LEVELS and bool(np.all(few == np.round(few)))
        return whole and (few[0] >= 0.0 or bool(np.all(np.abs(few) <= 1.0)))

    @cached_property
    def current(self) -> bool:
        """Whether it is a current, by its unit or by its name."""
        text = f" {' '.join(words_of(self.header.name))} "
        if self.header.unit is not None:
            return self.header.unit.card in ("A", "mA")
        return any(one in text for one in CURRENTS) or (" i " in text and not self.whole)

    @cached_property
    def way_gone(self) -> float:
        """The way that it goes, in units of its range."""
        size = max(1, len(self.x) // WAY_BLOCKS)
        count = len(self.x) // size
        means = self.x[: count * size].reshape(count, size).mean(axis=1)
        width = float(np.ptp(means))
        return float(np.sum(np.abs(np.diff(means)))) / width if width > 0 else 0.0

    @cached_property
    def whole(self) -> bool:
        """Whether it has whole numbers alone."""
        finite = self.values[np.isfinite(self.values)]
        return bool(np.all(finite == np.round(finite)))
