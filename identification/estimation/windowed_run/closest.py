"""The plant searched in turns, from afar on short logs, then closer on the whole, and refined."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from identification.estimation.regression.equation_rows import MotionLog, shortened
from identification.estimation.windowed_run.nudged_search import (
    BAND_RANGE,
    CLOSE_RANGE,
    FAR_RANGE,
    Range,
    nudged_search,
)
from identification.estimation.windowed_run.parameters import even, on_bristle
from identification.estimation.windowed_run.refinement import Refit, onward, refit
from identification.estimation.windowed_run.stick_search import start_band
from identification.model.estimates import Drive
from identification.model.plant import Plant
from identification.progress import Halted
from identification.thresholds import ADEQUATE, COMPLETE

DOUBLE = 2.0  # times the slowest significant sliding, up to which a band is tried
SHORT_SECONDS = 15.0  # s of each log on which a search from afar is made
SEARCHES, SEARCH_GAIN = 3, 0.8  # close by at most, each to leave this share of the misfit before
PROMISING_MISFIT, POOR = (
    3.0,
    2,
)  # misfit on the short logs, of effects worth a search; so many more at most
SAME_PLACE = 1.1  # relative misfit of two searches that have ended in the same place
MIDDLE = 30.0  # s, those of a plant with effects, whose runs take longer, searched close by


@dataclass(frozen=True)
class SearchLimits:
    """How long a plant is searched.

    most: searches on the whole logs, none where no search will do; identified: the first plant has
    everything but its band from the equations, so it is searched close by before; known: by name,
    how far the equations leave a parameter open.
    """

    most: int = SEARCHES
    identified: bool = False
    known: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))


USUAL_LIMITS = SearchLimits()


def closest(
    begins: Sequence[Plant], logs: Sequence[MotionLog], drive: Drive, rng: np.random.Generator,
    limits: SearchLimits = USUAL_LIMITS, done: Refit | None = None,
) -> Refit:  # fmt: skip
    """The plant searched on short logs from afar, and closer (`closer`) on the whole.

    begins: plants to begin from in turn, as long as more is left than should be; done: found
    already, and beside the searches one that may be agreed with. Sources: added damping, Abarbanel
    et al. (2009); differential evolution, Storn, Price (1997); the order is ours.
    """
    short = [shortened(one, SHORT_SECONDS) for one in logs]
    best, poor = done, 0
    around = replace(CLOSE_RANGE, known=limits.known)
    try:
        for i, plant in enumerate([*begins[: int(limits.identified)], *begins]):
            if limits.identified and i == 0:
                banded = start_band(plant, short, drive, DOUBLE * plant.friction.dv_p)
                near = nudged_search(
                    banded, short, drive, rng, ((0.0, BAND_RANGE), (0.0, CLOSE_RANGE))
                )
            else:
                stages = ((1.0, replace(FAR_RANGE, known=limits.known)), (0.0, around))
                near = nudged_search(plant, short, drive, rng, stages)
            begun = refit(near, short, drive, prior=even(near), effort="quick")
            hopes = not plant.effects or begun.misfit <= PROMISING_MISFIT
            worth = limits.most if hopes else min(limits.most, 1)
            found = _on_whole(begun, logs, drive, rng, worth, around, best)
            twice = agree(best, found)
            best = found if best is None or found.misfit < best.misfit else best
            poor += not hopes
            if best.misfit <= (ADEQUATE if plant.effects else COMPLETE) or twice or poor == POOR:
                break
    except Halted:
        if best is None:
            raise
    assert best is not None
    return best


def agree(one: Refit | None, other: Refit | None) -> bool:
    """Whether two searches have ended in the same place."""
    if one is None or other is None:
        return False
    return one.misfit < SAME_PLACE * other.misfit < SAME_PLACE**2 * one.misfit


def _on_whole(
    begun: Refit, logs: Sequence[MotionLog], drive: Drive, rng: np.random.Generator, searches: int,
    around: Range, done: Refit | None,
) -> Refit:  # fmt: skip
    """What was found on short logs, refined on the whole; searched closer where it falls short."""
    plant = begun.plant
    if searches > 0 and begun.misfit > (ADEQUATE if plant.effects else COMPLETE):
        return closer(plant, logs, drive, rng, searches, around, done=done)
    found = refit(plant, logs, drive, prior=even(plant), effort="near")
    if searches == 0 or found.misfit <= (ADEQUATE if on_bristle(plant) else COMPLETE):
        return found
    again = closer(plant, logs, drive, rng, searches, around, done=done)
    return again if again.misfit < found.misfit else found


def closer(
    plant: Plant, logs: Sequence[MotionLog], drive: Drive, rng: np.random.Generator,
    searches: int = SEARCHES, around: Range = CLOSE_RANGE,
    done: Refit | None = None,
) -> Refit:  # fmt: skip
    """The plant refined, then searched close by and refined again, so many times at most, as long
    as that helps.

    done: found from elsewhere, with which one that agrees is the last. Ours.
    """
    part = [shortened(one, MIDDLE) for one in logs] if plant.effects else logs
    slow = on_bristle(plant)
    enough = ADEQUATE if slow else COMPLETE
    best = None if slow else onward(plant, logs, drive)
    try:
        for _ in range(searches):
            if best is not None and best.misfit <= enough:
                break
            if agree(done, best):
                break
            plant = plant if best is None else best.plant
            near = nudged_search(plant, part, drive, rng, ((0.0, around),))
            if slow:
                found = refit(near, logs, drive, prior=even(near), effort="near")
            else:
                found = onward(near, logs, drive)
            gained = best is None or found.misfit < SEARCH_GAIN * best.misfit
            best = found if best is None or found.misfit < best.misfit else best
            if not gained:
                break
    except Halted:
        if best is None:
            raise
    assert best is not None
    return best
