"""Gains of positions in counts or volts, and the rate of a clock that counts samples, by one signal
beside another."""

from collections.abc import Mapping

import numpy as np

from identification.arrays import Array
from identification.columns.column import BITS, Column
from identification.columns.log_columns import Columns
from identification.columns.motion_guess import (
    USUAL,
    UnitGuess,
    counts_per_turn,
    is_count,
    likeliest,
    metre,
    written_gain,
)
from identification.columns.roles import Roles
from identification.log import Motion
from identification.signals.relations import derivative, lead
from identification.thresholds import TWICE

WELL_KNOWN = 0.85  # likeness of position and reference, from which their ratio is a gain
ROUND_DIGITS = (1.0, 2.0, 2.5, 4.0, 5.0, 8.0, 10.0)  # of gains that sensors have
ABOUT = 0.05  # that a round gain is off what the log shows
SLOW_STRETCHES = 24  # of a log, over whose means position and reference are compared
REGISTERS = tuple(2**bits for bits in BITS)  # ranges that counters have whatever a turn is
SURELY_A_NUMBER = 2.0  # log-odds of a clock by its name, from which it numbers samples
DATA_SHEET = "not in the log: see the sensor's data sheet"
SENSOR_OUTPUTS = ("command", "count")


def by_reference(
    columns: Columns, roles: Roles, given: Mapping[str, UnitGuess], motion: Motion
) -> UnitGuess | None:
    """The gain of a position in counts or volts: by where it leaps back, by a velocity or a
    reference whose unit is known, else a usual one."""
    y, r = roles.columns["y"], roles.columns.get("r")
    if not is_output(y):
        return None
    own = y.header.unit
    unit = own.card if own and own.quantity == "command" else "count"
    per = "turn" if motion == "rotary" else "mm"
    turn = counts_per_turn(y.numbers) if motion == "rotary" and unit == "count" else None
    if turn is not None and turn not in REGISTERS:
        return UnitGuess(unit, f"{turn} count/turn", True, "it leaps back after a turn")

    def guess(number: float, why: str, rival: float | None = None) -> UnitGuess:
        other = "" if rival is None else written_gain(rival, unit, per)
        return UnitGuess(unit, written_gain(number, unit, per), False, why, other)

    if (rate := _by_velocity(columns, roles, given, motion)) is not None:
        return guess(sensible(rate, per == "turn"), "by the velocity beside it")
    known = given.get("r")
    if r is not None and not is_output(r) and (known or not in_one_unit(y, r)):
        usual = USUAL["y" if motion == "linear" else "y rotary"]
        likely, _ = likeliest("travel", np.ptp(r.x), usual, motion, columns.notation.factor)
        per = known.unit if known else likely
        if abs(lead(r.x, y.x).likeness) > WELL_KNOWN:
            number = sensible(slow_ratio(y.x, r.x), per == "turn")
            return guess(number, f"by its size beside the reference {r.shown}")
    number, other = (4096.0, 8192.0) if motion == "rotary" else (1000.0, 2000.0)
    if turn is not None:
        return guess(turn, f"it leaps by {turn}, a turn or the range of a counter", number)
    if unit != "count":
        of_range = float(np.ptp(y.x)) / (1.0 if motion == "rotary" else 100.0)
        return guess(sensible(of_range), DATA_SHEET)
    return guess(number, DATA_SHEET, other)


def _by_velocity(
    columns: Columns, roles: Roles, given: Mapping[str, UnitGuess], motion: Motion
) -> float | None:
    """Counts a turn or a millimetre, where clock and velocity have known units."""
    slope = slope_of(columns, roles)
    if not slope or not {"t", "v"} <= given.keys():
        return None
    size, factor = 2.0 * np.pi if motion == "rotary" else 1e-3, columns.notation.factor
    return size / (slope * factor(given["v"].unit) * factor(given["t"].unit))


def is_output(column: Column) -> bool:
    """Whether a position is what a sensor gives: counts, volts, or whole numbers without a unit."""
    unit = column.header.unit
    return is_count(column) or (unit is not None and unit.quantity in SENSOR_OUTPUTS)


def slow_ratio(y: Array, r: Array) -> float:
    """How large a position is beside its reference where both are slow: it overshoots fast ones."""
    count = max(SLOW_STRETCHES, 2)
    size = max(1, len(y) // count)
    a, b = (x[: len(x) // size * size].reshape(-1, size).mean(axis=1) for x in (y, r))
    a, b = a - a.mean(), b - b.mean()
    return float(a @ b / (b @ b))


def in_one_unit(y: Column, r: Column) -> bool:
    """Whether a position and its reference are of about one size, as in one unit."""
    return 1.0 / TWICE < float(np.std(y.x) / np.std(r.x)) < TWICE


def sensible(number: float, of_turn: bool = False) -> float:
    """The number to three digits, or a round one (of a turn a power of two) that is as near."""
    if number == 0.0:
        return 1.0
    size = abs(number)
    decade = 10.0 ** np.floor(np.log10(size))
    round_ones = [digit * decade for digit in ROUND_DIGITS]
    round_ones += [2.0 ** round(np.log2(size))] if of_turn else []
    nearest = min(round_ones, key=lambda one: abs(np.log(one / size)))
    if abs(nearest / size - 1.0) < ABOUT:
        return float(np.sign(number) * nearest)
    return float(f"{number:.3g}")


def counts_samples(clock: Column) -> bool:
    """Whether the clock is the number of a sample: by its name, or by its name and step."""
    means = clock.header.means
    called = means.get("count", 0.0) - means.get("time", 0.0)
    by_ones = float(np.median(np.diff(clock.values))) == 1.0
    return clock.whole and (called >= SURELY_A_NUMBER or (called > 0.0 and by_ones))


def by_sample_number(columns: Columns, roles: Roles, given: Mapping[str, UnitGuess]) -> UnitGuess:
    """The rate of a log that counts its samples: by a velocity of known unit, else a usual one."""
    rate, why = 1000.0, "a usual one: nothing in the log gives the time of a sample"
    slope, factor = slope_of(columns, roles), columns.notation.factor
    if slope is not None and {"y", "v"} <= given.keys():
        length = metre(given["y"].unit, given["y"], factor)
        rate = sensible(slope * factor(given["v"].unit) / length)
        why = "by the velocity and the position"
    elif slope is not None and not {"y", "v"} & given.keys():
        rate, why = sensible(slope), "by the velocity, if it is the position's unit a second"
    return UnitGuess("1", f"{rate:.9g} 1/s", False, why)


def slope_of(columns: Columns, roles: Roles) -> float | None:
    """How large the velocity column is beside the position's change in one unit of the clock."""
    y, v = roles.columns["y"], roles.columns.get("v")
    if v is None or y.motion is None:
        return None
    return abs(derivative(y.motion, v.x).factor) * columns.step * columns.grid
