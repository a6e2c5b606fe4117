"""Model -> P-PI cascade: gains, a notch or a low-pass where the machine swings, feed-forward."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from design.cascade import TunedCascade, tune_cascade
from design.closed_loop.linear_loop import command_of, delayed, law_to_force, swings_of
from design.drive_law import drive_law
from design.feed_forward import FeedForward
from design.loop_frequencies import loop_frequencies
from design.machine.design import Controller, Design, Linear, Recommended, margin_values
from design.machine.drive import ForceLoop
from design.machine.model import Model, used
from design.machine.readable import number
from design.margins import margins
from design.series_filters import SeriesFilter, filters_against
from design.tracking import Plants
from design.tune import Goals
from identification.arrays import Array
from identification.errors import BadSpecification

FILTER_EARNS = 1.1  # times the bandwidth without it, from which a notch or a low-pass is proposed
BAND_OF_SPEED = 0.01  # of the fastest speed seen, within which Coulomb friction comes on
SHARE_OF_FORCE = 0.9  # of the force that friction leaves, which a step may take
FORCE_BEYOND_LOGS = 2.0  # times the largest force seen, up to which a feed-forward goes
SPEED_BEYOND_LOGS = 1.5  # times the fastest speed seen, up to which a step is moved
UNSEEN_SAMPLES = 0.4  # samples, that motion and force may be apart without a log to show it
FORCE_LAG = 1e-3  # s, that a drive takes to make a force (current loops: 0.1 to 1 ms)
WELL_BELOW = 4.0  # times its poles' frequency, at least, that a resonance lies above them


def tuned_cascade(model: Model, plant: Linear, corners: Plants, goals: Goals) -> TunedCascade:
    """The cascade for a model's plant, with a notch or a low-pass where that earns its place.

    corners: plants inside the parameters' intervals; each counts with the `unseen_lag` too. Raises
    BadSpecification where none is stable.
    """
    own: tuple[Array, Array] = (np.array(plant.A), np.array(plant.B))
    swings = [f for one in swings_of(model) for f in (one.resonance, one.anti_resonance) if f]
    late = unseen_lag(model) / plant.h
    plants = [own, *corners]
    plants, m = [*plants, *((a, delayed(b, late)) for a, b in plants if late)], model.karnopp.m
    goals = replace(goals, effort=effort_of_both(model, own, goals.effort))
    plain = tune_cascade(plants, plant.h, m, goals, swings=swings)
    filters = [one for s in swings_of(model) for one in
               filters_against(s.resonance, s.damping, plant.h)]  # fmt: skip
    if not filters:
        return plain
    filtered = tune_cascade(plants, plant.h, m, goals, filters=filters, swings=swings)
    return better(plain, filtered)


def better(plain: TunedCascade, filtered: TunedCascade) -> TunedCascade:
    """The filtered one where it keeps more goals, or as many and earns its place."""
    if len(filtered.missed) != len(plain.missed):
        return min((plain, filtered), key=lambda one: len(one.missed))
    return filtered if filtered.bandwidth > FILTER_EARNS * plain.bandwidth else plain


def unseen_lag(model: Model) -> float:
    """By how much the motion may follow what a law asks for, beyond what the model has, without a
    log to show it [s]: a part of its samples, and of a force that is logged without the command
    behind it what a drive takes to make one."""
    delay_known = model.lag is not None or "input_delay" in model.effects
    sampled = 0.0 if delay_known else UNSEEN_SAMPLES * model.period
    return sampled + (FORCE_LAG if model.simulated.actuator is None else 0.0)


def effort_of_both(model: Model, plant: tuple[Array, Array], effort: float | None) -> float | None:
    """The largest |S_up| [dB] that a design allows, or that of the present controller if larger:
    what noise asks of the drive now it may ask."""
    now = law_to_force(model)
    if effort is None or now is None:
        return effort
    (law, per), (A, B) = now, plant
    try:
        asked = margins(A, per * B, law.rst).S_up_max_db
    except BadSpecification:  # it is unstable on this plant, or of another period
        return effort
    return effort if asked is None else max(effort, asked + 20.0 * math.log10(abs(per)))


def cascade_controller(
    model: Model, plant: Linear, force: ForceLoop | None, tuned: TunedCascade
) -> Controller:
    """The tuned cascade as a design holds it, with its feed-forward and its reference's limits."""
    rst, gains = tuned.rst, tuned.gains
    ahead = feed_forward(model, force)
    rate, acceleration = reference_limits(model, force, ahead)
    at = loop_frequencies(plant.A, plant.B, rst)
    return Controller(
        R=tuple(rst.R.tolist()),
        S=tuple(rst.S.tolist()),
        T=tuple(rst.T.tolist()),
        h=rst.h,
        dominant=(gains.k_v, 1.0),
        auxiliary=(),
        margins=margin_values(tuned.margins, tuned.worst, at),
        rate=rate,
        lag=0.0,
        overshoot=0.0,
        missed=tuned.missed,
        note=f"disturbances are rejected up to {number(tuned.bandwidth)} Hz (|S_yp| at -3 dB)",
        W=drive_law(rst, gains.T_n).W,
        cascade=gains,
        series=tuned.series,
        feed_forward=ahead,
        acceleration=acceleration,
    )


def feed_forward(model: Model, force: ForceLoop | None) -> FeedForward:
    """What is fed forward of acceleration and friction: the model's own numbers.

    It stays within what a motor gives at its limit, or twice the largest force of the logs.
    """
    p = model.karnopp
    most = min(limit_force(model, force), FORCE_BEYOND_LOGS * model.force_peak)
    fastest = model.speed or float(np.ptp(model.travel))
    return FeedForward(
        p.F_cp, p.F_cn, p.F_vp, p.F_vn, BAND_OF_SPEED * fastest, p.m, max(most, p.F_sp, -p.F_sn)
    )


def limit_force(model: Model, force: ForceLoop | None) -> float:
    """What a motor gives at the limit of its command [N]; infinite where that is not known."""
    command = command_of(model, force)
    if command.force_per_command is None or command.limit is None:
        return math.inf
    return abs(command.force_per_command) * command.limit


def reference_limits(
    model: Model, force: ForceLoop | None, ahead: FeedForward
) -> tuple[float, float]:
    """Speed [m/s] and acceleration [m/s^2] within which the program moves a step of its reference:
    with the force that the logs have shown, less friction."""
    seen = model.speed or float(np.ptp(model.travel))
    viscous, coulomb = max(ahead.F_vp, ahead.F_vn), max(ahead.F_cp, ahead.F_cn)
    most = min(model.force_peak, limit_force(model, force))
    rate = SPEED_BEYOND_LOGS * seen
    if viscous > 0.0:
        rate = min(rate, max(SHARE_OF_FORCE * (most - coulomb) / viscous, 0.1 * seen))
    # Where friction takes all that the logs have shown, a tenth of it accelerates.
    left = most - coulomb - viscous * min(seen, rate)
    return rate, SHARE_OF_FORCE * max(left, 0.1 * most) / ahead.m


def filter_words(one: SeriesFilter) -> str:
    """A filter in the words of a drive's parameter list."""
    if one.kind == "low-pass":
        return (
            f"low-pass of second order at {number(one.frequency)} Hz, damping"
            f" {number(one.denominator, 2)}"
        )
    return (
        f"notch at {number(one.frequency, 4)} Hz, {number(one.width)} Hz wide at -3 dB,"
        f" {number(abs(one.depth_db or 0.0), 3)} dB deep (dampings {number(one.numerator, 2)} and"
        f" {number(one.denominator, 2)})"
    )


def beside_resonance(model: Model, found: Design, chosen: Recommended) -> Iterator[str]:
    """How the loop stands to the model's resonance: its filter, or how far below it stays."""
    assert model.resonance is not None
    resonance = used(model.resonance["frequency"])
    every = found.controllers
    taken = every.get(chosen, next(iter(every.values())))
    said = f"designed on two masses with a resonance at {number(resonance, 4)} Hz"
    if taken.series is not None:
        yield f"{said}, suppressed by a {filter_words(taken.series)}"
        return
    at, what = taken.dominant[0] / (2.0 * np.pi), "the loop's poles lie at"
    if taken.cascade is not None:  # which is not placed by its poles
        at, what = taken.margins.rejection_hz or at, "it rejects disturbances up to"
    where = f"{what} {at:.3g} Hz, {resonance / at:.2g} times below"
    near = resonance < WELL_BELOW * at
    yield f"{said}; {where}{': near, check it on the machine with care' if near else ''}"
