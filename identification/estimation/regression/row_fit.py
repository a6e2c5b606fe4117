"""Rows of an equation solved for their sizes, and the criterion that compares structures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array, IntArray
from identification.effects._base import Effect
from identification.estimation.regression.effect_columns import Values, in_columns
from identification.estimation.regression.effect_rows import EffectRows
from identification.estimation.regression.equation_rows import (
    ACTUATOR,
    BREAKAWAY,
    EQUATIONS,
    MECHANICAL,
    NOTHING_KNOWN,
    REST,
    MotionLog,
)
from identification.estimation.regression.weighted_rows import (
    Fitted,
    Rows,
    of_column,
    robust,
    solve_rows,
    stacked,
)
from identification.thresholds import HOPELESS

TRIM = 4.0  # what a row counts that is left out for its low speed
TRIMS = (0.0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4)  # shares of the rows that may be left out
FEWEST_EVENTS = 6
ROBUST_SQUARE = 9.0  # square from which a row of rest counts less


@dataclass(frozen=True, eq=False)
class RowFit:
    """Rows, fit, criterion (in units of the scale) and lowest speed of one equation.

    robust: rows far off count less.
    """

    rows: Rows
    fit: Fitted
    criterion: float
    slowest: float
    robust: bool = False


def row_fit(stage: EffectRows, equation: str, rows: Rows) -> RowFit:
    """Fit and criterion of an equation's rows.

    Within the band the model's slip friction does not hold. Rows slower than a threshold count
    TRIM each instead of their squared residual; the best threshold is taken, none above the band
    where that is known. Under prescribed motion it slides at any speed. Sources: Cauchy's function,
    Holland, Welsch, Commun. Stat. A 6 (1977) 813; the trimming is ours: `README.md`, (10), (11).
    """
    scale = stage.scale(equation)
    if equation == REST:
        r = rows.b / rows.sd
        return RowFit(
            rows, Fitted(np.zeros(0), r, float(np.sum(r**2))), _robust(r, scale), 0.0, True
        )
    if equation == BREAKAWAY:
        theta = solve_rows(robust(rows)).theta
        r = (rows.b - rows.X @ theta) / rows.sd
        return RowFit(rows, Fitted(theta, r, float(np.sum(r**2))), _robust(r, scale), 0.0, True)
    if not np.any(np.isfinite(rows.speed)):
        fit = solve_rows(rows)
        return RowFit(rows, fit, fit.cost / scale + rows.lost, 0.0)
    edges = np.quantile(rows.speed, TRIMS[:1] if stage.prescribed else TRIMS)
    if stage.band > 0.0:  # above it the body slides, whatever would be left out better
        edges = np.unique([edges[0], *edges[edges < stage.band], max(stage.band, edges[0])])
    A = np.column_stack([rows.X, rows.b]) / rows.sd[:, np.newaxis]
    size = of_column(A)
    whitened = A / size
    bins = np.digitize(rows.speed, edges[1:])
    ordered = whitened[np.argsort(bins, kind="stable")]
    ends = np.cumsum(np.bincount(bins, minlength=len(edges)))
    parts = np.split(ordered, ends[:-1])
    grams = np.cumsum([part.T @ part for part in parts[::-1]], axis=0)[::-1]
    own = np.flatnonzero([name in rows.positive for name in rows.names])
    thetas, left = _of_grams(grams, own)
    slower = np.concatenate([[0], ends[:-1]])
    totals = left * size[-1] ** 2 / scale + TRIM * slower + rows.lost
    best = int(np.argmin(totals))
    total, theta = totals[best], thetas[best] * size[-1] / size[:-1]
    residual = A[:, -1] - A[:, :-1] @ theta
    fit = Fitted(theta, residual, float(np.sum(residual[bins >= best] ** 2)))
    return RowFit(rows, fit, float(total), 0.0 if stage.prescribed else float(edges[best]))


def _robust(r: Array, scale: float) -> float:
    """Criterion of rows of which some are no rest at all: Cauchy's, near r^2 for small r."""
    return float(np.sum(ROBUST_SQUARE * np.log1p(r**2 / (scale * ROBUST_SQUARE))))


def _of_grams(grams: Array, positive: IntArray) -> tuple[Array, Array]:
    """Least squares (g, k) and the square sums (g,) left, from Gram matrices of [X b]."""
    A, c = grams[:, :-1, :-1], grams[:, :-1, -1]
    theta = np.einsum("gij,gj->gi", np.linalg.pinv(A, rcond=1e-12, hermitian=True), c)
    for i in np.flatnonzero(np.any(theta[:, positive] < 0.0, axis=1)):
        theta[i] = _not_negative(A[i], c[i], positive)
    bent = np.einsum("gij,gj->gi", A, theta)
    left = grams[:, -1, -1] + np.einsum("gi,gi->g", theta, bent - 2.0 * c)
    return theta, np.maximum(left, 0.0)


def _not_negative(A: Array, c: Array, positive: IntArray) -> Array:
    """Least squares (k,) of A theta = c, those in `positive` not below 0: whatever comes out
    negative is 0, and the rest solved again."""
    at = np.arange(len(c))
    while True:
        theta = np.zeros(len(c))
        theta[at] = np.linalg.lstsq(A[np.ix_(at, at)], c[at], rcond=1e-12)[0]
        below = positive[theta[positive] < 0.0]
        if not len(below):
            return theta
        at = np.setdiff1d(at, below)


def has_rows(stage: EffectRows, equation: str) -> bool:
    """Whether the logs have enough rows of an equation."""
    rows = sum(len(part.b) for part in stage.parts[equation])
    least = FEWEST_EVENTS if equation == BREAKAWAY else 2 * (6 if equation == REST else 12)
    finite = all(np.all(np.isfinite(part.sd)) for part in stage.parts[equation] if len(part.b))
    return rows >= least and finite


def base_fits(stage: EffectRows, equations: Sequence[str] = EQUATIONS) -> dict[str, RowFit]:
    """Each of these equations of which the logs have enough rows, with the structure found so
    far."""
    return {
        equation: row_fit(stage, equation, stacked(stage.parts[equation]))
        for equation in equations
        if (equation != ACTUATOR or stage.by_command) and has_rows(stage, equation)
    }


def converged_fits(
    stage: EffectRows, equations: Sequence[str] = EQUATIONS
) -> tuple[EffectRows, dict[str, RowFit]]:
    """The stage with its parameters fitted (rows' noise depends on them), and the outcomes of these
    equations.

    Source: iterated weighted least squares (Aitken 1936).
    """
    for _ in range(2):
        found = base_fits(stage, (MECHANICAL, ACTUATOR))
        theta = found[MECHANICAL].fit.theta[:5] if MECHANICAL in found else stage.theta
        theta_a = found[ACTUATOR].fit.theta[:3] if ACTUATOR in found else stage.theta_a
        stage = replace(stage, theta=theta, theta_a=theta_a)
    return stage, base_fits(stage, equations)


def first_stage(
    logs: Sequence[MotionLog], by_command: bool, equations: Sequence[str] = EQUATIONS
) -> tuple[EffectRows, dict[str, RowFit]]:
    """The model without effects, and the outcomes of these equations."""
    first = NOTHING_KNOWN, np.array([0.0, 0.0, 0.0])
    return converged_fits(EffectRows(tuple(logs), *first, by_command), equations)


def mean_square(o: RowFit) -> float:
    """Mean square of the rows that count."""
    kept = o.fit.residual[o.rows.speed >= o.slowest]
    if o.robust:
        return float(np.median(kept**2)) / 0.455  # of a chi-square with one degree
    return float(np.mean(kept**2)) if len(kept) else 1.0


def rms(r: Array) -> float:
    """Root mean square; 0 of nothing."""
    return float(np.sqrt(np.mean(r**2))) if len(r) else 0.0


def rough(base: Mapping[str, RowFit]) -> bool:
    """Whether far more than the sensors' noise is left when nothing more is found."""
    return any(mean_square(base[e]) > HOPELESS for e in (MECHANICAL, ACTUATOR) if e in base)


def with_sizes(effect: Effect, shape: Values, found: Mapping[str, RowFit]) -> dict[str, float]:
    """All parameters: shape, and the linear ones found; two directions as mean and asymmetry. One
    that no equation has stays as shape gives it, as of breakaways in a log without any."""
    values = {p.name: p.default for p in effect.params if p.default is not None} | dict(shape)
    if not in_columns(effect):
        return values
    sizes: dict[str, float] = {}
    for one in reversed(list(found.values())):
        sizes |= dict(zip(one.rows.names, one.fit.theta.tolist(), strict=True))
    for name in effect.linear:
        full = f"{effect.key}.{name}"
        if f"{full}+" in sizes:
            plus, minus = sizes[f"{full}+"], sizes[f"{full}-"]
            values[name] = 0.5 * (plus + minus)
            values["asymmetry"] = 0.5 * (plus - minus) / values[name] if values[name] else 0.0
        elif full in sizes or name not in values:
            values[name] = sizes[full]
    return values
