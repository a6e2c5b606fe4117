"""Units and gains that no header gives, by the sizes that servo machines have and by one signal's
beside another's.

A weight is a log-probability: how usual a unit is, and how near to the middle of what machines have
the value then lies. What the log itself shows goes first: a velocity whose unit is known gives the
clock's, a reference in millimetres gives the counts of an encoder. Sizes alone make nothing sure.
"""

from collections.abc import Mapping
from dataclasses import replace
from itertools import product

import numpy as np

from identification.columns.clock import counts_thousandths
from identification.columns.column import Column
from identification.columns.header import NUMBER, says_period
from identification.columns.log_columns import Columns
from identification.columns.motion_guess import (
    USUAL,
    MotionGuess,
    UnitGuess,
    is_count,
    likeliest,
    metre,
    near,
    unit_by_turn,
    written_gain,
)
from identification.columns.notation import Factor
from identification.columns.roles import Roles
from identification.columns.scale_guess import (
    DATA_SHEET,
    SENSOR_OUTPUTS,
    by_reference,
    by_sample_number,
    counts_samples,
    in_one_unit,
    sensible,
    slope_of,
    slow_ratio,
)

EPOCHS = {"s": (1e9, 3e9), "ms": (1e12, 3e12), "us": (1e15, 3e15), "ns": (1e18, 3e18)}
AGREES = 0.1  # relative error up to which a logged velocity is the position's derivative in SI
SAME_RATE = 0.03  # the same, within which it makes sure of a unit
SHORTEST_PERIOD = 1e-12  # s; what a clock ticks faster is none
FASTEST_LOGGER = 1e-7  # s between rows; a header that says less names another unit than the clock's
GIVES_MASS = 0.9  # share of a force that its law explains, from which the mass in it counts
MOST_LOST = 8.0  # log-probability that one disagreement costs
OFF_RATE = 0.05  # relative error from which clock and velocity contradict each other
TICKS: Mapping[str, tuple[tuple[float, float], ...]] = {  # ticks a second, and what counts so
    "10000000 1/s": ((1.2e17, 1.6e17), (6.2e17, 6.6e17)),  # 100 ns since 1601, since the year 1
    "1.1574074074074073e-05 1/s": ((3.5e4, 6e4), (7.2e5, 7.6e5)),  # days since 1900, of MATLAB
}
SHORTEST_TICK, LONGEST_DAY = 1.0, 1e-3  # steps of a clock of ticks, and of one of days
FITS = {"t": "time", "y": "position", "r": "position", "F": "force", "p_p": "pressure",
        "p_n": "pressure", "u": "command", "v": "velocity", "a": "acceleration",
        "temperature": "temperature"}  # fmt: skip
SHARES = ("pwm", "duty", "tastgrad")  # words of a share
MOST_AMPERES = 100.0  # of a current in whole numbers
NEARLY_ALL_OF_IT, ALL_OF_IT = 95.0, 100.0  # the whole, in %
USUAL_COMMANDS = {"V": "A", "A": "V", "1": "%", "%": "1"}  # and what it is otherwise

Units = dict[str, UnitGuess]


def guessed_units(columns: Columns, roles: Roles, motion: MotionGuess) -> Units:
    """The unit of the clock ("t") and of every signal."""
    found = {"t": columns.clock, **roles.columns}
    given = {name: one for name, column in found.items() if (one := _of_header(name, column))}
    no_clock = _unreadable(columns, given)
    if no_clock:
        del given["t"]
    out = dict(given)
    if "y" not in out and (turn := unit_by_turn(roles.columns["y"])) and motion.motion == "rotary":
        out["y"] = UnitGuess(turn[0], None, True, turn[1])
    if "y" not in out and motion.angle:
        rival = "deg" if motion.angle == "rad" else "rad"
        out["y"] = UnitGuess(motion.angle, None, False, motion.why, rival)
    if "y" not in out and (counted := by_reference(columns, roles, given, motion.motion)):
        out["y"] = counted
    if "t" not in out and (counted := _ticks(columns) or _increment(columns)):
        out["t"] = counted
    elif "t" not in out and counts_samples(columns.clock):
        out["t"] = by_sample_number(columns, roles, out)
    out |= _jointly(columns, roles, motion, out)
    if no_clock:
        out["t"] = replace(out["t"], why=f"by its size: {no_clock}")
    factor = columns.notation.factor
    if "r" not in out:
        out["r"] = _of_reference(roles, out["y"], factor) if "r" in found else out["y"]
    for name, column in found.items():
        nameless = name == "u" and not column.header.means and column.bits is None
        nameless = nameless and not _stops_at_all(column)
        if name not in out and nameless and is_count(roles.columns["y"]):
            out[name] = _command("A", "beside counts of an encoder mostly a current")
        elif name not in out:
            out[name] = _alone(name, column, motion, factor)
    if chambers := {"p_p", "p_n"} & found.keys() - given.keys():  # of one supply: in one unit
        whole = {"p_p", "p_n"} & given.keys() or chambers
        larger = max(whole, key=lambda name: float(np.max(np.abs(found[name].x))))
        out |= dict.fromkeys(chambers, replace(out[larger], sure=False))
    return {name: _of_a_sensor(name, column, out, roles, motion) for name, column in found.items()}


def _of_a_sensor(
    name: str, column: Column, units: Units, roles: Roles, motion: MotionGuess
) -> UnitGuess:
    """The unit of a signal; of a force or pressure in volts that, and a gain to be looked up; so of
    what stands before a gear or screw, that turns where the position slides."""
    own, guess = column.header.unit, units[name]
    if name in ("F", "p_p", "p_n") and own and own.quantity in SENSOR_OUTPUTS:
        gain, other = (written_gain(1.0, own.card, unit) for unit in (guess.unit, guess.rival))
        return UnitGuess(own.card, gain, False, DATA_SHEET, other)
    linked = own is not None and own.quantity == ("position" if name == "r" else "force")
    if name not in ("r", "F", "u") or own is None or not linked or guess.gain or units["y"].gain:
        return guess
    if own.rotary == (motion.motion == "rotary"):
        return guess
    per, size = motion.force_unit, 1.0
    why = "before a gear or screw: its ratio or lead is in no log"
    if name == "r":
        per, why = units["y"].unit, "by its size beside the position, behind a gear or screw"
        size = sensible(abs(slow_ratio(column.x, roles.columns["y"].x)))
    return UnitGuess(own.card, written_gain(size, own.card, per), False, why)


def _of_header(name: str, column: Column) -> UnitGuess | None:
    """The unit that the header gives; None where it gives none of this signal."""
    unit = column.header.unit
    if unit is None or FITS.get(name) != unit.quantity:
        return None
    return UnitGuess(unit.card, None, not column.header.doubtful, "as the header says")


def _unreadable(columns: Columns, given: Units) -> str:
    """Why the clock's unit is not the one that its header names; empty where it may be."""
    if "t" not in given:
        return ""
    unit = given["t"].unit
    h = columns.step * columns.notation.factor(unit)
    return f"the header's {unit} makes rows {h:.3g} s apart" if h < FASTEST_LOGGER else ""


def _jointly(columns: Columns, roles: Roles, motion: MotionGuess, given: Units) -> Units:
    """Units of clock, position, force and velocity that go together best."""
    turns = "" if motion.motion == "linear" else " rotary"
    usual = {"t": USUAL["t"], "y": USUAL[f"y{turns}"]}
    for name in ("F", "v"):
        usual[name] = USUAL[f"{name}{turns}"] if name in roles.columns else {"": 0.0}
    open_of = {k: {given[k].unit: 0.0} if k in given else of for k, of in usual.items()}
    slope = slope_of(columns, roles)
    in_thousandths = "t" not in given and counts_thousandths(columns.clock.values)
    scored = []
    for units in product(*(of.items() for of in open_of.values())):
        names = dict(zip(open_of, (unit for unit, _ in units), strict=True))
        likely = sum(weight for _, weight in units)
        likely += _plausible(columns, roles, motion.machine, names, given)
        off = _off(names, given, slope, columns.notation.factor)
        likely -= 0.0 if off is None else min(0.5 * (off / AGREES) ** 2, MOST_LOST)
        likely -= MOST_LOST if in_thousandths and names["t"] != "s" else 0.0
        scored.append((likely, names))
    scored.sort(key=lambda one: -one[0])
    _, names = scored[0]
    out = {}
    for name, unit in names.items():
        if name in given or unit == "":
            continue
        others = [(score, other[name]) for score, other in scored if other[name] != unit]
        related = _by_relation(name, names, given, slope, columns.notation.factor)
        why = "by the velocity and the position" if related else "by its size, the header says none"
        if name == "t" and in_thousandths and not related:
            why = "by its size and its decimals, which end at the thousandth, the header says none"
        out[name] = UnitGuess(unit, None, related, why, others[0][1] if others else "")
    return out


def _ticks(columns: Columns) -> UnitGuess | None:
    """The unit of a clock that counts from 1970, or the rate of one that counts ticks or days since
    an epoch; None where it does neither."""
    first, step = float(columns.clock.values[0]), columns.step
    for unit, (low, high) in EPOCHS.items():
        if low < first < high:
            return UnitGuess(unit, None, True, "it counts from 1970")
    for gain, ranges in TICKS.items():
        fits = step >= SHORTEST_TICK if first > 1e9 else step < LONGEST_DAY
        if fits and any(low < first < high for low, high in ranges):
            return UnitGuess("1", gain, True, "it counts from an epoch")
    return None


def _increment(columns: Columns) -> UnitGuess | None:
    """The rate of a clock that counts by ones, of a log that gives the time of one by itself: above
    the table, or, as scopes do, below a name of its own; None where none is written."""
    counts = columns.clock.whole and columns.step == 1.0
    for one in (*columns.log.scalars, *(one.raw for one in columns.read)) if counts else ():
        if not says_period(one.header):
            continue
        unit = columns.notation.header(one.header, one.unit_below).unit
        step = float(one.unit_below) if NUMBER.fullmatch(one.unit_below) else float(one.values[0])
        step *= columns.notation.factor(unit.card) if unit and unit.quantity == "time" else 1.0
        return UnitGuess("1", f"{1.0 / step:.9g} 1/s", True, f"by {one.header!r}")
    return None


def _plausible(
    columns: Columns, roles: Roles, machine: str, units: Mapping[str, str], given: Units
) -> float:
    """Log-probability of the sizes that these units make."""
    factor, y = columns.notation.factor, roles.columns["y"]
    second, length = _second(units, given, factor), metre(units["y"], given.get("y"), factor)
    assert y.motion is not None
    h = max(columns.step * second, SHORTEST_PERIOD)
    per_sample = length / (h * columns.grid)
    total = near("period", h, machine) + near("duration", h * len(columns.clock.values), machine)
    total += near("travel", float(np.ptp(y.x)) * length, machine)
    total += near("speed", float(np.quantile(np.abs(y.motion.v), 0.95)) * per_sample, machine)
    if "F" in roles.columns and units["F"]:
        newton = factor(units["F"])
        F = roles.columns["F"]
        total += near("force", float(np.quantile(np.abs(F.x), 0.99)) * newton, machine)
        if roles.kind == "force" and roles.law.share > GIVES_MASS:
            m = abs(roles.law.m) * newton / (length / (h * columns.grid) ** 2)
            total += 0.5 * near("mass", m, machine)
    return total


def _second(units: Mapping[str, str], given: Units, factor: Factor) -> float:
    """What one of the clock's unit is in s."""
    clock = given.get("t")
    return metre(units["t"], clock, factor) if clock and clock.gain else factor(units["t"])


def _off(
    units: Mapping[str, str], given: Units, slope: float | None, factor: Factor
) -> float | None:
    """Logarithm of the velocity over the position's derivative, both in SI."""
    if slope is None or not units["v"]:
        return None
    length = metre(units["y"], given.get("y"), factor)
    ratio = slope * factor(units["v"]) * _second(units, given, factor) / length
    return float(np.log(max(ratio, 1e-300)))


def _by_relation(
    name: str, units: Mapping[str, str], given: Units, slope: float | None, factor: Factor
) -> bool:
    """Whether the other two of clock, position and velocity are given, and make sure of this."""
    off = _off(units, given, slope, factor)
    others = {"t", "y", "v"} - {name}
    known = name in ("t", "y") and all(one in given and given[one].sure for one in others)
    return known and off is not None and abs(off) < SAME_RATE


def contradicted_clock(columns: Columns, roles: Roles, units: Units) -> float | None:
    """How much faster the position moves by a logged velocity than by clock and units.

    None where the two agree, no velocity is logged, or its unit or the position's is a guess: by
    other units it would be another.
    """
    slope = slope_of(columns, roles)
    if slope is None or not (units["y"].sure and units["v"].sure):
        return None
    names = {name: units[name].unit for name in ("t", "y", "v")}
    off = _off(names, units, slope, columns.notation.factor)
    return None if off is None or abs(off) < OFF_RATE else float(np.exp(off))


def _of_reference(roles: Roles, y: UnitGuess, factor: Factor) -> UnitGuess:
    """The reference's unit from the position's, by their ratio."""
    if in_one_unit(roles.columns["y"], roles.columns["r"]):
        return replace(y, why="that of the position, which follows it")
    ratio = float(np.std(roles.columns["y"].x) / np.std(roles.columns["r"].x))
    per = y.gain.partition("/")[2] if y.gain else y.unit
    of_length = USUAL["y"] if per in USUAL["y"] else USUAL["y rotary"]
    wanted = metre(y.unit, y, factor) * ratio
    ranked = sorted(of_length, key=lambda one: abs(np.log(factor(one) / wanted)))
    return UnitGuess(ranked[0], None, False, "by its size beside the position", ranked[1])


def _alone(name: str, column: Column, motion: MotionGuess, factor: Factor) -> UnitGuess:
    """The unit of a signal by its own size."""
    means = column.header.means
    if name == "u" and means.get("force", -1.0) >= means.get("command", 0.0) and not column.current:
        unit, why = motion.force_unit, "the header speaks of a force that is asked for"
        return UnitGuess(unit, None, False, why, "V")
    if name == "u":
        return _of_command(column)
    if name in ("p_p", "p_n", "F"):
        peak = float(np.quantile(np.abs(column.x), 0.99))
        turns = " rotary" if name == "F" and motion.motion == "rotary" else ""
        usual = USUAL[f"F{turns}" if name == "F" else "p"]
        quantity = "force" if name == "F" else "pressure"
        unit, rival = likeliest(quantity, peak, usual, motion.machine, factor)
        return UnitGuess(unit, None, False, "by its size, the header says none", rival)
    unit = max(USUAL.get(name, {"1": 0.0}).items(), key=lambda one: one[1])[0]
    return UnitGuess(unit, None, False, "the usual one, the header says none")


def _of_command(column: Column) -> UnitGuess:
    """Volts, amperes, percent or a share, by words and limits."""
    finite = column.values[np.isfinite(column.values)]
    peak = float(np.max(np.abs(finite)))
    text = column.header.name.casefold()
    if column.bits is not None:
        return UnitGuess("1", None, False, "a register: its full scale is in no log")
    if column.current and column.whole and peak > MOST_AMPERES:
        why = "whole numbers too large for A: see the drive's manual for what one is"
        return UnitGuess("1", None, False, why, "mA")
    if column.current:
        return _command("A", "the header speaks of a current")
    share = any(one in text for one in SHARES)
    if share and peak > ALL_OF_IT:
        return UnitGuess("1", None, False, "none: above 100, so no %; the PWM's own counts", "V")
    if share or 0.9 <= peak <= 1.0:
        return _command("1" if peak <= 1.0 else "%", "by its size: a share of all")
    if _stops_at_all(column):
        return _command("%", "it stops at 100")
    return _command("V", "the usual one, the header says none")


def _stops_at_all(column: Column) -> bool:
    """Whether a command goes up to about 100, as one in percent does."""
    peak = float(np.nanmax(np.abs(column.values[np.isfinite(column.values)])))
    return NEARLY_ALL_OF_IT <= peak <= ALL_OF_IT


def _command(unit: str, why: str) -> UnitGuess:
    return UnitGuess(unit, None, False, why, USUAL_COMMANDS[unit])
