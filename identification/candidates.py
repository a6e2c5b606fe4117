"""Every effect of the library as a rival: its best parameters, and what it gains.

An effect is linear in some of its parameters and not in others. For given others its columns join
those of the plain model and all are solved together (variable projection), in every equation in
which the effect shows; the others are searched on a grid, then refined.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.optimize import minimize

from identification.along import contribution, elastic_displacement, elastic_share
from identification.arrays import Array, BoolArray, IntArray
from identification.effects._base import Effect, Param
from identification.evidence import (
    FRICTIONAL,
    IN_ACTUATOR,
    POSITIVE,
    Fitted,
    Moving,
    Rows,
    actuator,
    integral,
    mechanical,
    non_negative,
    solve,
    stacked,
)
from identification.grids import shape_grid
from identification.karnopp import Karnopp
from identification.rest import (
    Breakaways,
    Rest,
    breakaway_rows,
    breakaways,
    rest_rows,
    rests,
    stretches,
)

MECHANICAL, ACTUATOR, REST, BREAKAWAY = "mechanical", "actuator", "rest", "breakaway"
EQUATIONS = (MECHANICAL, ACTUATOR, REST, BREAKAWAY)
Values = Mapping[str, float]
REFINED = 30  # evaluations of the refinement for each parameter
TRIM = 4.0  # what a row counts that is left out for its low speed
TRIMS = (0.0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4)  # shares of the rows that may be left out
ROUNDS = 4  # of substitution where a contribution depends on the friction itself
FEWEST_EVENTS = 6
ROBUST = 9.0  # square from which a row of rest counts less
BLURRED = 1e3  # times the noise, of a row that says nothing
LOCKED = 0.1  # of the applied force, at least left to drive
HOPELESS = 1e3  # times the force to be explained
OUTSIDE = 1e12  # criterion of parameters outside their bounds


@dataclass(frozen=True, eq=False)
class Stage:
    """Logs and the structure found so far.

    logs: with sensor and command effects found already taken out; theta: m, F_cp, F_cn, F_vp,
    F_vn; theta_a: k1, k2, offset; chosen: effects found so far whose sizes are fitted anew with
    every candidate, at these values; taken: keys of those taken out of the logs; theta_f: in place
    of theta, for the levels that effects ask for (the rows' noise stays as theta makes it); band:
    speed [m/s] up to which friction is not that of sliding; play: a transducer's play was taken
    out, and when it is crossed is not seen;
    scales: by equation, what its rows' squares are divided by.
    """

    logs: tuple[Moving, ...]
    theta: Array
    theta_a: Array
    by_command: bool
    chosen: tuple[tuple[Effect, Values], ...] = ()
    taken: tuple[str, ...] = ()
    theta_f: Array | None = None
    band: float = 0.0
    play: bool = False
    scales: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))

    @cached_property
    def friction(self) -> Karnopp:
        """The five parameters as a model, for the levels that effects ask for; no band."""
        theta = self.theta if self.theta_f is None else self.theta_f
        m, F_cp, F_cn, F_vp, F_vn = np.maximum(theta, 1e-9).tolist()
        return Karnopp(m, F_cp, F_cn, F_vp, F_vn, 0.0, 0.0, F_cp, -F_cn)

    @cached_property
    def parts(self) -> Mapping[str, list[Rows]]:
        """Rows of each log in each equation, with the columns of the effects chosen."""
        out = {}
        for equation in EQUATIONS:
            if equation == ACTUATOR and not self.by_command:
                continue
            own = [plain(self, equation, i) for i in range(len(self.logs))]
            for effect, values in self.chosen:
                if equation in equations_of(effect, self.by_command):
                    own = [
                        joined(self, equation, effect, values, i, rows)
                        for i, rows in enumerate(own)
                    ]
            out[equation] = own
        return out

    @cached_property
    def at_rest(self) -> tuple[Rest, ...]:
        """Rows of rest of each log."""
        return tuple(rests(one) for one in self.logs)

    @cached_property
    def events(self) -> tuple[Breakaways, ...]:
        """Breakaways of each log."""
        return tuple(breakaways(one, max(float(self.theta[0]), 1e-9)) for one in self.logs)

    def scale(self, equation: str) -> float:
        """What squares of rows are divided by, 1 where nothing but noise is left."""
        return self.scales.get(equation, 1.0)


@dataclass(frozen=True, eq=False)
class Outcome:
    """Rows, fit, criterion (in units of the scale) and lowest speed of one equation.

    robust: rows far off count less.
    """

    rows: Rows
    fit: Fitted
    criterion: float
    slowest: float
    robust: bool = False


@dataclass(frozen=True, eq=False)
class Candidate:
    """An effect at its best: its parameters, and every equation that it changes."""

    effect: Effect
    values: dict[str, float]
    outcomes: Mapping[str, Outcome]
    gain: float


def equations_of(effect: Effect, by_command: bool) -> tuple[str, ...]:
    """The equations in which an effect shows."""
    if effect.acts in (*FRICTIONAL, "force"):
        return (MECHANICAL,)
    if effect.acts == "bristle":
        return (MECHANICAL, REST)
    if effect.acts == "stiction":
        return (BREAKAWAY,)
    if effect.acts in IN_ACTUATOR:
        return (ACTUATOR,) if by_command else ()
    if "F" in effect.depends_on:
        # In the actuator equation it is another k1 and k2 only.
        return (MECHANICAL, REST)
    return (MECHANICAL, ACTUATOR) if by_command else (MECHANICAL,)


def in_columns(effect: Effect) -> bool:
    """Whether its linear parameters are columns of a regression."""
    return effect.acts in (*FRICTIONAL, "force", "actuator", "stiction") and not by_load(effect)


def by_load(effect: Effect) -> bool:
    """Whether it is friction that depends on the applied force, which is the regression's b."""
    return effect.acts in FRICTIONAL and "F" in effect.depends_on


def split(effect: Effect) -> bool:
    """Whether its one linear parameter gets a column for each direction."""
    return in_columns(effect) and "asymmetry" in effect.names and len(effect.linear) == 1


def shape_params(effect: Effect) -> list[Param]:
    """Parameters that are searched: those in which its rows are not linear."""
    return [
        p
        for p in effect.params
        if not (p.linear and in_columns(effect))
        and not (p.name == "asymmetry" and (split(effect) or by_load(effect)))
    ]


def plain(
    stage: Stage, equation: str, i: int, y: Array | None = None, u: Array | None = None
) -> Rows:
    """Rows of the model without effects, of log `i`; y, u (its integral): in place of the log's."""
    one = stage.logs[i]
    if equation == MECHANICAL:
        return mechanical(one, stage.theta, y, stage.theta_a[0] if stage.by_command else 0.0)
    if equation == ACTUATOR:
        rows = actuator(one, stage.theta_a, y, u)
        if stage.play:
            rows = replace(rows, sd=np.where(one_way(one), rows.sd, BLURRED * rows.sd))
        return rows
    if equation == REST:
        return rest_rows(one, stage.at_rest[i], None if y is None else one.log["y"] - y)
    return breakaway_rows(one, stage.events[i])


def one_way(one: Moving) -> BoolArray:
    """Rows of the actuator equation without a reversal, in which a play may be crossed, (r,)."""
    assert one.whole is not None
    way = np.sign(one.signals["v"])
    turns = np.concatenate([[0], np.cumsum((way[1:] != way[:-1]) | (one.signals["d"][1:] == 0))])
    low, high = one.whole.start, one.whole.start + one.whole.length
    return np.asarray(turns[high] == turns[low])


def joined(stage: Stage, equation: str, effect: Effect, shape: Values, i: int, rows: Rows) -> Rows:
    """`rows` of log `i` with the effect in them: columns, or transformed signals."""
    one = stage.logs[i]
    if effect.acts == "bristle":
        if equation == REST:
            bent = elastic_displacement(effect, shape, one.signals, one.log.h, stage.friction)
            return replace(
                rows,
                b=rows.b - (plain(stage, REST, i).b - rest_rows(one, stage.at_rest[i], bent).b),
            )
        return _elastic(effect, shape, one, stage, rows)
    if effect.acts == "sensor":
        return _beside(plain(stage, equation, i, y=shown_to_true(effect, shape, one, stage)), rows)
    if effect.acts in ("command", "delay"):
        return _beside(plain(stage, equation, i, u=reached(effect, shape, one, stage)), rows)
    if split(effect):
        shape = {**shape, "asymmetry": 0.0}
    if by_load(effect):
        return _implicit(effect, shape, one, stage, rows)
    if effect.acts == "stiction":
        own, fixed = _stiction(effect, shape, i, stage)
    else:
        own, fixed = columns(effect, shape, one, stage)
    names = tuple(f"{effect.key}.{name}" for name in effect.linear)
    if split(effect):
        up: BoolArray = one.up if equation == MECHANICAL else stage.events[i].direction > 0
        own, names = [own[0] * up, own[0] * ~up], (f"{names[0]}+", f"{names[0]}-")
    b = rows.b - fixed if not names else rows.b
    return replace(rows, b=b, X=np.column_stack([rows.X, *own]), names=(*rows.names, *names))


def _beside(fresh: Rows, rows: Rows) -> Rows:
    """Fresh plain columns, with the further columns that `rows` has."""
    more = rows.X[:, fresh.X.shape[1] :]
    return replace(fresh, X=np.column_stack([fresh.X, more]), names=rows.names)


def columns(effect: Effect, shape: Values, one: Moving, stage: Stage) -> tuple[list[Array], Array]:
    """Columns (r,) of the linear parameters, and the contribution as it is where there are none."""
    trials = [
        {**shape, **{k: float(k == name) for k in effect.linear}} for name in effect.linear
    ] or [dict(shape)]
    out = []
    for values in trials:
        raw = contribution(effect, values, one.signals, one.log.h, stage.friction)
        if effect.acts == "actuator":
            assert one.whole is not None
            out.append(one.whole.mean @ raw)
        elif effect.acts == "force":
            out.append(-(one.sliding.mean @ raw))
        else:
            out.append(np.where(one.up, 1.0, -1.0) * (one.sliding.mean @ raw))
    return (out, np.zeros(0)) if effect.linear else ([], out[0])


def _implicit(effect: Effect, shape: Values, one: Moving, stage: Stage, rows: Rows) -> Rows:
    """Rows solved for the applied force: F - d added(F) = X theta, divided by 1 - d added'(F).

    Without the division, friction that grows with F would explain F by itself.
    """
    s, h = one.signals, one.log.h
    d = np.where(one.up, 1.0, -1.0)
    step = 1e-4 * float(np.max(np.abs(s["F"])))
    raw = contribution(effect, shape, s, h, stage.friction)
    more = contribution(effect, shape, {**s, "F": s["F"] + step}, h, stage.friction)
    steep = 1.0 - d * (one.sliding.mean @ ((more - raw) / step))
    if np.any(steep < LOCKED):  # it would hold itself: no motion could be explained by it
        return replace(rows, b=HOPELESS * rows.b)
    b = (rows.b - d * (one.sliding.mean @ raw)) / steep
    return replace(rows, b=b, X=rows.X / steep[:, np.newaxis])


def shown_to_true(effect: Effect, values: Values, one: Moving, stage: Stage) -> Array:
    """Position of the body [m] behind the measured one, (n,), by the sensor effect's own equation.

    A play is crossed while the measured position rests, so the body is on the side of the last
    motion; any other transducer is inverted by two substitutions.
    """
    y = np.asarray(one.log["y"])
    signals = dict(one.signals)
    if effect.evolve is not None:
        return y + 0.5 * values[effect.params[0].name] * _last_direction(one.signals["d"])
    true = y
    for _ in range(2):
        signals["y"] = true
        true = y - (contribution(effect, values, signals, one.log.h, stage.friction) - true)
    return true


def _last_direction(d: Array) -> Array:
    """d (n,) with every 0 replaced by the last direction before it."""
    at = np.maximum.accumulate(np.where(d != 0, np.arange(len(d)), 0))
    return d[at]


def reached(effect: Effect, values: Values, one: Moving, stage: Stage) -> Array:
    """Integral of the command that reaches the actuator [V s], (n,)."""
    h, u = one.log.h, np.asarray(one.log["u"])
    given = contribution(effect, values, one.signals, h, stage.friction)
    if effect.acts == "command":
        return integral(given, h)
    t = h * np.arange(len(u))
    return np.asarray(np.interp(t - float(given[0]), t, integral(u, h)))


def _elastic(effect: Effect, shape: Values, one: Moving, stage: Stage, rows: Rows) -> Rows:
    """The two Coulomb columns replaced by an elastic force that builds up to them."""
    level = elastic_share(effect, shape, one.signals, one.log.h, stage.friction)
    X = rows.X.copy()
    X[:, 1] = one.sliding.mean @ np.maximum(level, 0.0)
    X[:, 2] = one.sliding.mean @ np.minimum(level, 0.0)
    return replace(rows, X=X)


def _stiction(effect: Effect, shape: Values, i: int, stage: Stage) -> tuple[list[Array], Array]:
    """Columns (k,) of the linear parameters at the breakaways of log `i`, signed as the force."""
    one, events = stage.logs[i], stage.events[i]
    signals = dict(one.signals)
    signals["d"] = np.ones(len(one.log))
    for low, high in stretches(one, 2):
        signals["d"][low:high] = 0.0
    trials = [
        {**shape, **{k: float(k == name) for k in effect.linear}} for name in effect.linear
    ] or [dict(shape)]
    out = [
        events.direction * contribution(effect, x, signals, one.log.h, stage.friction)[events.at]
        for x in trials
    ]
    return (out, np.zeros(0)) if effect.linear else ([], out[0])


def outcome(stage: Stage, equation: str, rows: Rows) -> Outcome:
    """Fit and criterion of an equation's rows.

    Within the band the model's slip friction does not hold. Rows slower than a threshold count
    TRIM each instead of their squared residual; the best threshold is taken.
    """
    scale = stage.scale(equation)
    if equation == REST:
        r = rows.b / rows.sd
        return Outcome(
            rows, Fitted(np.zeros(0), r, float(np.sum(r**2))), _robust(r, scale), 0.0, True
        )
    if equation == BREAKAWAY:
        fit = _resistant(rows, scale)
        return Outcome(rows, fit, _robust(fit.residual, scale), 0.0, True)
    if not np.any(np.isfinite(rows.speed)):
        fit = solve(rows)
        return Outcome(rows, fit, fit.cost / scale, 0.0)
    edges = np.quantile(rows.speed, TRIMS)
    A = np.column_stack([rows.X, rows.b]) / rows.sd[:, np.newaxis]
    size = np.maximum(np.sqrt(np.mean(A**2, axis=0)), 1e-300)
    whitened = A / size
    bins = np.digitize(rows.speed, edges[1:])
    grams = np.array([whitened[bins == i].T @ whitened[bins == i] for i in range(len(edges))])
    own = np.flatnonzero([name in POSITIVE for name in rows.names])
    tried = []
    for i in range(len(edges)):
        theta, left = _of_gram(grams[i:].sum(axis=0), own)
        total = left * size[-1] ** 2 / scale + TRIM * np.count_nonzero(bins < i)
        tried.append((total, i, theta))
    total, best, theta = min(tried, key=lambda each: each[0])
    theta = theta * size[-1] / size[:-1]
    residual = A[:, -1] - A[:, :-1] @ theta
    fit = Fitted(theta, residual, float(np.sum(residual[bins >= best] ** 2)))
    return Outcome(rows, fit, float(total), float(edges[best]))


def _resistant(rows: Rows, scale: float) -> Fitted:
    """Least squares in which events far off count less (Cauchy's weights)."""
    fit = solve(rows)
    for _ in range(10):
        weight = 1.0 / np.sqrt(1.0 + fit.residual**2 / (scale * ROBUST))
        theta = solve(replace(rows, sd=rows.sd / np.maximum(weight, 1e-6))).theta
        residual = (rows.b - rows.X @ theta) / rows.sd
        fit = Fitted(theta, residual, float(np.sum(residual**2)))
    return fit


def _robust(r: Array, scale: float) -> float:
    """Criterion of rows of which some are no rest at all: Cauchy's, near r^2 for small r."""
    return float(np.sum(ROBUST * np.log1p(r**2 / (scale * ROBUST))))


def _of_gram(G: Array, positive: IntArray) -> tuple[Array, float]:
    """Least squares and the square sum it leaves, from the Gram matrix of [X b]."""

    def least_squares(at: IntArray) -> Array:
        return np.asarray(np.linalg.lstsq(G[np.ix_(at, at)], G[at, -1], rcond=1e-12)[0])

    theta = non_negative(least_squares, len(G) - 1, positive)
    left = G[-1, -1] - 2 * theta @ G[:-1, -1] + theta @ G[:-1, :-1] @ theta
    return theta, float(max(left, 0.0))


def told(stage: Stage, equation: str) -> bool:
    """Whether the logs have enough rows of an equation."""
    rows = sum(len(part.b) for part in stage.parts[equation])
    least = FEWEST_EVENTS if equation == BREAKAWAY else 2 * (6 if equation == REST else 12)
    finite = all(np.all(np.isfinite(part.sd)) for part in stage.parts[equation] if len(part.b))
    return rows >= least and finite


def base_outcomes(stage: Stage) -> dict[str, Outcome]:
    """Every equation that the logs tell, with the structure found so far."""
    return {
        equation: outcome(stage, equation, stacked(stage.parts[equation]))
        for equation in EQUATIONS
        if (equation != ACTUATOR or stage.by_command) and told(stage, equation)
    }


def trial(
    stage: Stage, effect: Effect, shape: Values, told_in: Sequence[str]
) -> tuple[float, dict[str, Outcome]]:
    """Criterion over the equations `told_in` with the effect at this shape, and their outcomes."""
    found = {}
    for equation in told_in:
        parts = [
            joined(stage, equation, effect, shape, i, rows)
            for i, rows in enumerate(stage.parts[equation])
        ]
        found[equation] = outcome(stage, equation, stacked(parts))
    return sum(x.criterion for x in found.values()), found


def best_of(stage: Stage, effect: Effect, base: Mapping[str, Outcome]) -> Candidate | None:
    """The effect at its best beside what the stage holds; None where it cannot show or stand."""
    told_in = [e for e in equations_of(effect, stage.by_command) if e in base]
    if not told_in or any(name not in one.signals for one in stage.logs for name in effect.needs):
        return None
    if effect.signals and not any(
        name in one.signals for one in stage.logs for name in effect.signals
    ):
        return None
    free = shape_params(effect)
    grids = [shape_grid(effect, p, stage.logs) for p in free]
    starts = [
        dict(zip((p.name for p in free), map(float, x), strict=True)) for x in product(*grids)
    ]

    def score(shape: Values) -> float:
        total, found = trial(stage, effect, shape, told_in)
        fair = needs_rounds(effect) or admissible(effect, with_sizes(effect, shape, found))
        return total if fair else OUTSIDE

    best = min(starts, key=score)
    if free:
        best = refined(
            free, [bounds_of(p, g) for p, g in zip(free, grids, strict=True)], best, score
        )
    total, found = trial(stage, effect, best, told_in)
    values = with_sizes(effect, best, found)
    own = stage
    for _ in range(ROUNDS if needs_rounds(effect) else 0):
        five = found[MECHANICAL].fit.theta[:5] if MECHANICAL in found else own.theta
        own = replace(own, theta_f=five)
        total, found = trial(own, effect, best, told_in)
        values = with_sizes(effect, best, found)
    if not admissible(effect, values):
        return None
    gain = sum(base[e].criterion for e in told_in) - total
    return Candidate(effect, values, found, float(gain))


def bounds_of(p: Param, tried: Array) -> tuple[float, float]:
    """Where a parameter is refined: between the first values tried, an asymmetry anywhere."""
    if p.name == "asymmetry":
        return p.low, p.high
    return float(np.min(tried)), float(np.max(tried))


def needs_rounds(effect: Effect) -> bool:
    """Whether the contribution depends on the friction parameters that are fitted with it."""
    return effect.acts in FRICTIONAL and bool({"c", "f"} & symbols_of(effect))


def symbols_of(effect: Effect) -> set[str]:
    """Names in the effect's equation."""
    return set(re.findall(r"[A-Za-z_]\w*", effect.equation))


def admissible(effect: Effect, values: Values) -> bool:
    """Whether every parameter lies within its bounds."""
    return all(p.low <= values[p.name] <= p.high for p in effect.params)


def refined(
    free: Sequence[Param], bounds: Sequence[tuple[float, float]], shape: Values,
    score: Callable[[Values], float],
) -> dict[str, float]:  # fmt: skip
    """Shape parameters at the nearest minimum of `score`, within bounds."""
    start = np.array([shape[p.name] for p in free])
    unit = np.where(start != 0, np.abs(start), 1.0)
    low, high = np.array(bounds).T

    def at(x: Array) -> dict[str, float]:
        inside = np.clip(x * unit, low, high)
        return dict(zip((p.name for p in free), inside.tolist(), strict=True))

    first = start / unit
    step = np.array([0.02 if p.name == "period" else 0.15 for p in free])
    step = np.where(first + step > high / unit, -step, step)
    simplex = np.vstack([first, first + np.diag(step)])
    options: Any = {"maxfev": REFINED * len(free), "fatol": 0.1, "xatol": 1e-4}
    options["initial_simplex"] = simplex
    search: Any = minimize
    found = search(lambda x: score(at(x)), first, method="Nelder-Mead", options=options)
    return at(found.x)


def with_sizes(effect: Effect, shape: Values, found: Mapping[str, Outcome]) -> dict[str, float]:
    """All parameters: shape, and the linear ones found; two directions as mean and asymmetry."""
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
        else:
            values[name] = sizes[full]
    return values
