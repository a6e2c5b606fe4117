"""Whether structure is left by the plain valve: richer ones on windows that no fit has seen.

A richer structure is named only where it predicts the held-out position clearly better over 2 s,
window by window, and no worse over 0.2 s.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.stats import wilcoxon

from identification.arrays import Array
from identification.progress import KeepGoing, without_end
from identification.thresholds import ADEQUATE, CHANCE_LEVEL, WORSE
from identification.velocity.fit import ValveFit, fit, refined
from identification.velocity.model import Valve
from identification.velocity.record import AHEAD, MOST_FOLDS, SHORTLY_AHEAD, Record, folds

FEWEST_FOLDS = 2
Verdict = Literal["none", "effect", "inseparable", "unknown"]


@dataclass(frozen=True)
class Structure:
    """What a rival has beside the plain model: its numbers, where a search starts, in words."""

    adds: tuple[str, ...]
    start: Mapping[str, float]
    words: str


STRUCTURES: Mapping[str, Structure] = {
    "curved_gain": Structure(
        ("curve_p", "curve_n"), {}, "the gain changes with the size of the command"
    ),
    "lag_by_direction": Structure(("lag_other",), {}, "another lag in the negative direction"),
    "second_lag": Structure(("second_lag",), {"second_lag": 0.3}, "a second lag in series"),
    "creep": Structure(("creep",), {}, "a velocity that no command gives (leakage)"),
    "place_dependent_gain": Structure(("place",), {}, "the gain changes along the travel"),
}


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Mean square errors of the position [m²] in each held-out window, predicted over 2 s and over
    0.2 s, each (windows,)."""

    long: Array
    short: Array

    @property
    def rms(self) -> tuple[float, float]:
        """Root mean square errors [m] over 2 s and over 0.2 s."""
        return float(np.sqrt(np.mean(self.long))), float(np.sqrt(np.mean(self.short)))


@dataclass(frozen=True, eq=False)
class Rival:
    """A richer structure: what it leaves of held-out windows, the chance that it is no better.

    better: whether that is clearly less than the plain model leaves.
    """

    key: str
    left: HeldOut
    p_value: float
    better: bool


@dataclass(frozen=True, eq=False)
class Left:
    """What the plain model leaves: the verdict in the words of a trace, and the rivals.

    named: the structure that is missing, None unless the verdict is "effect"; fitted: with it, to
    all training windows; complete: what is left is noise; not_tried: rivals that time left out.
    """

    verdict: Verdict
    plain: ValveFit
    unextended: HeldOut
    rivals: tuple[Rival, ...]
    named: str | None
    fitted: ValveFit
    complete: bool
    not_tried: tuple[str, ...]


def held_out(record: Record, whole: Valve, free: Sequence[str], test: Record | None) -> HeldOut:
    """What the numbers `free` leave of windows they are not fitted to.

    test: a record that no fit has seen; without it stretches of `record` are left out in turn, and
    the fit to the rest starts at `whole`.
    """
    if test is not None:
        return HeldOut(test.squares(whole, AHEAD), test.squares(whole, SHORTLY_AHEAD))
    count = max(FEWEST_FOLDS, min(MOST_FOLDS, record.windows // 2))
    of = folds(record, count)
    long, short = np.empty(record.windows), np.empty(record.windows)
    for k in range(count):
        valve = refined(record, whole, free, of != k).valve
        long[of == k] = record.squares(valve, AHEAD)[of == k]
        short[of == k] = record.squares(valve, SHORTLY_AHEAD)[of == k]
    return HeldOut(long, short)


def clearly_better(one: Array, other: Array, tests: int = 1) -> tuple[bool, float]:
    """Whether the errors `one` [m²] of windows are clearly less than `other`'s, and the chance.

    Wilcoxon's signed ranks of the pairs, `tests` of which are made; and less by a share that
    matters. Both (windows,).
    """
    gain = other - one
    if not np.any(gain):
        return False, 1.0
    p = float(wilcoxon(gain, alternative="greater").pvalue)
    less = float(np.sqrt(np.mean(one))) < float(np.sqrt(np.mean(other))) / WORSE
    return bool(p * tests <= CHANCE_LEVEL and less), p


def is_noise(square: float, noise: float) -> bool:
    """Whether a mean square error [m²] from a measured start is the sensor's, of this noise [m]."""
    return square <= ADEQUATE * 2.0 * noise**2


def left_by_valve(
    record: Record, test: Record | None = None, *, keep_going: KeepGoing = without_end
) -> Left:
    """What the plain model of the record leaves; test: a record that no fit has seen.

    Raises NotIdentifiable where the position does not follow the command.
    """
    plain = fit(record, keep_going=keep_going)
    unextended = held_out(record, plain.valve, plain.free, test)
    placed = record.placed(plain.valve, record.travel)
    test_placed = test.placed(plain.valve, record.travel) if test else None
    rivals, fits, not_tried = list[Rival](), dict[str, ValveFit](), list[str]()
    for key, structure in STRUCTURES.items():
        if not keep_going():
            not_tried.append(key)
            continue
        free = (*plain.free, *(n for n in structure.adds if _applies(n, plain.free)))
        fits[key] = refined(placed, replace(plain.valve, **structure.start), free)
        left = held_out(placed, fits[key].valve, free, test_placed)
        better, p = clearly_better(left.long, unextended.long, len(STRUCTURES))
        rivals.append(Rival(key, left, p, better and left.rms[1] <= unextended.rms[1]))
    rivals.sort(key=lambda one: one.left.rms[0])
    noise = (test or record).noise
    able = [one for one in rivals if one.better]
    small = is_noise(float(np.mean(unextended.long)), noise)
    if not able or small:
        verdict: Verdict = "none" if small else "unknown"
        return Left(verdict, plain, unextended, tuple(rivals), None, plain, small, tuple(not_tried))
    best = able[0]
    alike = [one for one in able[1:] if not clearly_better(best.left.long, one.left.long)[0]]
    complete = is_noise(float(np.mean(best.left.long)), noise)
    if alike:
        return Left(
            "inseparable", plain, unextended, tuple(rivals), None, plain, False, tuple(not_tried)
        )
    return Left(
        "effect",
        plain,
        unextended,
        tuple(rivals),
        best.key,
        fits[best.key],
        complete,
        tuple(not_tried),
    )


def _applies(name: str, free: Sequence[str]) -> bool:
    """Whether a number of a way can be fitted: that way's gain is."""
    ways = {"curve_p": "g_p", "curve_n": "g_n", "lag_other": "g_n"}
    return name not in ways or ways[name] in free
