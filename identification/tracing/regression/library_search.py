"""Every effect of the library beside what was found, each at its best."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from identification.effects._library import Library
from identification.estimation.regression.effect_columns import slow_motion
from identification.estimation.regression.effect_rows import EffectRows
from identification.estimation.regression.equation_rows import MECHANICAL
from identification.estimation.regression.row_fit import RowFit, base_fits, mean_square
from identification.thresholds import ADEQUATE, HOPELESS
from identification.tracing.regression.candidates import (
    EffectCandidate,
    FirstShape,
    first_shape,
    refined,
)

ABSORBED = frozenset({"constant_force"})  # by unequal F_cp and F_cn, F_sp and F_sn
IN_SIGHT = 0.1  # of what the best shape of any effect's grid gains, from which a shape is refined


def at_own_scale(
    stage: EffectRows, base: Mapping[str, RowFit], library: Library, report: Callable[[float], None]
) -> list[EffectCandidate]:
    """Every effect of the library, those of slow motion at the scale at which all are compared.

    Where more than the sensors' noise is left whatever is added, at noise alone every row of
    sliding would cost more than one left out for its low speed, and an effect of slow motion be
    left out with them. Ours: `../README.md`, (1).
    """
    found = all_candidates(stage, base, library, lambda part: report(0.5 * part))
    scaled = of_sliding(stage, scales_of(found, base).get(MECHANICAL, 1.0))
    if 1.0 / ADEQUATE <= scaled.scale(MECHANICAL) / stage.scale(MECHANICAL) <= ADEQUATE:
        return found
    slow = {key: effect for key, effect in library.items() if slow_motion(effect)}
    again = all_candidates(scaled, base_fits(scaled), slow, lambda part: report(0.5 + 0.5 * part))
    known = {one.effect.key for one in again}
    return [*again, *(one for one in found if one.effect.key not in known)]


def all_candidates(
    stage: EffectRows, base: Mapping[str, RowFit], library: Library, report: Callable[[float], None]
) -> list[EffectCandidate]:
    """Every effect of the library that is not in the stage yet, beside it: at its best, or as it
    begins where that is far behind another's begin."""
    taken = {effect.key for effect, _ in stage.chosen} | set(stage.taken)
    keys = [k for k in library if k not in taken and k not in ABSORBED]
    with ThreadPoolExecutor(2) as pool:
        starts = []
        for i, start in enumerate(
            pool.map(lambda key: first_shape(stage, library[key], base), keys)
        ):
            starts += [] if start is None else [start]
            report(0.5 * (i + 1) / len(keys))
        least = IN_SIGHT * max((start.gain for start in starts), default=0.0)

        def done(start: FirstShape) -> EffectCandidate | None:
            near = start.by_rounds or start.gain >= least
            return refined(start) if near else start.candidate(start.shape)

        found: list[EffectCandidate] = []
        for i, candidate in enumerate(pool.map(done, starts)):
            found += [] if candidate is None else [candidate]
            report(0.5 + 0.5 * (i + 1) / len(starts))
    return found


def scales_of(found: Sequence[EffectCandidate], base: Mapping[str, RowFit]) -> dict[str, float]:
    """Square that the best candidate leaves in each equation, 1 at least: what is noise to all."""
    out = {}
    for equation, o in base.items():
        options = [c.outcomes[equation] for c in found if equation in c.outcomes] + [o]
        out[equation] = max(1.0, min(mean_square(x) for x in options))
    return out


def of_sliding(stage: EffectRows, scale: float) -> EffectRows:
    """The stage, its rows of sliding judged by what is noise to the effects [noise units]; what is
    far beyond noise is none, but something that is missing."""
    return replace(stage, scales={MECHANICAL: scale if scale <= HOPELESS else 1.0})
