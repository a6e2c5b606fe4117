"""Units that no header gives, by the sizes that servo machines have and by one signal's beside
another's.

A weight is a log-probability: how usual a unit is, and how near to the middle of what machines have
the value then lies. What the log itself tells goes first: a velocity whose unit is known tells the
clock's, a reference in millimetres tells the counts of an encoder.
"""

from collections.abc import Iterable, Mapping, Sequence
from itertools import product

import numpy as np

from identification.signals.differentiate import resolution
from identification.signals.relations import derivative
from workbench.cards.units import Motion
from workbench.steps.first_card.columns import Column, Columns
from workbench.steps.first_card.roles import Roles
from workbench.steps.first_card.sensor_gain import by_reference, by_sample_number, counts_samples
from workbench.steps.first_card.sizes import USUAL, UnitGuess, factor, likeliest, metre, near

EPOCHS = {"s": (1e9, 3e9), "ms": (1e12, 3e12), "us": (1e15, 3e15), "ns": (1e18, 3e18)}
AGREES = 0.1  # relative error up to which a logged velocity is the position's derivative in SI
SHORTEST_PERIOD = 1e-12  # s; what a clock ticks faster is none
TELLS_MASS = 0.9  # share of a force that its law explains, from which the mass in it counts
MOST_LOST = 8.0  # log-probability that one disagreement costs
SURE_OF_UNIT = 2.5  # log-probability by which the best units are ahead, where they are called sure
WHOLE_POWER = 1e-4  # of a binary logarithm, that a turn over a step is off a whole one


def told_motion(roles: Roles) -> tuple[Motion, str]:
    """Whether the machine turns, and by what that is known; empty where it is only usual."""
    for name in ("y", "r", "F"):
        column = roles.columns.get(name)
        if (
            column is not None
            and column.header.unit is not None
            and (column.header.unit.quantity in ("position", "force"))
        ):
            motion: Motion = "rotary" if column.header.unit.rotary else "linear"
            return motion, f"the unit of column {column.shown}"
    if any(column.header.angle for column in roles.columns.values()):
        return "rotary", "a header that speaks of an angle or a torque"
    step = resolution(roles.columns["y"].numbers)
    for turn, unit in ((2.0 * np.pi, "radians"), (360.0, "degrees")):
        if step > 0.0 and abs(np.log2(turn / step) - round(np.log2(turn / step))) < WHOLE_POWER:
            return "rotary", f"its steps are a turn in {unit} over a power of two"
    return "linear", ""


def guessed_units(columns: Columns, roles: Roles, motion: Motion) -> dict[str, UnitGuess]:
    """The unit of the clock ("t") and of every signal."""
    found = {"t": columns.clock, **roles.columns}
    given = {name: one for name, column in found.items() if (one := _of_header(name, column))}
    out = dict(given)
    if "y" not in out and (counted := by_reference(roles, given, motion)):
        out["y"] = counted
    if "t" not in out and counts_samples(columns.clock):
        out["t"] = by_sample_number(columns, roles, out)
    out |= _jointly(columns, roles, motion, out)
    if "r" not in out:
        out["r"] = _of_reference(roles, out["y"]) if "r" in found else out["y"]
    for name, column in found.items():
        if name not in out:
            out[name] = _alone(name, column, motion)
    return {name: out[name] for name in found}


def _of_header(name: str, column: Column) -> UnitGuess | None:
    """The unit that the header gives; None where it gives none of this signal."""
    unit = column.header.unit
    fits = {"t": "time", "y": "position", "r": "position", "F": "force", "p_p": "pressure",
            "p_n": "pressure", "u": "command", "v": "velocity", "a": "acceleration",
            "temperature": "temperature"}  # fmt: skip
    if unit is None or fits.get(name) != unit.quantity:
        return None
    return UnitGuess(unit.card, None, not column.header.doubtful, "as the header says")


def _jointly(
    columns: Columns, roles: Roles, motion: Motion, given: Mapping[str, UnitGuess]
) -> dict[str, UnitGuess]:
    """Units of clock, position, force and velocity that go together best."""
    turns = "" if motion == "linear" else " rotary"
    open_of = {
        "t": _open("t", given) or _clock_units(columns.clock),
        "y": _open("y", given) or USUAL[f"y{turns}"],
        "F": _open("F", given) or (USUAL[f"F{turns}"] if "F" in roles.columns else {"": 0.0}),
        "v": _open("v", given) or (USUAL[f"v{turns}"] if "v" in roles.columns else {"": 0.0}),
    }
    scored = []
    for units in product(*(of.items() for of in open_of.values())):
        names = dict(zip(open_of, (unit for unit, _ in units), strict=True))
        usual = sum(weight for _, weight in units)
        scored.append((usual + _plausible(columns, roles, motion, names, given), names))
    scored.sort(key=lambda one: -one[0])
    best, names = scored[0]
    out = {}
    for name, unit in names.items():
        if name in given or unit == "":
            continue
        rivals = [score for score, other in scored if other[name] != unit]
        # Forces of machines are of all sizes: theirs alone never makes sure of the unit.
        sure = name != "F" and best - max(rivals, default=-np.inf) > SURE_OF_UNIT
        out[name] = UnitGuess(unit, None, sure, "by its size, the header gives none")
    return out


def _open(name: str, given: Mapping[str, UnitGuess]) -> Mapping[str, float]:
    """The one unit that is given, else none."""
    return {given[name].unit: 0.0} if name in given else {}


def _clock_units(clock: Column) -> Mapping[str, float]:
    """Units that a clock may have: of a time since 1970 that one, of sample numbers none."""
    first = float(clock.values[0])
    for unit, (low, high) in EPOCHS.items():
        if low < first < high:
            return {unit: 0.0}
    return USUAL["t"]


def _plausible(
    columns: Columns,
    roles: Roles,
    motion: Motion,
    units: Mapping[str, str],
    given: Mapping[str, UnitGuess],
) -> float:
    """Log-probability of the sizes that these units make."""
    clock = given.get("t")
    second = metre(units["t"], clock) if clock and clock.gain else factor(units["t"])
    length = metre(units["y"], given.get("y"))
    y = roles.columns["y"]
    assert y.motion is not None
    h = max(columns.step * second, SHORTEST_PERIOD)
    per_sample = length / (h * columns.grid)
    total = near("period", h, "linear") + near("duration", h * len(columns.clock.values), "linear")
    total += near("travel", float(np.ptp(y.x)) * length, motion)
    total += near("speed", float(np.quantile(np.abs(y.motion.v), 0.95)) * per_sample, motion)
    if "F" in roles.columns and units["F"]:
        newton = factor(units["F"])
        F = roles.columns["F"]
        total += near("force", float(np.quantile(np.abs(F.x), 0.99)) * newton, motion)
        if roles.kind == "force" and roles.law.share > TELLS_MASS:
            m = abs(roles.law.m) * newton / (length / (h * columns.grid) ** 2)
            total += 0.5 * near("mass", m, motion)
    if "v" in roles.columns and units["v"]:
        ratio = derivative(y.motion, roles.columns["v"].x).factor * factor(units["v"]) / per_sample
        off = np.log(max(abs(ratio), 1e-300)) / AGREES
        total -= min(0.5 * float(off**2), MOST_LOST)
    return total


def _of_reference(roles: Roles, y: UnitGuess) -> UnitGuess:
    """The reference's unit from the position's, by their ratio."""
    ratio = float(np.std(roles.columns["y"].x) / np.std(roles.columns["r"].x))
    if 0.5 < ratio < 2.0:
        return UnitGuess(y.unit, y.gain, y.sure, "that of the position, which follows it")
    per = y.gain.partition("/")[2] if y.gain else y.unit
    of_length = USUAL["y"] if per in USUAL["y"] else USUAL["y rotary"]
    wanted = metre(y.unit, y) * ratio
    unit = min(of_length, key=lambda one: abs(np.log(factor(one) / wanted)))
    return UnitGuess(unit, None, False, "by its size beside the position")


def _alone(name: str, column: Column, motion: Motion) -> UnitGuess:
    """The unit of a signal by its own size."""
    if name == "u":
        return _of_command(column)
    if name in ("p_p", "p_n"):
        peak = float(np.quantile(np.abs(column.x), 0.99))
        unit = likeliest("pressure", peak, USUAL["p"], motion)
        return UnitGuess(unit, None, _clear(peak), "by its size, the header gives none")
    if name == "F":
        peak = float(np.quantile(np.abs(column.x), 0.99))
        usual = USUAL["F" if motion == "linear" else "F rotary"]
        return UnitGuess(likeliest("force", peak, usual, motion), None, False, "by its size")
    unit = max(USUAL.get(name, {"1": 0.0}).items(), key=lambda one: one[1])[0]
    return UnitGuess(unit, None, False, "the usual one, the header gives none")


def _clear(peak: float) -> bool:
    """Whether a pressure has one likely unit only."""
    likely: Sequence[float] = sorted(
        usual + near("pressure", peak * factor(unit), "linear")
        for unit, usual in USUAL["p"].items()
    )
    return likely[-1] - likely[-2] > SURE_OF_UNIT


def _of_command(column: Column) -> UnitGuess:
    """Volts, amperes, percent or a share, by words and limits."""
    words: Iterable[str] = column.header.name.casefold().split()
    finite = column.values[np.isfinite(column.values)]
    peak = float(np.max(np.abs(finite)))
    text = " ".join(words)
    if column.bits is not None:
        return UnitGuess("1", None, False, "a register: its full scale is in no log")
    if any(one in text for one in ("current", "strom", "電流", "courant", "i_q", "iq")):
        return UnitGuess("A", None, False, "the header speaks of a current")
    if any(one in text for one in ("pwm", "duty")) or 0.9 <= peak <= 1.0:
        return UnitGuess("1" if peak <= 1.0 else "%", None, False, "by its size: a share of all")
    if 95.0 <= peak <= 100.0:
        return UnitGuess("%", None, False, "it stops at 100")
    return UnitGuess("V", None, False, "the usual one, the header gives none")
