"""Limits of an axis by its own earlier logs, and the light of a number within or beyond them.

Light to import, since the page of a machine asks for it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import ndtr, stdtrit

from identification.arrays import Array

FEWEST_EARLIER = 5  # logs from which a machine's own limits come
HISTORY_SIGMAS = 3.0
LEAST_ROOM = 0.02  # of the mean, nearer than which no limit of the logs lies: `drift --margin`
BREAKAWAY_ROOM = 0.05  # the same of breakaway, which one log shows no better
MEANING_OF = {
    "F_cp": "Coulomb friction, positive",
    "F_cn": "Coulomb friction, negative",
    "F_vp": "viscous friction, positive",
    "F_vn": "viscous friction, negative",
    "F_sp": "breakaway, positive",
    "F_sn": "breakaway, negative",
    "m": "moving mass",
    "constant_force": "half the difference of F_cn and F_cp: unequal friction or a constant force",
    "backlash": "backlash",
    "explained": "force explained",
    "along_travel": "variation along travel",
}

Light = Literal["green", "yellow", "red", ""]


@dataclass(frozen=True)
class Allowed:
    """Lowest and highest value, in SI, and where they come from; logs: how many of the machine's,
    mean and sd of these."""

    low: float
    high: float
    source: Literal["card", "registry", "usual"]
    logs: int = 0
    mean: float | None = None
    sd: float | None = None


def own_limits(values: Array, least: float = 0.0) -> Allowed | None:
    """Limits by the values of earlier logs (n,), no nearer to their mean than `least`; None of too
    few.

    The mean +- 3 sd of many logs; of few wider, so that as many good logs lie within (Student's t
    of a further value), and never nearer than 2 % of the mean.
    """
    n = len(values)
    if n < FEWEST_EARLIER:
        return None
    mean, sd = float(np.mean(values)), float(np.std(values, ddof=1))
    wide = float(stdtrit(n - 1, ndtr(HISTORY_SIGMAS))) * (1.0 + 1.0 / n) ** 0.5
    room = max(wide * sd, LEAST_ROOM * abs(mean), least)
    return Allowed(mean - room, mean + room, "registry", n, mean, sd)


def limits_of(values: Mapping[str, Sequence[float]]) -> dict[str, Allowed]:
    """The machine's own limits by the values of its last logs, by quantity: mean +- 3 sd."""
    found = {}
    coulomb = [value for name in ("F_cp", "F_cn") for value in values.get(name, ())]
    for name, every in values.items():
        past, least = np.array(every), 0.0
        if name == "constant_force" and coulomb:  # may be nought: a share of friction counts
            least = LEAST_ROOM * float(np.mean(coulomb))
        elif name in ("F_sp", "F_sn"):
            least = BREAKAWAY_ROOM * float(np.mean(past))
        one = own_limits(past, least)
        if one is not None:
            found[name] = one
    return found


def light_of(value: float, low: float, high: float, allowed: Allowed) -> Light:
    """Red where the whole interval from low to high lies beyond a limit, yellow where a part of it
    does; never red beyond a usual limit, which is not the machine's."""
    if allowed.source != "usual" and (low > allowed.high or high < allowed.low):
        return "red"
    inside = allowed.low <= min(value, low) and max(value, high) <= allowed.high
    return "green" if inside else "yellow"
