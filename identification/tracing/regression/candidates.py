"""Every effect of the library as a rival: its best parameters, and what it gains.

An effect is linear in some of its parameters and not in others. For given others its columns join
those of the plain model and all are solved together (variable projection), in every equation in
which the effect shows; the others are searched on a grid, then refined.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from scipy.optimize import minimize

from identification.arrays import Array
from identification.effects._base import Effect, Param
from identification.estimation.regression.effect_columns import (
    Values,
    admissible,
    equations_of,
    needs_rounds,
    shape_params,
)
from identification.estimation.regression.effect_rows import EffectRows, with_effect
from identification.estimation.regression.equation_rows import MECHANICAL
from identification.estimation.regression.row_fit import RowFit, row_fit, with_sizes
from identification.estimation.regression.weighted_rows import stacked
from identification.thresholds import PENALTY
from identification.tracing.regression.shape_grid import shape_grid

REFINED = 30  # evaluations of the refinement for each parameter
SUBSTITUTIONS = 4  # of substitution where a contribution depends on the friction itself
OUT_OF_BOUNDS = 1e12  # criterion of parameters outside their bounds


@dataclass(frozen=True, eq=False)
class EffectCandidate:
    """An effect at its best: its parameters, and every equation that it changes."""

    effect: Effect
    values: dict[str, float]
    outcomes: Mapping[str, RowFit]
    gain: float


def trial(
    stage: EffectRows, effect: Effect, shape: Values, shown_in: Sequence[str]
) -> tuple[float, dict[str, RowFit]]:
    """Criterion over the equations `shown_in` with the effect at this shape, and their outcomes.

    Source: sizes solved within, variable projection, Golub, Pereyra, SIAM J. Numer. Anal. 10 (1973)
    413.
    """
    stage.logs[0].halt.ask()
    found = {}
    for equation in shown_in:
        parts = [
            with_effect(stage, equation, effect, shape, i, rows)
            for i, rows in enumerate(stage.parts[equation])
        ]
        found[equation] = row_fit(stage, equation, stacked(parts))
    return sum(x.criterion for x in found.values()), found


@dataclass(frozen=True, eq=False)
class FirstShape:
    """An effect at the best of the shapes to begin with: the equations it shows in, where it may be
    refined, the shape and what it gains there."""

    stage: EffectRows
    effect: Effect
    base: Mapping[str, RowFit]
    shown_in: tuple[str, ...]
    bounds: tuple[tuple[float, float], ...]
    shape: Values
    gain: float = 0.0

    @property
    def by_rounds(self) -> bool:
        """Whether what it does depends on the friction itself, so that this is hardly informative
        yet."""
        return needs_rounds(self.effect)

    def score(self, shape: Values) -> float:
        """Criterion with the effect at a shape."""
        total, found = trial(self.stage, self.effect, shape, self.shown_in)
        fair = self.by_rounds or admissible(self.effect, with_sizes(self.effect, shape, found))
        return total if fair else OUT_OF_BOUNDS

    def candidate(self, shape: Values) -> EffectCandidate | None:
        """The effect at a shape; None where its sizes are none that it may have."""
        total, found = trial(self.stage, self.effect, shape, self.shown_in)
        values = with_sizes(self.effect, shape, found)
        if not admissible(self.effect, values):
            return None
        return EffectCandidate(self.effect, values, found, float(self.without - total))

    @property
    def without(self) -> float:
        """Criterion without the effect."""
        return sum(self.base[e].criterion for e in self.shown_in)


def first_shape(stage: EffectRows, effect: Effect, base: Mapping[str, RowFit]) -> FirstShape | None:
    """The effect at the best shape of a grid; None where it cannot show.

    Source: variable projection, Golub, Pereyra (1973).
    """
    shown_in = tuple(e for e in equations_of(effect, stage.by_command, stage.by_motor) if e in base)
    if not shown_in or any(name not in one.signals for one in stage.logs for name in effect.needs):
        return None
    if effect.signals and not any(
        name in one.signals for one in stage.logs for name in effect.signals
    ):
        return None
    free = shape_params(effect)
    grids = [shape_grid(effect, p, stage.logs) for p in free]
    bounds = tuple(bounds_of(p, g) for p, g in zip(free, grids, strict=True))
    names = [p.name for p in free]
    starts = [dict(zip(names, map(float, x), strict=True)) for x in product(*grids)]
    begun = FirstShape(stage, effect, base, shown_in, bounds, starts[0])
    least, best = min(((begun.score(x), x) for x in starts), key=lambda one: one[0])
    return replace(begun, shape=best, gain=float(begun.without - least))


def refined(start: FirstShape) -> EffectCandidate | None:
    """The effect at its best; None where it cannot stand.

    Source: variable projection, Golub, Pereyra (1973); the shape by Nelder, Mead (1965).
    """
    free = shape_params(start.effect)
    defaults = {p.name: p.default for p in free if p.optional and p.default is not None}
    best = shaped(free, start.bounds, start.shape, start.score)
    half = best | {p.name: 0.5 * best[p.name] for p in free if p.role == "period"}
    if half != best and start.score(half) < start.score(best) + 2.0 * PENALTY:
        best = half  # a harmonic takes all of it but what the two sizes of the wave gain by chance
    for i in range(SUBSTITUTIONS if start.by_rounds else 0):
        found = trial(start.stage, start.effect, best, start.shown_in)[1]
        five = found[MECHANICAL].fit.theta[:5] if MECHANICAL in found else start.stage.theta
        start = replace(start, stage=replace(start.stage, theta_f=five))
        if i == 0:  # the plain friction's levels had bent its shape
            best = shaped(free, start.bounds, best | defaults, start.score)
    return start.candidate(best)


def shaped(
    free: Sequence[Param], bounds: Sequence[tuple[float, float]], shape: Values,
    score: Callable[[Values], float],
) -> dict[str, float]:  # fmt: skip
    """Shape parameters at their best; optional ones stay where they are unless it gains enough.

    Source: Nelder, Mead (1965); the rule of optional ones is ours.
    """
    best = dict(shape)
    needed = [i for i, p in enumerate(free) if not p.optional]
    if needed:
        best = refined_shape([free[i] for i in needed], [bounds[i] for i in needed], best, score)
    if len(needed) < len(free):
        other = refined_shape(free, bounds, best, score)
        if score(other) < score(best) - PENALTY * (len(free) - len(needed)):
            best = other
    return best


def bounds_of(p: Param, tried: Array) -> tuple[float, float]:
    """Where a parameter is refined: between the first values tried, one with a default anywhere,
    unless it is known or bends a scale."""
    if p.default is not None and p.role not in ("known", "bend"):
        return p.low, p.high
    return float(np.min(tried)), float(np.max(tried))


def refined_shape(
    free: Sequence[Param], bounds: Sequence[tuple[float, float]], shape: Values,
    score: Callable[[Values], float],
) -> dict[str, float]:  # fmt: skip
    """These parameters of the shape at the nearest minimum of `score`, within bounds.

    Source: Nelder, Mead, Computer Journal 7 (1965) 308.
    """
    start = np.array([shape[p.name] for p in free])
    unit = np.where(start != 0, np.abs(start), 1.0)
    low, high = np.array(bounds).T

    def at(x: Array) -> dict[str, float]:
        inside = np.clip(x * unit, low, high)
        return {**shape, **dict(zip((p.name for p in free), inside.tolist(), strict=True))}

    first = start / unit
    step = np.array([0.02 if p.role == "period" else 0.15 for p in free])
    step = np.where(first + step > high / unit, -step, step)
    simplex = np.vstack([first, first + np.diag(step)])
    options: Any = {"maxfev": REFINED * len(free), "fatol": 0.1, "xatol": 1e-4}
    options["initial_simplex"] = simplex
    search: Any = minimize
    found = search(lambda x: score(at(x)), first, method="Nelder-Mead", options=options)
    return at(found.x)
