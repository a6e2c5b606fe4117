"""Friction where the motion is imposed and the force is what is measured.

A rig that drives the body along a given path shows friction as a force, not in the response: a
free run has nothing to follow there. The parameters then come from the force equation alone, and
those that only a free body shows (mass in slow motion, stick limits, band) are not given.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array, BoolArray
from identification.arx.residual_tests import effective_samples
from identification.errors import NotIdentifiable
from identification.estimation.estimates import NORMAL_SETS, Events, estimates, normal_samples
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regression.equation_rows import (
    FIVE,
    OF_FORCE,
    MotionLog,
    mechanical,
    motion_log,
)
from identification.estimation.regression.motion_rows import (
    OF_EQUATION,
    motion_rows,
    rows_and_windows,
)
from identification.estimation.regression.three_step import FirstEstimate, first_estimate
from identification.estimation.regression.weighted_rows import Rows, solve_rows, stacked
from identification.log import Log, Rig
from identification.model.estimates import Estimate, KarnoppFit, LogFit
from identification.model.karnopp import NAMES, ROTARY_UNITS, UNITS, VISCOUS_NAMES, Karnopp
from identification.model.plant import Motor, Plant, units_of
from identification.signals.initial_state import measured_start
from identification.signals.one_way import is_one_way
from identification.thresholds import HARDLY_MORE, MOST_UNEXPLAINED

INERTIA_SHARE = 0.1  # share of the force below which inertia says nothing of a free body
FEWEST_OF_DIRECTION = 4  # in each direction
FEWEST_JUDGED = 48  # windows of sliding, by which a fit is held against the equation
WIDEST_ASSUMED = 0.06  # of the fastest motion, a stick band that no run has shown
SLIGHT_INERTIA = 1e-3  # of the force, of a mass that the equation does without
NOTHING_KNOWN = np.array([1.0, 0.0, 0.0, 0.0, 0.0])  # before any parameter is
ROUNDS = 2  # in which the rows' noise, which depends on mass and damping, settles
ONE_WAY = {True: (0, 1, 3), False: (0, 2, 4)}  # columns of motion up alone, or down
SPEED_COLUMNS = (
    (),
    (3,),
    (4,),
    (3, 4),
)  # columns of viscous friction that may stand beside the others
COLUMN_SETS = tuple(
    sorted(((*mass, 1, 2, *speed) for mass in ((), (0,)) for speed in SPEED_COLUMNS), key=len)
)
WHY_NOT = {
    "m": "inertia explains {share} of the force, so it is not told apart; log faster motion",
    "F_v": "constant friction predicts as much of these logs; add runs at other speeds to tell"
    " viscous friction",
    "stick": "no free run was fitted (see the notes), and the force equation does not hold it;"
    " log the body driven by a force, from rest",
}
FALLS_WHY = (
    "found {:.3g} {}: friction falls with speed, which viscous friction does not; 'workbench trace'"
    " looks for why"
)


@dataclass(frozen=True)
class ForceFit:
    """Columns used, coefficients (k,), covariance (k, k), residuals a log, share of inertia in the
    force."""

    used: tuple[int, ...]
    theta: Array
    covariance: Array
    residuals: tuple[Array, ...]
    rms: float
    relative: float
    share: float


def fit_imposed(
    recorded: RecordedLogs, rng: np.random.Generator, why: str, remarks: Sequence[str] = ()
) -> KarnoppFit:
    """Sliding friction from the force equation, the rest named as not identifiable.

    why: what kept a free run from being fitted; it stands in the remarks, after `remarks`.
    Raises NotIdentifiable where no log slides enough in both directions.
    """
    fit, rows = force_fit(recorded)
    return _made(fit, rows, recorded, rng, why, remarks)


def _made(
    fit: ForceFit, rows: Sequence[Rows], recorded: RecordedLogs, rng: np.random.Generator,
    why: str, remarks: Sequence[str],
) -> KarnoppFit:  # fmt: skip
    """A fit of the force equation as one of the machine."""
    logs = recorded.plain
    firsts = [first_estimate(log, held=recorded.held) for log in logs]
    noise_F = float(np.median([one.noise_F for one in recorded.logs]))
    # A motor's force is as exact as its command: what is left is then no noise, but no number too.
    noise_F = max(noise_F, OF_FORCE * max(float(np.std(log["F"])) for log in logs))
    center = np.zeros(5)
    center[list(fit.used)] = fit.theta
    samples = np.tile(center, (NORMAL_SETS, 1))
    drawn = rng.multivariate_normal(fit.theta, fit.covariance, NORMAL_SETS, check_valid="ignore")
    samples[:, list(fit.used)] = drawn
    nine = _assumed(center, firsts, _slightest_mass(rows))
    friction = Karnopp.from_array(nine)
    found = _estimates(fit, nine, samples, rows, recorded)
    names = tuple(FIVE[i] for i in fit.used)
    made = KarnoppFit(
        friction=friction,
        actuator=_motor(recorded),
        estimates=found,
        free=names,
        covariance=fit.covariance,
        samples=drawn,
        drive="command" if recorded.held else "force",
        noise_y=float(np.median([first.motion.noise for first in firsts])),
        noise_F=noise_F,
        chi_square=(fit.rms / noise_F) ** 2,
        adequate=False,
        logs=tuple(
            LogFit(
                log=log.name,
                start=measured_start(log),
                position_rms=float("nan"),
                force_rms=float(np.std(part)),
                chi_square=float(np.mean(part**2)) / noise_F**2,
            )
            for log, part in zip(logs, fit.residuals, strict=True)
        ),
        breakaways=(0, 0),
        evaluations=0,
        remarks=(
            *remarks,
            f"{why}: fitted on the force equation, which leaves {100 * fit.relative:.1f} % of the"
            " force",
        ),
        command_period=recorded.command_period,
        left=(fit.relative, fit.rms),
    )
    return untold(made, fit.relative) if is_unexplained(fit.relative) else made


def is_unexplained(share: float) -> bool:
    """Whether a model leaves so much of the force that none of its numbers holds."""
    return share > MOST_UNEXPLAINED


def untold(fit: KarnoppFit, share: float) -> KarnoppFit:
    """The fit with none of the nine told: its model leaves this share of the force."""
    reason = (
        f"the equation of motion with friction leaves {100 * share:.0f} % of the force: something"
        " larger than friction acts (`workbench trace` looks for it), so no number would hold"
    )
    values = dict(zip(NAMES, fit.friction.array.tolist(), strict=True))
    untold = {
        name: replace(one, value=None, sd=None, low=None, high=None, at_most=None,
                      reason=reason, assumed=values[name])
        if name in NAMES else one
        for name, one in fit.estimates.items()
    }  # fmt: skip
    return replace(fit, estimates=untold)


def _motor(recorded: RecordedLogs) -> Motor | None:
    gives = recorded.rig.force_per_command
    return Motor(gives) if recorded.held and gives is not None else None


def force_fit(recorded: RecordedLogs) -> tuple[ForceFit, list[Rows]]:
    """Sliding friction by the force equation, and the rows that it was fitted on.

    Raises NotIdentifiable where no log slides enough in both directions.
    """
    rows = _rows(recorded)
    up, down = (sum(int(np.count_nonzero(way(part))) for part in rows) for way in (_ups, _downs))
    if min(up, down) < FEWEST_OF_DIRECTION:
        raise NotIdentifiable(
            f"{recorded.name}: {up} windows of sliding in positive and {down} in negative"
            f" direction, at least {FEWEST_OF_DIRECTION} of each needed; log strokes in both"
            " directions"
        )
    return _best(rows), rows


def _ups(rows: Rows) -> BoolArray:
    """Rows in which the body mostly moves up."""
    return np.asarray(rows.X[:, 1] > 0.5)


def _downs(rows: Rows) -> BoolArray:
    """Rows in which it mostly moves down."""
    return np.asarray(rows.X[:, 2] < -0.5)


def fit_one_way(recorded: RecordedLogs, rng: np.random.Generator, why: str) -> KarnoppFit:
    """The equation of motion of logs that move one way: mass, viscous and Coulomb friction.

    Raises NotIdentifiable where they go both ways, or hardly slide.
    """
    moved = _moved(recorded.plain, recorded.held)
    way = _way(moved)
    if way is None:
        raise NotIdentifiable(f"{recorded.name}: no motion one way alone, or hardly any")
    data = [_kept(mechanical(one, NOTHING_KNOWN), one.up == way) for one in moved]
    return _made(_solved(data, ONE_WAY[way]), data, recorded, rng, why, ())


def way_of(logs: Sequence[Log], *, held: bool) -> bool | None:
    """Whether logs move up alone (True) or down alone (False); None: both ways, or hardly."""
    return _way(_moved(logs, held))


def _moved(logs: Sequence[Log], held: bool) -> list[MotionLog]:
    """The logs with their motion, smoothed until its direction is sure."""
    return [motion_log(one, held=held, by_command=False, imposed=True) for one in logs]


def _way(moved: Sequence[MotionLog]) -> bool | None:
    up = np.concatenate([one.up for one in moved])
    share = float(np.mean(up)) if len(up) else 0.5
    return share > 0.5 if len(up) >= FEWEST_JUDGED and is_one_way(share) else None


def of_one_way(fit: KarnoppFit, up: bool, rig: Rig) -> KarnoppFit:
    """The fit of logs that move one way, with Coulomb friction as no such log tells it: together
    with whatever constant force there is."""
    name = "F_cp" if up else "F_cn"
    both = fit.estimates[name]
    if both.value is None:
        return fit
    between = "" if both.low is None else f" ({both.low:.3g} to {both.high:.3g})"
    reason = (
        f"motion one way alone: {both.value:.3g} {units_of(rig.motion)[name]}{between} is friction"
        " and any constant force together; log motion both ways"
    )
    both = replace(both, value=None, sd=None, low=None, high=None, assumed=both.value,
                   reason=reason)  # fmt: skip
    return replace(fit, estimates={**fit.estimates, name: both})


def _kept(rows: Rows, kept: BoolArray) -> Rows:
    return replace(
        rows, b=rows.b[kept], X=rows.X[kept], sd=rows.sd[kept], block=rows.block[kept],
        speed=rows.speed[kept],
    )  # fmt: skip


def _rows(recorded: RecordedLogs) -> list[Rows]:
    """The equation of motion of each log."""
    moved = [motion_log(one, held=recorded.held, by_command=False) for one in recorded.plain]
    theta = NOTHING_KNOWN
    for _ in range(ROUNDS):
        theta = solve_rows(stacked(motion_rows(moved, theta))).theta
    return motion_rows(moved, theta)


def _best(data: Sequence[Rows]) -> ForceFit:
    """The fewest columns that leave hardly more of the force, on blocks that the fit has not seen,
    than those that leave least; a mass that comes out below 0 is none, nor is viscous friction
    that would take Coulomb friction below 0: at speeds alike it stands for anything."""
    every = [_solved(data, used) for used in COLUMN_SETS]
    fits = [one for one in every if _may_be(one)]
    left = [_unseen(data, one.used) for one in fits]
    best = next(x for x, one in zip(fits, left, strict=True) if predicts_as_much(one, min(left)))
    return replace(best, share=every[-1].share)


def _may_be(fit: ForceFit) -> bool:
    """Whether a body can have these parameters; a constant force alone may stand in F_c."""
    found = dict(zip(fit.used, fit.theta, strict=True))
    coulomb = all(found[level] >= 0.0 for level, v in ((1, 3), (2, 4)) if v in found)
    return coulomb and not found.get(0, 1.0) < 0.0


def predicts_as_much(left: float, least: float) -> bool:
    """Whether fewer columns, which leave this of a force that they have not seen, will do."""
    return left <= HARDLY_MORE * least


def _unseen(data: Sequence[Rows], used: tuple[int, ...]) -> float:
    """Force that least squares of these columns leave on blocks that they have not seen."""
    every = stacked(data)
    some = replace(every, X=every.X[:, used])
    left = np.zeros(len(some.b))
    for block in np.unique(some.block):
        out = some.block == block
        left[out] = (some.b - some.X @ solve_rows(some, ~out).theta)[out]
    return float(np.sqrt(np.mean(left**2)))


def _solved(data: Sequence[Rows], used: tuple[int, ...]) -> ForceFit:
    """Weighted least squares of these columns."""
    noise = np.concatenate([part.sd for part in data])
    columns = np.concatenate([part.X for part in data])[:, used]
    force = np.concatenate([part.b for part in data])
    weight = np.median(noise) / noise
    chosen = columns * weight[:, np.newaxis]
    size = np.maximum(np.linalg.norm(chosen, axis=0), 1e-300)
    theta = np.linalg.lstsq(chosen / size, weight * force, rcond=None)[0] / size
    residual = force - columns @ theta
    parts = tuple(np.split(residual, np.cumsum([len(part.b) for part in data])[:-1]))
    independent = effective_samples([part for part in parts if len(part) > 8])
    inverse = np.linalg.pinv((chosen / size).T @ (chosen / size)) / np.outer(size, size)
    square = float(np.mean((weight * residual) ** 2))
    variance = square * len(residual) / max(independent - len(used), 1.0)
    inertia = abs(float(theta[0])) * float(np.std(columns[:, 0])) / max(np.std(force), 1e-300)
    return ForceFit(
        used=used,
        theta=theta,
        covariance=inverse * variance + np.diag((OF_EQUATION * theta) ** 2),
        residuals=parts,
        rms=float(np.sqrt(np.mean(residual**2))),
        relative=float(np.linalg.norm(residual) / max(float(np.linalg.norm(force)), 1e-300)),
        share=float(inertia),
    )


def _slightest_mass(data: Sequence[Rows]) -> float:
    """A mass [kg] whose inertia is next to nothing of the force."""
    rows = stacked(data)
    force, a = (float(np.sqrt(np.mean(x**2))) for x in (rows.b, rows.X[:, 0]))
    return SLIGHT_INERTIA * force / a if force > 0.0 and a > 0.0 else 1.0


def _assumed(center: Array, firsts: Sequence[FirstEstimate], slight: float) -> Array:
    """All nine for simulation: the five of sliding kept to their signs, stick just above slip;
    slight: a mass [kg] that the equation does without."""
    nine = np.median([np.abs(first.nine) for first in firsts], axis=0)
    m = center[0] if center[0] > 0 else slight
    least = 1e-3 * max(float(np.max(np.abs(center[1:3]))), 1e-9)
    coulomb = np.maximum(center[1:3], least)
    viscous = np.maximum(center[3:5], 0.0)
    fastest = float(np.median([float(np.max(np.abs(f.motion.v))) for f in firsts]))
    edge = np.minimum(nine[5:7], WIDEST_ASSUMED * fastest)
    stick = coulomb + viscous * edge
    return np.array([m, *coulomb, *viscous, edge[0], -edge[1], stick[0], -stick[1]])


def _estimates(
    fit: ForceFit, nine: Array, samples: Array, data: Sequence[Rows], recorded: RecordedLogs
) -> dict[str, Estimate]:
    """The five with intervals, the others with the reason."""
    up = int(sum(np.count_nonzero(part.X[:, 1] > 0.5) for part in data))
    down = int(sum(np.count_nonzero(part.X[:, 2] < -0.5) for part in data))
    fastest = float(max(np.max(np.abs(part.X[:, 3:]), initial=0.0) for part in data))
    shown = [i for i in fit.used if i != 0 or fit.share >= INERTIA_SHARE]
    values = np.array([fit.theta[fit.used.index(i)] for i in shown])
    names = [FIVE[i] for i in shown]
    told = _of_sliding(names, values, samples[:, shown], (up, down), fastest, recorded)
    return _reasoned(told, nine, fit.share, recorded)


def left_by(p: Karnopp, recorded: RecordedLogs) -> tuple[float, float, float] | None:
    """Force [N] that a plant leaves of the equation of motion while sliding, that the equation's
    own least squares leave on stretches that they have not seen, and the force itself; root mean
    squares.

    None where too little slides. Of rows faster than the plant's band, in which it says something
    else of friction.
    """
    logs = [motion_log(one, held=recorded.held, by_command=False) for one in recorded.plain]
    theta = np.array([p.m, p.F_cp, p.F_cn, p.F_vp, p.F_vn])
    made = rows_and_windows(logs, theta)
    rows = stacked([one.rows for one in made])
    fast = np.concatenate([one.outside(p) for one in made])
    if np.count_nonzero(fast) < FEWEST_JUDGED:
        return None
    own = (rows.b - rows.X @ theta)[fast]
    unseen = np.zeros(len(rows.b))
    for block in np.unique(rows.block[fast]):
        out = rows.block == block
        best = solve_rows(rows, fast & ~out).theta
        unseen[out] = (rows.b - rows.X @ best)[out]
    own_rms, unseen_rms, whole = (
        float(np.sqrt(np.mean(x**2))) for x in (own, unseen[fast], rows.b[fast])
    )
    return own_rms, unseen_rms, whole


def imposed_estimates(
    plant: Plant, theta: Array, sd: Mapping[str, float], recorded: RecordedLogs
) -> dict[str, Estimate]:
    """The nine of a plant with effects whose motion is imposed; sd: of the five of sliding.

    theta (5,): these as the equations have them, before a plant takes what is negative as 0.
    The same rules as of a fit along an imposed motion say which of them the logs tell.
    """
    names = [name for name in FIVE if name in sd]
    raw = dict(zip(FIVE, theta.tolist(), strict=True))
    kept = {name: float(getattr(plant.friction, name)) for name in names}
    values = np.array([kept[name] if raw[name] > 0.0 else raw[name] for name in names])
    samples = normal_samples(values, np.array([sd[name] for name in names]))
    up = np.concatenate([one.up for one in recorded.logs])
    sliding = (int(np.count_nonzero(up)), int(np.count_nonzero(~up)))
    fastest = float(max(np.max(one.speed, initial=0.0) for one in recorded.logs))
    told = _of_sliding(names, values, samples, sliding, fastest, recorded)
    return _reasoned(told, plant.friction.array, None, recorded)


def _of_sliding(
    names: Sequence[str], values: Array, samples: Array, sliding: tuple[int, int], fastest: float,
    recorded: RecordedLogs,
) -> Mapping[str, Estimate]:  # fmt: skip
    """Estimates of parameters that need no more than sliding; so many rows in each direction."""
    events = Events((0, 0), (0, 0), sliding, (fastest, fastest))
    return estimates(names, values, samples, events, recorded.rig, recorded.name)


def _falls(name: str, one: Estimate) -> bool:
    """Whether friction falls with speed, which predicts a motion but cannot be simulated."""
    return name in VISCOUS_NAMES and one.assumed is not None and one.assumed < 0.0


def _reasoned(
    told: Mapping[str, Estimate], nine: Array, share: float | None, recorded: RecordedLogs
) -> dict[str, Estimate]:
    """All nine: those that are told, and why the others are not; share: of the force, inertia's,
    where it is known."""
    explained = "next to nothing" if share is None else f"{share:.1%}"
    units = ROTARY_UNITS if recorded.rig.motion == "rotary" else UNITS
    out: dict[str, Estimate] = {}
    for key, value in zip(NAMES, nine, strict=True):
        if key in told:
            one = told[key]  # not told: what is assumed has the sign that a friction has
            if _falls(key, one):
                one = replace(one, reason=FALLS_WHY.format(one.assumed, units[key]))
            elif one.value is None:
                one = replace(one, assumed=float(value))
            out[key] = one
            continue
        kind = key if key == "m" else ("F_v" if key.startswith("F_v") else "stick")
        reason = f"{recorded.name}: " + WHY_NOT[kind].format(share=explained)
        out[key] = Estimate(None, units[key], reason=reason, assumed=float(value))
    return out
