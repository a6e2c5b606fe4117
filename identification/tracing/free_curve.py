"""What a named effect stands for, as a free curve of its own signal beside its law."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.arrays import Array
from identification.estimation.regression.equation_rows import ACTUATOR, MECHANICAL
from identification.tracing.regression.candidates import EffectCandidate
from identification.tracing.regression.stepwise import Choice
from identification.tracing.residuals import signals_at
from identification.tracing.result import FreeCurve

CURVE_PIECES = 40  # of the curve, with equally many rows each
CURVE_ROWS = 8  # at least


def free_curves(choice: Choice) -> tuple[FreeCurve, ...]:
    """A curve of each effect that the equations hold as a sum of columns, where one of its signals
    is logged; the other parameters are those found with the effect."""
    found = (_curve_of(step.candidate, choice) for step in choice.steps)
    return tuple(one for one in found if one is not None)


def _curve_of(candidate: EffectCandidate, choice: Choice) -> FreeCurve | None:
    effect, period = candidate.effect, candidate.values.get(candidate.effect.named("period") or "")
    for equation in (MECHANICAL, ACTUATOR):
        if equation not in choice.base:
            continue
        o = choice.base[equation]
        own = [i for i, name in enumerate(o.rows.names) if name.split(".")[0] == effect.key]
        signals = signals_at(choice.end, equation)
        names = [name for name in effect.depends_on if name in signals]
        keep = o.rows.speed >= o.slowest
        if not own or not names or np.count_nonzero(keep) < 2 * CURVE_ROWS:
            continue
        way = np.sign(signals["v"]) if not effect.place.sign else effect.place.sign
        law = (way * (o.rows.X[:, own] @ o.fit.theta[own]))[keep]
        left = (way * o.fit.residual * o.rows.sd)[keep]
        curves = [_against(effect.key, equation, n, signals[n][keep], left, law) for n in names]
        if period and "y" in names:
            y = signals["y"][keep] % period
            curves.append(replace(_against(effect.key, equation, "y", y, left, law), period=period))
        return max(curves, key=lambda one: float(np.var(one.law)))  # which shows most of the law
    return None


def _against(key: str, equation: str, name: str, x: Array, left: Array, law: Array) -> FreeCurve:
    count = int(np.clip(len(x) // CURVE_ROWS, 2, CURVE_PIECES))
    pieces: Sequence[Array] = np.array_split(np.argsort(x, kind="stable"), count)
    free = [(left + law)[piece] for piece in pieces]
    return FreeCurve(
        key, equation, name,
        at=np.array([np.mean(x[piece]) for piece in pieces]),
        free=np.array([np.mean(one) for one in free]),
        sd=np.array([np.std(left[piece]) / np.sqrt(len(piece)) for piece in pieces]),
        law=np.array([np.mean(law[piece]) for piece in pieces]),
    )  # fmt: skip
