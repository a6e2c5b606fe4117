"""Logs and the structure found so far, and an effect's rows beside it in every equation."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np

from identification.arrays import Array, BoolArray
from identification.effects._base import Effect
from identification.estimation.regression.breakaway import breakaway_limits, with_shown_band
from identification.estimation.regression.effect_columns import (
    LEAST_LEFT_BY_LOAD,
    Values,
    equations_of,
    needs_rounds,
    split,
)
from identification.estimation.regression.equation_rows import (
    ACTUATOR,
    MECHANICAL,
    REST,
    MotionLog,
    actuator,
    mechanical,
)
from identification.estimation.regression.signals_behind_effects import (
    driven,
    reached,
    shown_to_true,
)
from identification.estimation.regression.standstill import (
    Breakaways,
    Rest,
    breakaway_rows,
    rest_rows,
    rest_stretches,
    rests,
)
from identification.estimation.regression.weighted_rows import Rows
from identification.model.karnopp import Karnopp
from identification.simulation.effect_along_motion import (
    contribution,
    elastic_displacement,
    elastic_share,
)

COMMAND_STEP = 1e-6  # of the largest command, a step by which its passing is found
FLAT = 0.2  # of the time in sliding, that a command may leave a motor without force
SLOPE_STEP = 1e-3  # of a level of friction, over which a slope is taken
UNEXPLAINED = 1e3  # times the force to be explained


@dataclass(frozen=True, eq=False)
class EffectRows:
    """Logs and the structure found so far.

    logs: with sensor and command effects found already taken out; theta: m, F_cp, F_cn, F_vp, F_vn;
    theta_a: k1, k2, offset; chosen: effects found so far whose sizes are fitted anew with every
    candidate, at these values; taken: keys of those taken out of the logs; theta_f: in place of
    theta, for the levels that effects ask for (the rows' noise stays as theta makes it); band:
    speed [m/s] up to which friction is not that of sliding; sliding: friction with its band, once
    known, by which breakaways are exact; scales: by equation, what its rows' squares are divided
    by; borne: forces [N] up and down, up to which a body that is at rest surely stays so, whatever
    levels an effect leaves to the others.
    """

    logs: tuple[MotionLog, ...]
    theta: Array
    theta_a: Array
    by_command: bool
    chosen: tuple[tuple[Effect, Values], ...] = ()
    taken: tuple[str, ...] = ()
    theta_f: Array | None = None
    band: float = 0.0
    sliding: Karnopp | None = None
    scales: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    borne: tuple[float, float] = (np.inf, np.inf)

    @cached_property
    def friction(self) -> Karnopp:
        """The five parameters as a model, for the levels that effects ask for; no band."""
        theta = self.theta if self.theta_f is None else self.theta_f
        m, F_cp, F_cn, F_vp, F_vn = np.maximum(theta, 1e-9).tolist()
        up, down = F_cp, F_cn
        if self.sliding is not None:
            up, down = max(F_cp, self.sliding.F_sp), max(F_cn, -self.sliding.F_sn)
        return Karnopp(m, F_cp, F_cn, F_vp, F_vn, 0.0, 0.0, up, -down)

    @cached_property
    def parts(self) -> Mapping[str, list[Rows]]:
        """Rows of each log in each equation, with the columns of the effects chosen; those of an
        equation are made when it is first asked for."""
        return _Parts(self)

    @cached_property
    def at_rest(self) -> tuple[Rest, ...]:
        """Rows of rest of each log."""
        return tuple(rests(one, *self.surely_borne) for one in self.logs)

    @property
    def surely_borne(self) -> tuple[float, float]:
        """`borne`, and no more than these Coulomb levels."""
        up, down = np.minimum(np.maximum(self.theta[1:3], 0.0), self.borne).tolist()
        return up, down

    @cached_property
    def events(self) -> tuple[Breakaways, ...]:
        """Breakaways of each log."""
        return tuple(
            breakaway_limits(one, self.sliding or with_shown_band(one, self.friction))
            for one in self.logs
        )

    @property
    def by_motor(self) -> bool:
        """Whether the force is a motor's, that of its command."""
        return self.logs[0].by_motor

    @property
    def prescribed(self) -> bool:
        """Whether the motion is prescribed: a body that a rig moves is not stuck at any speed."""
        return self.logs[0].prescribed

    def scale(self, equation: str) -> float:
        """What squares of rows are divided by, 1 where nothing but noise is left."""
        return self.scales.get(equation, 1.0)


class _Parts(dict[str, list[Rows]]):
    """The rows of a stage by equation."""

    def __init__(self, stage: EffectRows) -> None:
        super().__init__()
        self.stage = stage

    def __missing__(self, equation: str) -> list[Rows]:
        stage = self.stage
        own = [plain_rows(stage, equation, i) for i in range(len(stage.logs))]
        for effect, values in stage.chosen:
            if equation in equations_of(effect, stage.by_command, stage.by_motor):
                own = [
                    with_effect(stage, equation, effect, values, i, rows)
                    for i, rows in enumerate(own)
                ]
        self[equation] = own
        return own


def plain_rows(
    stage: EffectRows, equation: str, i: int, y: Array | None = None, u: Array | None = None
) -> Rows:
    """Rows of the model without effects, of log `i`; y, u (its integral): in place of the log's.

    Source: `README.md`, (2) to (6) (Messenger, Bortz 2021; the paper's actuator).
    """
    one = stage.logs[i]
    if equation == MECHANICAL:
        rows = mechanical(one, stage.theta, y, stage.theta_a[0] if stage.by_command else 0.0)
        if (
            stage.prescribed
        ):  # no inertia shows: a mass would be what an effect that is missing left
            rows = replace(rows, X=rows.X * (np.arange(rows.X.shape[1]) > 0))
        return rows if u is None else replace(rows, b=one.sliding.zoh @ driven(one, u))
    if equation == ACTUATOR:
        return actuator(one, stage.theta_a, y, u)
    if equation == REST:
        return rest_rows(one, stage.at_rest[i], None if y is None else one.log["y"] - y)
    return breakaway_rows(one, stage.events[i])


def with_effect(
    stage: EffectRows, equation: str, effect: Effect, shape: Values, i: int, rows: Rows
) -> Rows:
    """`rows` of log `i` with the effect in them: columns, or transformed signals, by the effect's
    own equation (its file names the source) in weak form (Messenger, Bortz 2021)."""
    one = stage.logs[i]
    if effect.place.elastic:
        if equation == REST:
            bent = elastic_displacement(effect, shape, one.signals, one.log.h, stage.friction)
            return replace(
                rows,
                b=rows.b
                - (plain_rows(stage, REST, i).b - rest_rows(one, stage.at_rest[i], bent).b),
            )
        return _elastic(effect, shape, one, stage, rows)
    if effect.place.shows:
        return _beside(
            plain_rows(stage, equation, i, y=shown_to_true(effect, shape, one, stage.friction)),
            rows,
        )
    if effect.place.on_command:
        behind = _beside(
            plain_rows(stage, equation, i, u=reached(effect, shape, one, stage.friction)), rows
        )
        if one.zoh and equation == MECHANICAL and not effect.place.delays:
            return _flattened(effect, shape, one, stage, behind)
        return behind
    if split(effect):
        shape = {**shape, "asymmetry": 0.0}
    if effect.load_dependent:
        return _implicit(effect, shape, one, stage, rows)
    if effect.place.in_stops:
        own, fixed = _stiction(effect, shape, i, stage)
    else:
        own, fixed = columns(effect, shape, one, stage)
        if not effect.linear and needs_rounds(effect):
            return _bent(effect, shape, one, stage, rows, fixed)
    names = tuple(f"{effect.key}.{name}" for name in effect.linear)
    if split(effect):
        up: BoolArray = one.up if equation == MECHANICAL else stage.events[i].direction > 0
        own, names = [own[0] * up, own[0] * ~up], (f"{names[0]}+", f"{names[0]}-")
    b = rows.b - fixed if not names else rows.b
    # Of several sizes one may be nothing, and noise must not bring it below.
    sizes = {f"{effect.key}.{p.name}" for p in effect.params if p.spare and p.low == 0.0}
    return replace(
        rows, b=b, X=np.column_stack([rows.X, *own]), names=(*rows.names, *names),
        positive=rows.positive | sizes,
    )  # fmt: skip


def _flattened(
    effect: Effect, shape: Values, one: MotionLog, stage: EffectRows, rows: Rows
) -> Rows:
    """A motor's rows with what they lose where the effect flattens their force.

    By the change of variable from the logged force to the one that reaches the body; where none
    of it passes, the log shows no more than that it lies within the force's range.
    """
    s, h, u = one.signals, one.log.h, np.asarray(one.log["u"])
    step = COMMAND_STEP * float(np.max(np.abs(u)))
    more = contribution(effect, shape, {**s, "u": u + np.copysign(step, u)}, h, stage.friction)
    given = contribution(effect, shape, s, h, stage.friction)
    slope = np.abs(more - given) / step
    least = float(np.median(rows.sd)) * np.sqrt(2 * np.pi) / max(float(np.ptp(s["F"])), 1e-300)
    if np.mean(one.sliding.zoh @ (slope < least)) > FLAT:  # a body driven by nothing
        return replace(rows, b=UNEXPLAINED * (one.sliding.zoh @ one.log["F"]))
    lost = -2.0 * np.sum(one.sliding.zoh @ np.log(np.maximum(slope, min(least, 1.0))))
    return replace(rows, lost=float(lost))


def _beside(fresh: Rows, rows: Rows) -> Rows:
    """Fresh plain columns, with the further columns that `rows` has."""
    more = rows.X[:, fresh.X.shape[1] :]
    both = np.column_stack([fresh.X, more])
    return replace(fresh, X=both, names=rows.names, positive=rows.positive)


def columns(
    effect: Effect, shape: Values, one: MotionLog, stage: EffectRows
) -> tuple[list[Array], Array]:
    """Columns (r,) of the linear parameters, and the contribution as it is where there are none.

    Source: weak form, Messenger, Bortz (2021).
    """

    def made(values: Values) -> Array:
        if effect.place.feeds:
            assert one.whole is not None
            raw = contribution(effect, values, one.signals, one.log.h, stage.friction)
            return np.asarray(one.whole.mean @ raw)
        mean = np.asarray(one.sliding.mean @ _in_sliding(effect, values, one, stage.friction))
        return -mean if effect.place.drives else np.where(one.up, 1.0, -1.0) * mean

    return _of_each_size(effect, shape, made)


def _of_each_size(
    effect: Effect, shape: Values, made: Callable[[Values], Array]
) -> tuple[list[Array], Array]:
    """What is made of an effect with one of its sizes 1 and the others 0, for each; or, of one that
    has no sizes, of what it is."""
    if not effect.linear:
        return [], made(dict(shape))
    alone = [{name: float(name == one) for name in effect.linear} for one in effect.linear]
    return [made({**shape, **sizes}) for sizes in alone], np.zeros(0)


def _in_sliding(effect: Effect, values: Values, one: MotionLog, friction: Karnopp) -> Array:
    """What an effect contributes, (n,), right where the body slides."""
    if effect.evolve is not None:
        return contribution(effect, values, one.signals, one.log.h, friction)
    own, signals = one.in_motion
    raw = np.zeros(len(own))
    raw[own] = contribution(effect, values, signals, one.log.h, friction)
    return raw


def _bent(
    effect: Effect, shape: Values, one: MotionLog, stage: EffectRows, rows: Rows, fixed: Array
) -> Rows:
    """Rows with what the effect makes of the friction that is fitted beside it.

    fixed (r,): its contribution at the stage's friction; how that changes with each of the four
    sliding parameters joins their columns, or substitution would creep to them in many rounds.
    """
    now = np.maximum(stage.theta if stage.theta_f is None else stage.theta_f, 1e-9)
    level = max(float(np.mean(now[1:3])), SLOPE_STEP * float(np.std(one.log["F"])), 1e-12)
    pace = level / max(float(np.max(one.speed, initial=0.0)), 1e-300)
    X, b = rows.X.copy(), rows.b - fixed
    for i, step in ((1, level), (2, level), (3, pace), (4, pace)):
        theta = now + SLOPE_STEP * step * (np.arange(len(now)) == i)
        _, more = columns(effect, shape, one, replace(stage, theta_f=theta))
        slope = (more - fixed) / (SLOPE_STEP * step)
        X[:, i] += slope
        b += slope * now[i]
    return replace(rows, b=b, X=X)


def _implicit(effect: Effect, shape: Values, one: MotionLog, stage: EffectRows, rows: Rows) -> Rows:
    """Rows solved for the applied force: F - d added(F) = X theta, divided by 1 - d added'(F).

    Without the division, friction that grows with F would explain F by itself.
    """
    s, h = one.signals, one.log.h
    d = np.where(one.up, 1.0, -1.0)
    step = 1e-4 * float(np.max(np.abs(s["F"])))
    raw = contribution(effect, shape, s, h, stage.friction)
    more = contribution(effect, shape, {**s, "F": s["F"] + step}, h, stage.friction)
    steep = 1.0 - d * (one.sliding.mean @ ((more - raw) / step))
    # It would hold itself: no motion could be explained by it
    if np.any(steep < LEAST_LEFT_BY_LOAD):
        return replace(rows, b=UNEXPLAINED * rows.b)
    b = (rows.b - d * (one.sliding.mean @ raw)) / steep
    return replace(rows, b=b, X=rows.X / steep[:, np.newaxis])


def _elastic(effect: Effect, shape: Values, one: MotionLog, stage: EffectRows, rows: Rows) -> Rows:
    """The two Coulomb columns replaced by an elastic force that builds up to them."""
    level = elastic_share(effect, shape, one.signals, one.log.h, stage.friction)
    X = rows.X.copy()
    X[:, 1] = one.sliding.mean @ np.maximum(level, 0.0)
    X[:, 2] = one.sliding.mean @ np.minimum(level, 0.0)
    return replace(rows, X=X)


def _stiction(
    effect: Effect, shape: Values, i: int, stage: EffectRows
) -> tuple[list[Array], Array]:
    """Columns (k,) of the linear parameters at the breakaways of log `i`, signed as the force."""
    one, events = stage.logs[i], stage.events[i]
    signals = dict(one.signals)
    signals["d"] = np.ones(len(one.log))
    for low, high in rest_stretches(one, 2):
        signals["d"][low:high] = 0.0

    def made(values: Values) -> Array:
        shown = contribution(effect, values, signals, one.log.h, stage.friction)
        return np.asarray(events.direction * shown[events.at])

    return _of_each_size(effect, shape, made)
