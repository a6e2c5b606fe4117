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
from identification.estimation.regression.inertia import speed_ratios
from identification.estimation.regression.three_step import FirstEstimate, first_estimate
from identification.estimation.regression.weighted_rows import Rows, solve_rows, stacked
from identification.log import Log, Rig
from identification.model.estimates import Estimate, KarnoppFit, LogFit
from identification.model.karnopp import NAMES, ROTARY_UNITS, UNITS, Karnopp
from identification.model.plant import Motor, Plant, units_of
from identification.signals.initial_state import measured_start
from identification.thresholds import MOST_UNEXPLAINED, OTHER_WAY, SPEEDS_APART

INERTIA_SHARE = 0.1  # share of the force below which inertia says nothing of a free body
FEWEST_OF_DIRECTION = 4  # in each direction
FEWEST_JUDGED = 48  # windows of sliding, by which a fit is held against the equation
WIDEST_ASSUMED = 0.06  # of the fastest motion, a stick band that no run has shown
ROUNDS = 2  # in which the rows' noise, which depends on mass and damping, settles
CONDITION = 30.0  # of the scaled columns, beyond which viscous friction is one with Coulomb
ONE_WAY = {True: (0, 1, 3), False: (0, 2, 4)}  # columns of motion up alone, or down
COLUMN_SETS = {"all": (0, 1, 2, 3, 4), "no mass": (1, 2, 3, 4), "constant": (1, 2)}
WHY_NOT = {
    "m": "inertia explains {share} of the force, so it is not told apart; log faster motion",
    "F_v": "the speeds of each direction are too alike to tell viscous from Coulomb friction;"
    " add runs at other speeds",
    "stick": "no free run was fitted (see the notes), and the force equation does not hold it;"
    " log the body driven by a force, from rest",
}


@dataclass(frozen=True)
class ForceFit:
    """Columns used, coefficients (k,), covariance (k, k), residuals a log, share of inertia in the
    force, condition of the scaled columns."""

    used: tuple[int, ...]
    theta: Array
    covariance: Array
    residuals: tuple[Array, ...]
    rms: float
    relative: float
    share: float
    condition: float


def fit_imposed(
    recorded: RecordedLogs,
    rng: np.random.Generator,
    why: str,
    remarks: Sequence[str] = (),
    *,
    by_rig: bool = True,
) -> KarnoppFit:
    """Sliding friction from the force equation, the rest named as not identifiable.

    why: what kept a free run from being fitted; it stands in the remarks, after `remarks`. by_rig:
    a rig leads the body, so that its motion may be smoothed until its direction is sure.
    Raises NotIdentifiable where no log slides enough in both directions.
    """
    fit, rows = force_fit(recorded, by_rig=by_rig)
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
    nine = _assumed(center, firsts)
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


def force_fit(recorded: RecordedLogs, *, by_rig: bool = True) -> tuple[ForceFit, list[Rows]]:
    """Sliding friction by the force equation, and the rows that it was fitted on; by_rig: as above.

    Raises NotIdentifiable where no log slides enough in both directions.
    """
    moved = [
        motion_log(one, held=recorded.held, by_command=False, imposed=by_rig)
        for one in recorded.plain
    ]
    rows = _rows(moved, recorded.name)
    return _best(rows, alike=max(speed_ratios(moved)) < SPEEDS_APART), rows


def fit_one_way(recorded: RecordedLogs, rng: np.random.Generator, why: str) -> KarnoppFit:
    """The equation of motion of logs that move one way: mass, viscous and Coulomb friction.

    Raises NotIdentifiable where they go both ways, or hardly slide.
    """
    moved = _moved(recorded.plain, recorded.held)
    way = _way(moved)
    if way is None:
        raise NotIdentifiable(f"{recorded.name}: no motion one way alone, or hardly any")
    theta = np.array([1.0, 0.0, 0.0, 0.0, 0.0])
    data = [_kept(mechanical(one, theta), one.up == way) for one in moved]
    return _made(_solved(data, ONE_WAY[way]), data, recorded, rng, why, ())


def way_of(logs: Sequence[Log], *, held: bool) -> bool | None:
    """Whether logs move up alone (True) or down alone (False); None: both ways, or hardly."""
    return _way(_moved(logs, held))


def _way(moved: Sequence[MotionLog]) -> bool | None:
    up = np.concatenate([one.up for one in moved])
    share = float(np.mean(up)) if len(up) else 0.5
    return share > 0.5 if len(up) >= FEWEST_JUDGED and is_one_way(share) else None


def is_one_way(share_up: float) -> bool:
    """Whether motion of which so much goes up goes one way alone, up or down."""
    return not OTHER_WAY < share_up < 1.0 - OTHER_WAY


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


def _moved(logs: Sequence[Log], held: bool) -> list[MotionLog]:
    return [motion_log(one, held=held, by_command=False, imposed=True) for one in logs]


def _kept(rows: Rows, kept: BoolArray) -> Rows:
    return replace(
        rows, b=rows.b[kept], X=rows.X[kept], sd=rows.sd[kept], block=rows.block[kept],
        speed=rows.speed[kept],
    )  # fmt: skip


def _rows(logs: Sequence[MotionLog], name: str) -> list[Rows]:
    """The equation of motion in weak form, in windows of sliding, of each log.

    Raises NotIdentifiable where they do not slide enough in both directions.
    """
    up = sum(int(np.count_nonzero(one.up)) for one in logs)
    down = sum(len(one.up) for one in logs) - up
    if min(up, down) < FEWEST_OF_DIRECTION:
        raise NotIdentifiable(
            f"{name}: {up} windows of sliding in positive and {down} in negative direction, at"
            f" least {FEWEST_OF_DIRECTION} of each needed; log strokes in both directions"
        )
    theta = np.array([1.0, 0.0, 0.0, 0.0, 0.0])
    for _ in range(ROUNDS):
        theta = solve_rows(stacked([mechanical(one, theta) for one in logs])).theta
    return [mechanical(one, theta) for one in logs]


def _best(data: Sequence[Rows], alike: bool) -> ForceFit:
    """The largest set of columns that the motion tells apart; alike: whether its speeds are."""
    made = _solved(data, COLUMN_SETS["all"])
    inertia = made.share
    for name in ("all", "no mass", "constant"):
        if name != "all":
            made = _solved(data, COLUMN_SETS[name])
        if name == "all" and (made.theta[0] <= 0 or inertia < INERTIA_SHARE):
            continue
        if alike and name == "no mass":
            continue
        if made.condition < CONDITION:
            break
    return replace(made, share=inertia)


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
        covariance=inverse * variance,
        residuals=parts,
        rms=float(np.sqrt(np.mean(residual**2))),
        relative=float(np.linalg.norm(residual) / max(float(np.linalg.norm(force)), 1e-300)),
        share=float(inertia),
        condition=float(np.linalg.cond(chosen / size)),
    )


def _assumed(center: Array, firsts: Sequence[FirstEstimate]) -> Array:
    """All nine for simulation: the five of sliding kept to their signs, stick just above slip."""
    nine = np.median([np.abs(first.nine) for first in firsts], axis=0)
    m = center[0] if center[0] > 0 else nine[0]
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
    used = [FIVE[i] for i in fit.used]
    told = _of_sliding(used, fit.theta, samples[:, list(fit.used)], (up, down), fastest, recorded)
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
    rows = stacked([mechanical(one, theta) for one in logs])
    fast = rows.speed > np.where(rows.X[:, 1] > 0.5, p.dv_p, -p.dv_n)
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
            out[key] = one if one.value is not None else replace(one, assumed=float(value))
            continue
        kind = key if key == "m" else ("F_v" if key.startswith("F_v") else "stick")
        reason = f"{recorded.name}: " + WHY_NOT[kind].format(share=explained)
        out[key] = Estimate(None, units[key], reason=reason, assumed=float(value))
    return out
