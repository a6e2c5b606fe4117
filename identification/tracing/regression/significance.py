"""Chance that some effect of a whole library gains as much where none is missing."""

from collections.abc import Mapping, Sequence

import numpy as np

from identification.arrays import Array
from identification.estimation.regression.effect_rows import EffectRows
from identification.estimation.regression.row_fit import RowFit
from identification.thresholds import CHANCE_LEVEL, TWICE
from identification.tracing.regression.candidates import EffectCandidate

DRAWS = 200  # of the null hypothesis


def chance(
    best: EffectCandidate,
    rivals: Sequence[EffectCandidate],
    stage: EffectRows,
    base: Mapping[str, RowFit],
    rng: np.random.Generator,
) -> float:
    """Chance that some effect of the library gains as much where none is missing.

    The model without the effect is given the residual that the best candidate leaves, its signs
    drawn anew by stretches of time, which preserves its colour; the largest gain of any candidate's
    columns in any draw is compared. Sources: wild bootstrap, Wu, Annals of Statistics 14 (1986)
    1261, Liu, Annals of Statistics 16 (1988) 1696; largest of a family, Westfall, Young,
    Resampling-Based Multiple Testing (1993). `README.md` of `tracing`, (3).
    """
    largest = np.zeros(DRAWS)
    for equation in best.outcomes:
        o, kept = best.outcomes[equation], base[equation]
        n = len(o.rows.b)
        stretch = np.minimum(
            np.arange(n) * max(8, n // 25) // n if n >= 50 else np.arange(n), n - 1
        )
        signs = rng.choice([-1.0, 1.0], size=(int(stretch.max()) + 1, DRAWS))[stretch]
        residual, limit = o.fit.residual, 3.0 * np.sqrt(stage.scale(equation))
        if o.robust:
            residual = np.clip(residual, -limit, limit)
        noise = residual[:, np.newaxis] * signs
        heavy = o.rows.speed >= o.slowest
        noise = noise * heavy[:, np.newaxis]
        A = kept.rows.X / kept.rows.sd[:, np.newaxis] * heavy[:, np.newaxis]
        Q = np.linalg.qr(A)[0] if A.shape[1] else np.zeros((n, 0))
        noise = noise - Q @ (Q.T @ noise)
        gains = np.zeros(DRAWS)
        for c in (best, *rivals):
            if equation not in c.outcomes:
                continue
            own = effect_directions(c.outcomes[equation], kept) * heavy[:, np.newaxis]
            if o.robust:
                own = np.clip(own, -limit, limit)
            own = own - Q @ (Q.T @ own)
            P = np.linalg.qr(own)[0]
            gains = np.maximum(gains, np.sum((P.T @ noise) ** 2, axis=0))
        largest += gains / stage.scale(equation)
    return float((1 + np.sum(TWICE * largest >= best.gain)) / (DRAWS + 1))


def is_chance(p_value: float) -> bool:
    """Whether a gain of this probability where no effect is missing may be chance."""
    return p_value > CHANCE_LEVEL


def effect_directions(o: RowFit, base: RowFit) -> Array:
    """Whitened columns (r, k) by which an effect moves the rows."""
    more = o.rows.X[:, base.rows.X.shape[1] :] / o.rows.sd[:, np.newaxis]
    moved = (base.fit.residual - o.fit.residual)[:, np.newaxis]
    return more if more.shape[1] else moved
