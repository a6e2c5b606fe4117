"""What every real machine has beside friction: a constant force, gravity, columns of two instants.

The equation of motion in weak form, over windows of sliding in one direction (N):
    F(t - lag) + F_0 - a sin y - b cos y = m y'' + (+-)F_c + F_v y'
lag: by how much the motion follows the column of the force (either sign: a position that is read
late, or a current that its drive filters); gravity of a rotary machine alone. They belong to the
plain model: what they make of the force is taken out before anything else is fitted, each where
the equation shows it beyond doubt, so that it costs nothing where it is zero.
Sources: weak form, see `signals/weak_form`; gravity and constant force as terms of the inverse
dynamic model, Gautier, Khalil, CDC 1988.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from identification.arrays import Array, BoolArray
from identification.errors import NotIdentifiable, UserError
from identification.estimation.estimates import effect_estimates, reported_estimate, widened
from identification.estimation.force_hold import whole_samples_late
from identification.estimation.recorded_logs import acts_directly
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.regression.lagged_rows import FEWEST_WINDOWS, LaggedRows, lagged_rows
from identification.estimation.regression.motion_log import again, motion_log
from identification.estimation.regression.motion_rows import converged_rows
from identification.estimation.regression.row_fit import rms
from identification.estimation.regression.weighted_rows import (
    OF_EQUATION,
    OVERLAP,
    left_out,
    left_unseen,
    solve_rows,
    spread_of_left_out,
    stacked,
    with_model_error,
    without_each_block,
)
from identification.estimation.turn_orders import turn_orders
from identification.log import Log, Rig
from identification.model.estimates import NORMAL_95, Estimate
from identification.model.karnopp import NAMES
from identification.model.size import NOT_SHOWN, Size
from identification.model.surroundings import (
    NO_SURROUNDINGS,
    Order,
    Surroundings,
)
from identification.thresholds import (
    BEYOND_CHANCE,
    EARNS,
    FAR_LESS,
    HALF,
    MATERIAL,
    OF_ACCOUNT,
    PENALTY,
    TWICE,
)

LAG_STEP = 0.25  # of a sample, between the lags that are tried
LAG = 12.0  # samples, up to which they are, as a filtered force is before its motion
FARTHER = (1.0, 2.0, 4.0, 8.0)  # times that, where the best is the last of them
OF_A_STROKE = 0.25  # to which they are: in a sine a lag is as good as another inertia and friction
TURNS = 0.3  # rad of motion, from which gravity is no constant force
PLAIN = (0, 1, 2, 3, 4)  # columns of the equation, in the order of FIVE
SPRING = (*PLAIN, 5)  # with the angle itself
GRAVITY = (*PLAIN, 6, 7)  # with its sine and cosine
SINE = (*PLAIN, 6)
OF_TAKEN_OUT = 1e-3  # of a value, by which it errs where a force was taken out first
WHOLE_NUMBER = "exact: a whole number of times in a turn"


def surroundings(logs: Sequence[Log], rig: Rig) -> Surroundings:
    """What acts beside the applied force in logs of one machine, with y [m] and F [N].

    Nothing where too little of their motion slides. Orders of a turn hide all the rest, which is
    searched without them. Sources: weak form, Messenger, Bortz (2021); gravity and constant force,
    Gautier, Khalil, CDC 1988; deviations, Tukey (1958).
    """
    orders: tuple[Order, ...] = ()
    if acts_directly(logs, rig):
        orders = turn_orders(logs, rig)
    gives = rig.force_per_command if rig.kind == "motor" else None
    known = Surroundings(orders=orders, gives=gives)
    found = _beside(logs, rig, known)
    if orders and found.lag.value:
        orders = turn_orders([found.of_one_instant(log) for log in logs], rig)
        found = _beside(logs, rig, Surroundings(orders=orders, gives=gives))
    return replace(found, orders=orders)


def _beside(logs: Sequence[Log], rig: Rig, known: Surroundings) -> Surroundings:
    """The same beside orders of a turn that are known."""
    logs = [known.taken_out(log) for log in logs]
    zoh = rig.kind == "motor"
    try:
        moved = [motion_log(log, zoh=zoh, by_command=False) for log in logs]
    except UserError:
        return NO_SURROUNDINGS
    # Between an actuator's command and the torque that it makes, gravity is an effect as any other.
    turns = acts_directly(logs, rig) and max(float(np.ptp(log["y"])) for log in logs) > TURNS
    turns = turns and rig.motion == "rotary"
    found_at = _found_far(moved, turns, zoh, known)
    if found_at is None:
        return NO_SURROUNDINGS
    found, used = found_at
    lag, sampled = _lag(found, used, zoh), False
    hold = None
    if rig.kind == "force":
        nearest = LAG_STEP * round(lag.value / LAG_STEP)
        of_a_hold = {0.5: 0.0, -0.5: 0.0}  # as which a hold shows in the rows: no line so late
        line = of_a_hold.get(nearest, lag.value)
        hold = whole_samples_late(logs, line, rotary=rig.motion == "rotary")
    if zoh and -1.0 < lag.value < 0.0:  # its loop is faster than its log (`intersample_command`)
        lag = NOT_SHOWN
    if zoh and lag.value:
        current = lagged_rows(moved, found.lags, turns, False, known) or found
        other = _lag(current, used, zoh)
        left = current.least(used), found.least(used), found.rows / OVERLAP
        sampled = bool(other.value) and is_likelier(*left)
        lag, found = (other, current) if sampled else (lag, found)
    h = logs[0].h
    gives = rig.force_per_command if zoh else None
    theta, each = _with_left_out(found, used, lag.value)
    force = sine = cosine = NOT_SHOWN
    if used is GRAVITY:
        late = Surroundings(Size(lag.value * h), gives=gives, sampled=sampled)
        in_time = [again(one, late.of_one_instant(one.log)) for one in moved]
        theta, each = _beside_gravity(in_time) or (theta, each)
        sd = spread_of_left_out(each)
        sine, cosine = (Size(float(theta[i]), float(sd[i])) for i in (-2, -1))
    ways = np.concatenate([one.up for one in moved])
    if bool(np.any(ways) and not np.all(ways)):
        usual = float(np.median(np.concatenate([one.speed for one in moved])))
        force = _constant_force(theta, each, usual)
    lag = Size(lag.value * h, lag.sd * h) if hold is None else Size(hold * h)
    return Surroundings(lag, force, sine, cosine, (), gives, sampled, zoh=hold is not None)


def _constant_force(theta: Array, each: Array, usual: float) -> Size:
    """A constant force larger than friction, which it takes below 0 in one direction, by
    coefficients (k,) and those without each block (blocks, k); nothing where there is none.

    By the Coulomb levels; by friction at the usual speed [m/s] where this is far surer: of strokes
    of one speed the levels are not known. Spread: Tukey (1958); ours.
    """
    found = NOT_SHOWN
    for speed in (0.0, usual):
        up, down = np.zeros(len(theta)), np.zeros(len(theta))
        up[[1, 3]] = down[[2, 4]] = 1.0, speed
        friction, half = (float(up @ theta), float(down @ theta)), 0.5 * (down - up)
        always = Size(float(half @ theta), float(spread_of_left_out(each @ half)))
        shown = larger_than_friction(*friction) and stands_out(always.value, always.sd)
        if shown and (not found.value or always.sd < HALF * found.sd):
            # As far as friction is equal in both directions, which it is about.
            unequal = OF_ACCOUNT * 0.5 * abs(sum(friction)) / NORMAL_95
            found = replace(always, sd=float(np.hypot(always.sd, unequal)))
    return found


def _found_far(
    moved: Sequence[MotionLog], turns: bool, zoh: bool, known: Surroundings
) -> tuple[LaggedRows, Sequence[int]] | None:
    """The equation's rows at lags that reach as far as the best of them, and the columns used; the
    nearest ones where none of these is the best within its reach; None where there are too few."""
    first = None
    strokes = sum(1 + int(np.sum(one.up[1:] != one.up[:-1])) for one in moved)
    most = OF_A_STROKE * sum(len(one.log) for one in moved) / strokes
    for latest in (one * LAG for one in FARTHER if one == 1.0 or one * LAG < most):
        lags = np.arange(-LAG, latest + LAG_STEP / 2, LAG_STEP)
        found = lagged_rows(moved, lags, turns, zoh, known)
        if found is None:
            break
        found = found.with_inertia(PLAIN)
        used = _beside_friction(found) if turns else PLAIN
        first = first or (found, used)
        if int(np.argmin(found.left(found.every, used)[0])) < len(found.lags) - 1:
            return found, used
    return first


def surrounding_estimates(around: Surroundings) -> dict[str, Estimate]:
    """Each with its interval, as key.name of the effect that it is."""
    deviations = {
        "gravity.a": around.sine.sd, "gravity.b": around.cosine.sd,
        "constant_force.F_0": around.force.sd, "input_delay.tau": around.lag.sd,
    }  # fmt: skip
    for acting, one in zip(around.cogging, around.orders, strict=True):
        deviations |= {f"{acting.key}.a": one.sine.sd, f"{acting.key}.b": one.cosine.sd}
    whole = {
        f"{acting.key}.{p.name}": Estimate(acting.values[p.name], p.unit, reason=WHOLE_NUMBER)
        for acting in around.cogging
        for p in acting.effect.params
        if p.name not in ("a", "b")
    }
    return effect_estimates(around.effects, deviations) | whole


def widened_friction(
    friction: Mapping[str, Estimate], around: Surroundings, logs: Sequence[Log]
) -> dict[str, Estimate]:
    """The nine, their intervals with the deviation of a force that was taken out before them.

    A constant force moves F_cp and F_cn by all of its error, gravity by the mean that its sine and
    cosine have in motion that way; every one errs by a share of itself, since the force was put
    right between its samples. First-order propagation of independent errors; ours.
    """
    moves = [np.diff(np.asarray(log["y"])) for log in logs]
    angles = np.concatenate([np.asarray(log["y"])[1:] for log in logs])
    up = np.concatenate(moves) > 0.0
    ways = {"F_cp": up, "F_cn": ~up}
    out: dict[str, Estimate] = {}
    for name, one in ((name, friction[name]) for name in NAMES if name in friction):
        if one.value is None or one.sd is None:
            continue
        parts = [OF_TAKEN_OUT * one.value]
        if name in ways:
            parts.append(around.force.sd)
        if name in ways and np.any(ways[name]):
            parts += [
                size.sd * abs(float(np.mean(wave(angles[ways[name]]))))
                for size, wave in ((around.sine, np.sin), (around.cosine, np.cos))
            ]
        more = float(np.linalg.norm(parts))
        out[name] = widened(one, float(np.hypot(one.sd, more)) / one.sd)
    return out


def lag_estimate(around: Surroundings) -> Estimate | None:
    """By how much the motion follows the column of the force [s]; None where it does not."""
    if not around.lag.value:
        return None
    return reported_estimate(around.lag.value, "s", around.lag.sd)


def lag_explains(logs: Sequence[Log], rig: Rig, around: Surroundings) -> tuple[float, float]:
    """What the equation leaves of the force without the lag and with it [N], root mean squares.

    Of these logs' own coefficients, by (1) of `README.md` (Gautier, Khalil 1988). Raises
    NotIdentifiable where too little of them slides.
    """
    zoh = rig.kind == "motor" and not around.sampled
    moved = [motion_log(log, zoh=zoh, by_command=False) for log in logs]
    lags = np.unique([0.0, around.lag.value / logs[0].h])
    turns = bool(around.sine.value or around.cosine.value)
    found = lagged_rows(moved, lags, turns, zoh)
    if found is None:
        raise NotIdentifiable(f"{logs[0].name}: fewer than {FEWEST_WINDOWS} windows of sliding")
    left = np.sqrt(found.left(found.every, GRAVITY if turns else PLAIN)[0] / found.rows)
    without, with_it = left[np.argmin(np.abs(lags))], left[np.argmax(np.abs(lags))]
    return float(without), float(with_it)


def _beside_gravity(moved: Sequence[MotionLog]) -> tuple[Array, Array] | None:
    """Coefficients of friction and gravity (7,) and without each block, in the windows of sliding
    that suit these logs best: wide ones would leave out quick motion, and let gravity have what
    friction makes of it. None where there are too few.

    The cosine, about a constant force over a small angle, is 0 where blocks that a fit has not seen
    are predicted no worse without it, and as unsure as beside the rest. Source: Stone (1974).
    """
    rows = with_model_error(stacked([one.rows for one in converged_rows(moved, gravity=True)]))
    if len(rows.b) < FEWEST_WINDOWS:
        return None
    theta, each = solve_rows(rows).theta, without_each_block(rows)
    plain = replace(rows, X=rows.X[:, :-1], names=rows.names[:-1])
    if rms(left_unseen(rows)) < rms(left_unseen(plain)):
        return theta, each
    unsure = each[:, -1] - theta[-1]
    return np.append(solve_rows(plain).theta, 0.0), np.column_stack(
        [without_each_block(plain), unsure]
    )


def _beside_friction(found: LaggedRows) -> Sequence[int]:
    """The columns with those of gravity, where the force depends on the sine of the angle,
    significantly, for much of what is left without, or with that of a spring, on the angle itself,
    where this explains significantly more in most blocks of the logs: what is left of either is
    seldom noise alone. Source: Vuong, Econometrica 57 (1989) 307, its spread by Tukey (1958)."""
    plain, spring, weight = (found.least(used) for used in (PLAIN, SPRING, GRAVITY))
    each = left_out(
        found.blocks, lambda kept: np.log(found.least(SPRING, kept) / found.least(GRAVITY, kept))
    )
    more = float(np.log(weight / spring))
    if explains(plain, spring) and more > TWICE * float(spread_of_left_out(each)):
        return SPRING
    if not explains(plain, weight):
        return PLAIN
    sizes = [(SINE, -1), (GRAVITY, -2), (GRAVITY, -1)]
    significant = any(_is_significant(found, used, i) for used, i in sizes)
    return GRAVITY if significant else PLAIN


def _is_significant(found: LaggedRows, used: Sequence[int], i: int) -> bool:
    """Whether a coefficient of these columns is significantly different from 0."""
    theta, each = _with_left_out(found, used, 0.0)
    return stands_out(float(theta[i]), float(spread_of_left_out(each)[i]))


def is_likelier(left: float, other: float, independent: float) -> bool:
    """Whether what leaves this of a square of so many independent errors is clearly likelier than
    what leaves another. Source: Schwarz, Ann. Stat. 6 (1978) 461."""
    return other > left * float(np.exp(PENALTY / independent))


def explains(without: float, left: float) -> bool:
    """Whether a term that leaves this of a square, in place of that without it, explains it."""
    return left <= EARNS * without


def explains_most(without: float, left: float) -> bool:
    """Whether what leaves this of a square, in place of that without it, explains most of it: a
    loop's noise makes no lag do so."""
    return left <= HALF * without


def stands_out(size: float, sd: float) -> bool:
    """Whether a size is significantly different from 0."""
    return abs(size) > BEYOND_CHANCE * sd


def larger_than_friction(up: float, down: float) -> bool:
    """Whether a constant force makes one of the Coulomb levels negative, which friction cannot."""
    return min(up, down) < -MATERIAL * max(abs(up), abs(down))


def apart(lag: float) -> bool:
    """Whether columns so many samples apart are of two instants."""
    return abs(lag) >= FAR_LESS


def _lag(found: LaggedRows, used: Sequence[int], zoh: bool) -> Size:
    """The lag in samples, nothing where none shows beyond doubt; zoh: of a motor's command."""
    left, theta = found.left(found.every, used)
    best = int(np.argmin(left))
    none = int(np.argmin(np.abs(found.lags)))
    without = float(left[none])
    if best in (0, len(left) - 1) or theta[0, best] <= 0.0:
        return NOT_SHOWN
    if without <= OF_EQUATION**2 * float(np.sum(found.force[:, none])):
        return NOT_SHOWN  # in what the equation errs itself, a lag and inertia look alike
    lag = _lowest(found.lags, left)
    # A measured force is of any instant about its row: a lag within that need explain nothing.
    about = not zoh and abs(lag) <= HALF
    if not (about or (apart(lag) and explains(without, float(left[best])))):
        return NOT_SHOWN
    return _significant(found, used)


def _significant(found: LaggedRows, used: Sequence[int]) -> Size:
    """The lag in samples that leaves least, nothing where it is not significantly different from
    0."""
    left = found.left(found.every, used)[0]
    best, lag = int(np.argmin(left)), _lowest(found.lags, left)
    each = left_out(
        found.blocks, lambda kept: np.asarray(_lowest(found.lags, found.left(kept, used)[0]))
    )
    # By blocks, and by how sharp the minimum is: windows share samples, and with them their noise.
    i = int(np.clip(best, 1, len(left) - 2))
    bend = max(float(left[i - 1] - 2.0 * left[i] + left[i + 1]) / LAG_STEP**2, 1e-300)
    by_likelihood = float(np.sqrt(2.0 * left[best] / (bend * found.rows / OVERLAP)))
    sd = max(float(spread_of_left_out(each)), by_likelihood)
    return Size(lag, sd) if stands_out(lag, sd) else NOT_SHOWN


def _lowest(lags: Array, left: Array) -> float:
    """Lag of the least square, by the parabola through the lowest three."""
    i = int(np.clip(np.argmin(left), 1, len(left) - 2))
    low, middle, high = (float(x) for x in left[i - 1 : i + 2])
    bend = low - 2.0 * middle + high
    return float(lags[i]) + (0.5 * LAG_STEP * (low - high) / bend if bend > 0.0 else 0.0)


def _with_left_out(found: LaggedRows, used: Sequence[int], lag: float) -> tuple[Array, Array]:
    """Coefficients (c,) at a lag in samples, and those without each block (blocks, c)."""

    def of(kept: BoolArray) -> Array:
        theta = found.left(kept, used)[1]
        return np.array([np.interp(lag, found.lags, one) for one in theta])

    return of(found.every), left_out(found.blocks, of)
