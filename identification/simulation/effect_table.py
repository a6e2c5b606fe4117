"""Chosen effects as tables for the kernels, and how finely a sample is cut with them."""

import math
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array, IntArray
from identification.effects._base import MAX_PARAMS, MAX_SIGNALS, Acting
from identification.errors import BadLog, BadModel
from identification.log import Log

(
    ON_SLIP, ON_STICTION, ON_FRICTION, ON_BRISTLE, ON_FORCE, ON_ACTUATOR, ON_COMMAND, ON_DELAY,
    ON_SENSOR,
) = range(9)  # fmt: skip
CODES = dict(
    zip(
        ("slip", "stiction", "friction", "bristle", "force", "actuator", "command", "delay",
         "sensor"),
        range(9), strict=True,
    )
)  # fmt: skip
OUTSIDE_CODES = (ON_COMMAND, ON_DELAY, ON_SENSOR)
LONGEST_STEP = 1e-3  # s, sub-step of effects without memory
LONGEST_STATE = 2.5e-4  # s, of those with a state, in which a switch counts with its sub-step
LONGEST_BRISTLE = 2e-4  # s
VALUE, EVOLVE, INITIAL = range(3)


@dataclass(frozen=True, eq=False)
class EffectTable:
    """Chosen effects as the kernels take them: codes (k,), addresses (k, 3), parameters (k, P)."""

    codes: IntArray
    addresses: IntArray
    p: Array

    def longest(self, bristle: float) -> float:
        """Longest sub-step [s]; bristle: of a plant with one."""
        if np.any(self.codes == ON_BRISTLE):
            return bristle
        states = (self.addresses[:, EVOLVE] != 0) & ~np.isin(self.codes, OUTSIDE_CODES)
        return LONGEST_STATE if np.any(states) else LONGEST_STEP


def effect_table(acting: tuple[Acting, ...]) -> EffectTable:
    """The table of these effects; raises BadModel where two of them replace sticking."""
    codes = np.array([CODES[a.effect.acts] for a in acting], dtype=np.int64)
    for code, what in ((ON_BRISTLE, "replaces sticking"), (ON_DELAY, "delays the command")):
        if np.count_nonzero(codes == code) > 1:
            raise BadModel(f"more than one effect {what}: a plant takes one")
    addresses = np.array([a.effect.addresses for a in acting], dtype=np.int64).reshape(-1, 3)
    p = np.array([a.array for a in acting]).reshape(-1, MAX_PARAMS)
    return EffectTable(codes, addresses, p)


def signal_table(acting: tuple[Acting, ...], log: Log) -> Array:
    """Signals of each effect along the log, (k, n, MAX_SIGNALS); those it may miss read as 0.

    Raises BadLog where the log lacks one that an effect needs.
    """
    out = np.zeros((len(acting), len(log), MAX_SIGNALS))
    for i, a in enumerate(acting):
        if a.effect.signals and not any(name in log for name in a.effect.signals):
            raise BadLog(
                f"{log.name}: the effect {a.key!r} needs a signal {' or '.join(a.effect.signals)};"
                " name its column in the card"
            )
        for j, name in enumerate(a.effect.signals):
            if name in log or name in a.effect.needs:
                out[i, :, j] = log[name]
    return out


def outside(codes: IntArray) -> bool:
    """Whether the effects change only what reaches the actuator and what the transducer shows."""
    return bool(np.all(np.isin(codes, OUTSIDE_CODES)))


def pieces(table: EffectTable, h: float, bristle: float = LONGEST_BRISTLE) -> int:
    """Number of sub-steps in a sample of `h` [s]; bristle: longest of a plant with one [s]."""
    return max(1, math.ceil(h / table.longest(bristle) - 1e-9))


def fewer(table: EffectTable, count: int, bristle: float = LONGEST_BRISTLE) -> int:
    """Of `count` sub-steps, those that a sample without a switch needs; a bristle never rests."""
    if np.all(np.isin(table.codes, (ON_STICTION, *OUTSIDE_CODES))):
        return 1  # it slides as the plain plant does
    states = (table.addresses[:, EVOLVE] != 0) & ~np.isin(
        table.codes, (ON_STICTION, *OUTSIDE_CODES)
    )
    longest = LONGEST_STATE if np.any(states) else LONGEST_STEP
    short = min(table.longest(bristle) / longest, 1.0)
    return count if np.any(table.codes == ON_BRISTLE) else max(1, math.ceil(count * short - 1e-9))
