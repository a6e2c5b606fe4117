"""What no wear does to a machine's parameters: every length, every force or the time of a log moved
by one factor, a mass that is another.

The first is a slip of unit or of scale, the second another load, gear or unit.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from design.machine.readable import Display, number
from identification.model.estimates import NORMAL_95, Estimate
from identification.thresholds import OF_ACCOUNT, TWICE

QUANTITIES = ("length", "force", "time")
# By which power of a factor in length, force and time each kind of the nine parameters moves.
_POWERS: Mapping[str, tuple[int, int, int]] = {
    "m": (-1, 1, 2),
    "F_v": (-1, 1, 1),
    "F_c": (0, 1, 0),
    "F_s": (0, 1, 0),
    "dv": (1, 0, -1),
}
_COLUMNS = ("the position", "the force (or of force_per_command)", "the clock")
_FEWEST = 3  # parameters, the mass among them: two factors would explain two


class Moved(NamedTuple):
    """A parameter before and after, in one unit, and the standard deviation of after/before."""

    before: float
    after: float
    sd: float


def moved_between(
    before: Mapping[str, Estimate], after: Mapping[str, Estimate]
) -> dict[str, Moved]:
    """The parameters that two models both identify."""
    out = dict[str, Moved]()
    for name, old in before.items():
        new = after[name]
        if old.value and new.value:
            sd = np.hypot((new.sd or 0.0) / old.value, new.value * (old.sd or 0.0) / old.value**2)
            out[name] = Moved(old.value, new.value, float(sd))
    return out


def slip_of_scale(moved: Mapping[str, Moved], display: Display) -> str:
    """That all moved as if every length, every force or the time had changed by one factor of two
    at least, in words; "" where that is not so."""
    found = [
        f"every {'angle' if display.rotary and what == 'length' else what} by the factor"
        f" {number(factor)}"
        f" (the unit of {_COLUMNS[k]} 1/{number(factor)} of what the card says)"
        for k, what in enumerate(QUANTITIES)
        for factor in [_common_factor(moved, k)]
        if factor is not None
    ]
    if not found:
        return ""
    return (
        f"no wear but a slip of unit or scale, as if one thing alone had changed:"
        f" {', or '.join(found)}; correct the unit in the card, or the logger"
    )


def no_wear(moved: Mapping[str, Moved], display: Display) -> str:
    """What else than wear has moved the parameters, in words; "" where wear may have."""
    return slip_of_scale(moved, display) or other_mass(moved, display)


def other_mass(moved: Mapping[str, Moved], display: Display) -> str:
    """That the mass is another by a factor of two at least, in words; "" where it is not."""
    if "m" not in moved:
        return ""
    old, new, sd = moved["m"]
    if max(new / old, old / new) < TWICE or abs(new / old - 1.0) < NORMAL_95 * sd:
        return ""
    return (
        f"m {old:.4g} -> {new:.4g} {display.mass}, which no wear does: another load or gear, a"
        " wrong unit or scale, or a fault in the log"
    )


def _common_factor(moved: Mapping[str, Moved], k: int) -> float | None:
    """The factor of one quantity that moves every parameter to where it is now; None without."""
    if "m" not in moved or len(moved) < _FEWEST:
        return None
    ratio = {name: one.after / one.before for name, one in moved.items()}
    if min(ratio.values()) <= 0.0:
        return None
    power = {n: next(p[k] for key, p in _POWERS.items() if n.startswith(key)) for n in moved}
    factor = float(np.exp(np.median([np.log(ratio[n]) / p for n, p in power.items() if p])))
    if max(factor, 1.0 / factor) < TWICE:
        return None
    for name, one in moved.items():
        by = factor ** power[name]
        if abs(ratio[name] / by - 1.0) > max(OF_ACCOUNT, NORMAL_95 * one.sd / by):
            return None
    return factor
