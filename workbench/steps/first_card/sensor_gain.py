"""Gains that no header gives: counts and volts of a position, and the rate of counted samples."""

from collections.abc import Mapping

import numpy as np

from identification.arrays import Array
from identification.signals.relations import derivative, lead
from workbench.cards.units import Motion
from workbench.steps.first_card.columns import Column, Columns
from workbench.steps.first_card.motion_guess import counts_per_turn, is_count
from workbench.steps.first_card.roles import Roles
from workbench.steps.first_card.sizes import USUAL, UnitGuess, factor, likeliest, metre

WELL_KNOWN = 0.85  # likeness of position and reference, from which their ratio is a gain
ROUND_DIGITS = (1.0, 2.0, 2.5, 4.0, 5.0, 8.0, 10.0)  # of gains that sensors have
ABOUT = 0.05  # that a round gain is off what the log shows
SLOW_STRETCHES = 24  # of a log, over whose means position and reference are compared
NEARLY_A_TURN = 0.98  # of a power of two, that counts span which may be a turn
COUNTS_OF_A_TURN = tuple(2.0**bits for bits in range(10, 25))  # counts that encoders have a turn
SURELY_A_NUMBER = 2.0  # log-odds of a clock by its name, from which it numbers samples
SENSOR_OUTPUTS = ("command", "count")


def by_reference(
    columns: Columns, roles: Roles, given: Mapping[str, UnitGuess], motion: Motion
) -> UnitGuess | None:
    """The gain of a position in counts or volts: by where it leaps back, by a velocity or a
    reference whose unit is known, else a usual one."""
    y, r = roles.columns["y"], roles.columns.get("r")
    if not is_output(y):
        return None
    unit = "V" if y.header.unit and y.header.unit.quantity == "command" else "count"
    per = "turn" if motion == "rotary" else "mm"
    turn = counts_per_turn(y.numbers) if motion == "rotary" and unit == "count" else None
    if turn is not None:
        return UnitGuess(unit, f"{turn} count/turn", True, "it leaps back after a turn")
    if (rate := _by_velocity(columns, roles, given, motion)) is not None:
        number = _sensible(rate, per == "turn")
        return UnitGuess(unit, f"{number:.9g} {unit}/{per}", False, "by the velocity beside it")
    if r is not None and not is_output(r):
        together = lead(r.x, y.x)
        known = given.get("r")
        usual = USUAL["y" if motion == "linear" else "y rotary"]
        per = known.unit if known else likeliest("travel", np.ptp(r.x), usual, motion)[0]
        if abs(together.likeness) > WELL_KNOWN:
            number = _sensible(_slow_ratio(y.x, r.x), per == "turn")
            why = f"by its size beside the reference {r.shown}"
            return UnitGuess(unit, f"{number:.9g} {unit}/{per}", False, why)
    number, other = (4096.0, 8192.0) if motion == "rotary" else (1000.0, 2000.0)
    span = 2.0 ** np.ceil(np.log2(max(float(np.ptp(y.numbers)), 1.0)))
    one_turn = float(np.ptp(y.numbers)) > NEARLY_A_TURN * span
    if motion == "rotary" and unit == "count" and one_turn and span in COUNTS_OF_A_TURN:
        rival = f"{number:.9g} {unit}/{per}"
        return UnitGuess(unit, f"{span:.9g} {unit}/{per}", False,
                         f"it spans nearly {span:.9g}, a turn it may be", rival)  # fmt: skip
    rival = f"{other:.9g} {unit}/{per}"
    if unit == "V":
        number = _sensible(float(np.ptp(y.x)) / (1.0 if motion == "rotary" else 100.0))
        rival = ""
    why = "not in the log: see the sensor's data sheet"
    return UnitGuess(unit, f"{number:.9g} {unit}/{per}", False, why, rival)


def _by_velocity(
    columns: Columns, roles: Roles, given: Mapping[str, UnitGuess], motion: Motion
) -> float | None:
    """Counts a turn or a millimetre, where clock and velocity have known units."""
    if not {"t", "v"} <= set(given) or "v" not in roles.columns:
        return None
    found = roles.columns["y"].motion
    assert found is not None
    per_sample = abs(derivative(found, roles.columns["v"].x).factor) * factor(given["v"].unit)
    second = factor(given["t"].unit) * columns.step * columns.grid
    size = 2.0 * np.pi if motion == "rotary" else 1e-3
    return size / (per_sample * second) if per_sample > 0.0 else None


def is_output(column: Column) -> bool:
    """Whether a position is what a sensor gives: counts, volts, or whole numbers without a unit."""
    unit = column.header.unit
    return is_count(column) or (unit is not None and unit.quantity in SENSOR_OUTPUTS)


def _slow_ratio(y: Array, r: Array) -> float:
    """How large a position is beside its reference where both are slow: it overshoots fast ones."""
    count = max(SLOW_STRETCHES, 2)
    size = max(1, len(y) // count)
    a, b = (x[: len(x) // size * size].reshape(-1, size).mean(axis=1) for x in (y, r))
    a, b = a - a.mean(), b - b.mean()
    return float(a @ b / (b @ b))


def _sensible(number: float, of_turn: bool = False) -> float:
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
    if {"y", "v"} <= set(given) and "v" in roles.columns:
        motion = roles.columns["y"].motion
        assert motion is not None
        slope = derivative(motion, roles.columns["v"].x).factor / columns.grid
        ratio = abs(slope) * factor(given["v"].unit) / metre(given["y"].unit, given["y"])
        rate, why = _sensible(ratio * columns.step), "by the velocity and the position"
    return UnitGuess("1", f"{rate:.9g} 1/s", False, why)
