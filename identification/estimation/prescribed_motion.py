"""Friction where the motion is prescribed and the force is what is measured.

A rig that drives the body along a given path shows friction as a force, not in the response: a
free run has nothing to follow there. The parameters then come from the force equation alone, and
those that only a free body shows (mass in slow motion, stick limits, band) are not given.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import block_diag
from scipy.stats import t

from identification.arrays import Array
from identification.errors import NotIdentifiable
from identification.estimation.estimates import (
    Events,
    estimates,
    reported_estimate,
    silent_reason,
)
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regressed_plant import first_plant, motor_of
from identification.estimation.regression.equation_rows import (
    FIVE,
    OF_FORCE,
)
from identification.estimation.regression.force_terms import (
    ForceFit,
    Lateness,
    fewest_terms,
    of_one_speed,
)
from identification.estimation.regression.motion_log import motion_log
from identification.estimation.regression.motion_rows import (
    MotionRows,
    are_enough,
    converged_rows,
    usual_fastest,
    without_reversals,
)
from identification.estimation.regression.row_fit import rms
from identification.estimation.regression.weighted_rows import (
    Rows,
    inverse_of_gram,
    solve_rows,
    stacked,
    with_model_error,
)
from identification.log import Log, Rig
from identification.model.estimates import NORMAL_95, Estimate, KarnoppFit, LogFit
from identification.model.karnopp import NAMES, ROTARY_UNITS, UNITS, VISCOUS_NAMES, Karnopp
from identification.model.plant import Plant, units_of
from identification.signals.initial_state import measured_start
from identification.signals.one_way import is_one_way
from identification.signals.steady_speed import steady_speed
from identification.thresholds import HALF, WORSE

INERTIA_SHARE = 0.1  # share of the force below which inertia says nothing of a free body
FEWEST_OF_DIRECTION = 4  # in each direction
FEWEST_COMPARED = 48  # windows of sliding, by which a fit is compared with the equation
WIDEST_ASSUMED = 0.06  # of fast sliding, a stick band that no run has shown
SLIGHT_INERTIA = 1e-3  # of the force, of a mass that the equation does without
WHY_NOT = {
    "m": "inertia explains {share} of the force: the mass is not identifiable; log faster motion",
    "as well": "the force is predicted as well without inertia: the mass is not identifiable; log"
    " faster motion",
    "F_v": "constant friction predicts as much of these logs; add runs at other speeds to"
    " identify viscous friction",
    "F_c": "viscous friction alone predicts as much of these logs; add slow motion to identify"
    " Coulomb friction",
    "stick": "no free run gives it (see the notes), and it is not in the force equation;"
    " log the body driven by a force, from rest",
}
COLUMNS_OF_WAYS = ((1, 3), (2, 4))  # columns of Coulomb and viscous friction of each direction
LEVELS_MORE = "log other constant forces that way"
STRAIGHT_WHY = "as many steady speeds as parameters: that friction is linear in speed is assumed"
UNSETTLED = "left out, since its speed does not settle"
FALLS_WHY = (
    "found {:.3g} {}: friction falls with speed, which viscous friction does not, so the Coulomb"
    " level is that at the speeds logged; 'workbench trace' searches for the cause"
)


def fit_prescribed(recorded: RecordedLogs, why: str) -> KarnoppFit:
    """Sliding friction from the force equation, the rest named as not identifiable.

    why: what kept a free run from being fitted; it is the first of the remarks.
    Raises NotIdentifiable where no log slides enough in both directions. Source: weak form,
    Messenger, Bortz (2021), of the inverse dynamic model, Gautier, Khalil, CDC 1988.
    """
    fit, made = force_fit(recorded)
    return _made(fit, [one.rows for one in made], recorded, why)


def _made(fit: ForceFit, rows: Sequence[Rows], recorded: RecordedLogs, why: str) -> KarnoppFit:
    """A fit of the force equation as one of the machine."""
    logs, (noise_y, noise_F) = recorded.plain, recorded.noise
    # A motor's force is as exact as its command: what is left is then no noise, but no number too.
    noise_F = max(noise_F, OF_FORCE * max(float(np.std(log["F"])) for log in logs))
    squares = [(left / part.sd) ** 2 for left, part in zip(fit.residuals, rows, strict=True)]
    center, logged = np.zeros(5), fit.at_logged_speeds(stacked(rows))
    center[list(fit.used)] = logged.theta
    nine = _assumed(center, recorded, stacked(rows))
    friction = Karnopp.from_array(nine)
    found = _estimates(logged, nine, rows, recorded)
    names = tuple(FIVE[i] for i in fit.used)
    made = KarnoppFit(
        friction=friction,
        actuator=motor_of(recorded.rig),
        estimates=found,
        free=names,
        covariance=logged.covariance,
        drive="command" if recorded.by_motor else "force",
        noise_y=noise_y,
        noise_F=noise_F,
        chi_square=float(np.mean(np.concatenate(squares))),
        adequate=False,
        logs=tuple(
            LogFit(
                log=log.name,
                start=measured_start(log),
                position_rms=float("nan"),
                force_rms=float(np.std(part)),
                chi_square=float(np.mean(square)),
            )
            for log, part, square in zip(logs, fit.residuals, squares, strict=True)
        ),
        breakaways=(0, 0),
        remarks=(
            f"{why}: fitted on the force equation, which leaves {100 * fit.relative:.1f} % of the"
            " force",
        ),
        command_period=recorded.command_period,
        left=(fit.relative, fit.rms),
        falling=_falling(fit, recorded),
    )
    return without_estimates(made, fit.relative) if is_unexplained(fit.relative) else made


def is_unexplained(share: float) -> bool:
    """Whether a model leaves so much of the force that none of its numbers holds."""
    return share > HALF


def without_estimates(fit: KarnoppFit, share: float) -> KarnoppFit:
    """The fit with none of the nine reported: its model leaves this share of the force."""
    return withheld(
        fit,
        f"the equation of motion with friction leaves {100 * share:.0f} % of the force: something"
        " larger than friction acts (`workbench trace` searches for it), so no estimate is valid",
    )


def withheld(fit: KarnoppFit, reason: str) -> KarnoppFit:
    """The fit with none of the nine reported, for this reason."""
    values = dict(zip(NAMES, fit.friction.array.tolist(), strict=True))
    none = {name: fit.estimates[name].withheld(reason, x) for name, x in values.items()}
    return replace(fit, estimates={**fit.estimates, **none})


def together_alone(steady: Rows, way: tuple[int, int], rig: Rig, add: str) -> dict[str, str]:
    """Why neither of the two of a direction is given, by name; steady: rows of sliding in it; add:
    what to log."""
    level, slope = (FIVE[k] for k in way)
    factor, unit = (1.0, "rad/s") if rig.motion == "rotary" else (1e3, "mm/s")
    v = factor * float(np.median(np.abs(steady.X[:, way[1]])))
    force = solve_rows(replace(steady, X=steady.X[:, (0, way[0])])).theta[1]
    why = (
        f"sliding of one speed, {v:.3g} {unit}, shows {level} and {slope} together alone,"
        f" {force:.3g} {units_of(rig.motion)[level]} there; {add}"
    )
    return {level: why, slope: why}


def fit_by_steady_speeds(recorded: RecordedLogs, why: str) -> KarnoppFit | None:
    """Sliding friction from the steady speeds of logs of one constant force each, F = F_c + F_v v,
    and the mass from how long they take to settle, m = F_v tau; None where no direction has two.

    why: as of `fit_prescribed`. The intervals have the errors of the speeds and, of more logs than
    parameters, the scatter between them (Student's t). Source: Aitken, Proc. R. Soc. Edinburgh 55
    (1936) 42; the order of steps is ours.
    """
    tried = [(one, steady_speed(one.log["t"], one.log["y"], one.noise.y)) for one in recorded.logs]
    settled = [(one, steady) for one, steady in tried if steady is not None]
    recorded = replace(recorded, logs=tuple(one for one, _ in settled))
    v, v_sd, tau, tau_sd, left = np.array([steady for _, steady in settled]).reshape(-1, 5).T
    force, up = np.array([one.log["F"][0] for one, _ in settled]), v > 0.0
    X, order = np.column_stack([0.0 * v, up, -1.0 * ~up, v * up, v * ~up]), np.arange(len(v))
    rows = Rows(force, X, v_sd, order, np.abs(v), FIVE)
    ways = [way for way in COLUMNS_OF_WAYS if np.any(X[:, way[0]])]
    alike = [way for way in ways if of_one_speed(rows, way[1], WORSE)]
    if len(alike) == len(ways):
        return None
    used = (*(way[0] for way in ways), *(way[1] for way in ways if way not in alike))
    slopes = np.zeros(len(FIVE))
    slopes[list(used)] = solve_rows(replace(rows, X=X[:, used])).theta
    slope = np.abs(np.where(up, slopes[3], slopes[4]))
    shows = slope > 0.0  # of one speed, the slope of the other direction stands for its error
    rows = replace(rows, sd=v_sd * np.where(shows, slope, np.max(slope)))
    theta, spread = _with_scatter(replace(rows, X=X[:, used]))
    masses = replace(rows, b=slope * tau, X=np.ones((len(v), 1)), sd=slope * tau_sd).at(shows)
    mass, mass_spread = _with_scatter(masses)
    unsure = np.diag(spread) / theta**2  # a mass is as unsure as the slopes, too
    mass_spread += np.max(unsure[len(ways) :]) * mass**2
    missing = force - X[:, used] @ theta
    fit = ForceFit(
        used=(0, *used), theta=np.append(mass, theta), covariance=block_diag(mass_spread, spread),
        residuals=tuple(missing[:, np.newaxis]), rms=rms(missing), share=1.0,
        relative=rms(missing) / rms(force),
    )  # fmt: skip
    made = _made(fit, [rows.at(order == i) for i in order], recorded, why)
    found = dict(made.estimates)
    for way in alike:
        here = rows.at(X[:, way[0]] != 0.0)
        for name, reason in together_alone(here, way, recorded.rig, LEVELS_MORE).items():
            found[name] = found[name].withheld(reason, getattr(made.friction, name))
    said = [f"{why}: friction is that of {len(v)} steady speeds"]
    said += [] if len(v) > len(used) else [STRAIGHT_WHY]
    said += [f"{one.log.name}: {UNSETTLED}" for one, steady in tried if steady is None]
    off = float(np.mean((left / [one.noise.y for one, _ in settled]) ** 2))
    return replace(made, estimates=found, remarks=tuple(said), left=None, chi_square=off)


def _with_scatter(rows: Rows) -> tuple[Array, Array]:
    """Parameters (k,) of a few rows, and their covariance, by which 1.96 deviations are the 95 %
    interval of Student's t. Source: Student, Biometrika 6 (1908) 1."""
    rows = with_model_error(rows)
    free = len(rows.b) - rows.X.shape[1]
    times = t.ppf(0.975, free) / NORMAL_95 if free > 0 else 1.0
    covariance = times**2 * inverse_of_gram(rows.X / rows.sd[:, np.newaxis])
    return solve_rows(rows).theta, covariance


def force_fit(recorded: RecordedLogs) -> tuple[ForceFit, list[MotionRows]]:
    """Sliding friction by the force equation, and the rows that it was fitted on; of motion one way
    alone, that way's.

    Raises NotIdentifiable where no log slides enough. Source: weak form, Messenger, Bortz (2021);
    terms by cross-validation, Stone (1974).
    """
    every = converged_rows(recorded.logs)
    made = without_reversals(every)
    ways = np.concatenate([one.up for one in made])
    up, down = (int(np.count_nonzero(ways == way)) for way in (True, False))
    way = _way(up / len(ways)) if are_enough(made) else None
    if way is not None:
        every = made = [one.at(one.up == way) for one in made]
    elif min(up, down) < FEWEST_OF_DIRECTION:
        raise NotIdentifiable(
            f"{recorded.name}: {up} windows of sliding in positive and {down} in negative"
            f" direction, at least {FEWEST_OF_DIRECTION} of each needed; log strokes in both"
            " directions"
        )
    rows = [one.rows for one in made]
    late = None if recorded.zoh else Lateness.of([one.windows for one in made], recorded.plain)
    return fewest_terms(rows, late, stacked([one.rows for one in every]), way), made


def way_of(logs: Sequence[Log], *, zoh: bool) -> bool | None:
    """Whether logs slide up alone (True) or down alone (False); None: both ways, or hardly.

    By windows of sliding, of quick motion, which has few of them, by samples.
    """
    # Smoothed until its direction is significant.
    moved = [motion_log(one, zoh=zoh, by_command=False, prescribed=True) for one in logs]
    up = np.concatenate([one.up for one in moved])
    if len(up) < FEWEST_COMPARED:
        d = np.concatenate([one.signals["d"] for one in moved])
        up = d[d != 0.0] > 0.0
    return _way(float(np.mean(up))) if len(up) else None


def _way(share: float) -> bool | None:
    """The way of motion of which such a share is up, as `way_of`."""
    return share > 0.5 if is_one_way(share) else None


def of_one_way(fit: KarnoppFit, up: bool, rig: Rig) -> KarnoppFit:
    """The fit of logs that move one way, with Coulomb friction and stick limit not identifiable:
    together with whatever constant force there is."""
    units, found = units_of(rig.motion), dict(fit.estimates)
    for name in ("F_cp", "F_sp") if up else ("F_cn", "F_sn"):
        both = found[name]
        if both.value is not None:
            between = "" if both.low is None else f" ({both.low:.3g} to {both.high:.3g})"
            reason = (
                f"motion one way alone: {both.value:.3g} {units[name]}{between} is friction and any"
                " constant force together; log motion both ways"
            )
            found[name] = both.withheld(reason, both.value)
    return replace(fit, estimates=found)


def _slightest_mass(rows: Rows, h: float) -> float:
    """A mass [kg] whose inertia is next to nothing of the force, even where the fastest motion of
    the rows would reverse from one sample, h [s], to the next: at constant speed the windows' own
    acceleration is next to none, by which a mass of many kg would be slight."""
    force, a = float(np.sqrt(np.mean(rows.b**2))), 2.0 * usual_fastest(rows.speed) / h
    return SLIGHT_INERTIA * force / a if force > 0.0 and a > 0.0 else 1.0


def _assumed(center: Array, recorded: RecordedLogs, rows: Rows) -> Array:
    """All nine for simulation: the five of sliding of their signs, a band far below fast sliding,
    stick just above slip."""
    first = first_plant(recorded).friction
    m = center[0] if center[0] > 0 else _slightest_mass(rows, recorded.plain[0].h)
    least = 1e-3 * max(float(np.max(np.abs(center[1:3]))), 1e-9)
    coulomb = np.maximum(center[1:3], least)
    viscous = np.maximum(center[3:5], 0.0)
    edge = np.minimum([first.dv_p, -first.dv_n], WIDEST_ASSUMED * usual_fastest(rows.speed))
    stick = coulomb + viscous * edge
    return np.array([m, *coulomb, *viscous, edge[0], -edge[1], stick[0], -stick[1]])


def _estimates(
    fit: ForceFit, nine: Array, data: Sequence[Rows], recorded: RecordedLogs
) -> dict[str, Estimate]:
    """The five with intervals, the others with the reason."""
    fastest = float(max(np.max(np.abs(part.X[:, 3:]), initial=0.0) for part in data))
    sizes = zip(fit.used, fit.theta.tolist(), strict=True)
    values = {FIVE[i]: x for i, x in sizes if i != 0 or fit.share >= INERTIA_SHARE}
    known = _of_sliding(values, fit.sd, fastest, recorded)
    return _reasoned(known, nine, fit.share, recorded)


def prescribed_estimates(
    plant: Plant, theta: Array, sd: Mapping[str, float], recorded: RecordedLogs
) -> dict[str, Estimate]:
    """The nine of a plant with effects under prescribed motion; sd: of the five of sliding.

    theta (5,): these as the equations have them, before a plant takes what is negative as 0.
    The same rules as of a fit along a prescribed motion decide which of them are identifiable.
    """
    raw = zip(FIVE, theta.tolist(), strict=True)
    values = {n: float(getattr(plant.friction, n)) if x > 0.0 else x for n, x in raw if n in sd}
    fastest = float(max(np.max(one.speed, initial=0.0) for one in recorded.logs))
    known = _of_sliding(values, sd, fastest, recorded)
    return _reasoned(known, plant.friction.array, None, recorded)


def _of_sliding(
    values: Mapping[str, float], sd: Mapping[str, float], fastest: float, recorded: RecordedLogs
) -> Mapping[str, Estimate]:
    """Estimates of parameters that need no more than sliding, by the samples in which it shows."""
    return estimates(values, sd, _sliding(fastest, recorded), recorded.rig, recorded.name)


def _sliding(fastest: float, recorded: RecordedLogs) -> Events:
    """The samples in which the body surely slides, by direction; fastest [m/s]."""
    return Events((0, 0), (0, 0), recorded.moved, (fastest, fastest))


def _falling(fit: ForceFit, recorded: RecordedLogs) -> dict[str, Estimate]:
    """Slopes below 0 with which friction falls with speed, and its levels at rest beside them: they
    predict a motion, but would drive a body that is simulated."""
    units, sizes = units_of(recorded.rig.motion), dict(zip(fit.used, fit.theta, strict=True))
    names = [(FIVE[i], float(sizes[i])) for both in fit.falling for i in both]
    return {name: reported_estimate(x, units[name], fit.sd[name]) for name, x in names}


def _reasoned(
    known: Mapping[str, Estimate], nine: Array, share: float | None, recorded: RecordedLogs
) -> dict[str, Estimate]:
    """All nine: those that are identifiable, and why the others are not; share: of the force,
    inertia's, where it is known."""
    explained = "next to nothing" if share is None else f"{share:.1%}"
    units = ROTARY_UNITS if recorded.rig.motion == "rotary" else UNITS
    out: dict[str, Estimate] = {}
    sliding = _sliding(0.0, recorded)
    for key, value in zip(NAMES, nine, strict=True):
        if key in known:
            one = known[key]  # without a value: what is assumed has the sign of friction
            if one.value is None:
                falls = key in VISCOUS_NAMES and one.assumed is not None and one.assumed < 0.0
                why = FALLS_WHY.format(one.assumed, units[key]) if falls else one.reason
                one = replace(one, reason=why, assumed=float(value))
            out[key] = one
            continue
        if key == "m":  # other terms may take the place of an inertia that is of account
            kind = "as well" if share is not None and share >= INERTIA_SHARE else "m"
        else:
            kind = "stick" if key.startswith(("dv", "F_s")) else key[:3]
        rests = silent_reason(key, sliding, recorded.name) if key in FIVE else None
        reason = rests or f"{recorded.name}: " + WHY_NOT[kind].format(share=explained)
        out[key] = Estimate(None, units[key], reason=reason, assumed=float(value))
    return out
