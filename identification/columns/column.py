"""A column of an unknown log, what its values by themselves show, and registers: counts below zero
in two's complement or by a bit of sign, and parts of counts."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.columns.header import Header, words_of
from identification.signals.differentiate import Motion, resolution
from identification.signals.noise import local_noise
from identification.signals.relations import motion_of

BITS = (16, 32)  # of a register that counts below zero as two's complement
FEWEST_BITS = 8  # of a magnitude beside its sign
BETWEEN_SIGNS = 0.01  # samples at most in the middle of its range
NEAR_ZERO = 0.1  # of the range on both sides of the jump, at which a sign changes
# Of leaps at a bit of sign: how many at least, the share of those near zero, how far it goes both
# ways, and times all magnitudes that the bit is far above them.
FEWEST_LEAPS, OFTEN_NEAR, BOTH_WAYS, FAR_ABOVE = 4, 0.25, 0.25, 2.0
SMOOTHER = 0.25  # of the largest step as it stands, that steps are at most once the sign is read
COUNT_PARTS = 256.0  # of a count that is halved again and again
LONG_WAY_OF_COUNTS = 1000.0  # that such a position covers at least
OFF_PART, MOSTLY = 0.05, 0.98  # of a part, that steps of one in single precision are off; of steps


class Register(NamedTuple):
    """A column as its register means it: bits of two's complement, or the bit of its sign.

    row: where it first leaps, a row of data from 1.
    """

    values: Array
    bits: int | None
    sign_bit: int | None = None
    row: int = 0


def read_register(x: Array) -> Register | None:
    """The column (n,) of whole numbers as signed ones; None where it is as it stands."""
    finite = x[np.isfinite(x)]
    if len(finite) < 2 or finite.min() < 0 or np.any(finite != np.round(finite)):
        return None
    for bits in BITS:
        top = 2.0**bits
        middle = (finite > top / 8) & (finite < top * 7 / 8)
        low, high = np.mean(finite <= top / 8), np.mean(finite >= top * 7 / 8)
        if finite.max() < top and np.mean(middle) < BETWEEN_SIGNS and low > 0.0 and high > 0.0:
            return Register(np.where(x >= top / 2, x - top, x), bits)
    return _sign_and_magnitude(x)


def _sign_and_magnitude(x: Array) -> Register | None:
    """The column whose topmost bit is the sign: it leaps by that bit where it passes zero.

    In a few rows a stroke it passes zero within a row: then by those leaps that are near it, which
    no signal has that goes through the bit's value; or, where that is far above all else, by this.
    """
    finite = x[np.isfinite(x)]
    bit = int(np.log2(max(finite.max(), 1.0)))
    top = 2.0**bit
    if bit < FEWEST_BITS or not np.any(finite < top):
        return None
    read = np.where(x >= top, top - x, x)
    most, least = float(np.nanmax(np.abs(read))), float(min(np.nanmax(read), -np.nanmin(read)))
    step, smooth = np.abs(np.diff(x)), np.abs(np.diff(read))
    leaps = np.flatnonzero((x[1:] >= top) != (x[:-1] >= top))
    if not len(leaps):
        return None
    near = np.maximum(np.abs(read[leaps]), np.abs(read[leaps + 1])) <= NEAR_ZERO * most
    slow = np.nanmax(smooth) <= SMOOTHER * np.nanmax(step) and np.mean(near) >= 0.5
    both = len(leaps) >= FEWEST_LEAPS and least > BOTH_WAYS * most
    apart = FAR_ABOVE * most < top and finite[finite >= top].min() - top <= NEAR_ZERO * most
    if slow or (both and (np.mean(near) >= OFTEN_NEAR or apart)):
        return Register(read, None, bit, int(leaps[0]) + 2)
    return None


def halved_counts(x: Array) -> bool:
    """Whether steps are counts that a drive interpolates, in parts of a power of two."""
    if float(np.ptp(x)) < LONG_WAY_OF_COUNTS:
        return False
    parts = COUNT_PARTS * np.diff(x)
    off = np.abs(parts - np.round(parts))
    decimal = 1000.0 * np.diff(x)  # millimetres, or degrees, to three places have such steps too
    return bool(np.mean(off < OFF_PART) > MOSTLY and np.mean(
        np.abs(decimal - np.round(decimal)) < OFF_PART) < MOSTLY)  # fmt: skip


COLUMN = "column"
MOST_ROWS_READ = 10_000
WAY_BLOCKS = 2000  # means of a column over which its way is reckoned
MOSTLY_NOISE = 0.8  # of a signal's spread, that its white noise is
CURRENTS = ("current", "strom", "電流", "电流", "courant", "corrente", " iq ", " i q ", " isq ",
            " ia ", " i a ", " amp", " cur ", " curr ")  # fmt: skip
FEW_LEVELS = 8  # values at most, of a flag, mode or state


@dataclass(frozen=True, eq=False)
class RawColumn:
    """One column: its number from 0, what a card calls it, its header and the unit below it, its
    values (n,) (NaN where there is no number), why they cannot be used (else empty), and its group,
    where the file has several."""

    number: int
    key: str | int
    header: str
    unit_below: str
    values: Array
    unusable: str = ""
    group: str = ""


@dataclass(frozen=True, eq=False)
class Column:
    """A column with its header; `values` (n,) as in the file, `x` (k,) on the grid looked at, both
    as its register means them; axis: which of several machines of the log it is of ("": of all);
    renewed: samples of `x` from one new value to the next of a column that is held, else 1;
    summed: whether `values` or `x` are the sum of what the file has; pascals: what one of the unit
    of a pressure is in Pa, None of what has no such unit."""

    raw: RawColumn
    header: Header
    values: Array
    x: Array
    register: Register | None = None
    axis: str = ""
    renewed: float = 1.0
    summed: bool = False
    pascals: float | None = None

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

    def beside(self, other: "Column") -> tuple[Array, Array]:
        """Of the rows looked at those in which both are numbers."""
        a, b = self.values[:MOST_ROWS_READ], other.values[:MOST_ROWS_READ]
        both = np.isfinite(a) & np.isfinite(b)
        return a[both], b[both]

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
            return self.header.unit.plain in ("A", "mA")
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
