"""Model -> Design: PID and RST by pole placement, P-PI cascade, compensator, margins."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from design.closed_loop.linear_loop import (
    command_of,
    corners,
    linear_of,
    periods,
    stiff_body,
    swings_of,
    unknown_viscous,
)
from design.closed_loop.local_friction import asked_for
from design.closed_loop.loop_figures import COMPENSATED
from design.controllers.cascade import (
    beside_resonance,
    cascade_controller,
    limit_force,
    tuned_cascade,
)
from design.controllers.clear_win import CLEARLY_LESS
from design.controllers.recommend import compared, own_figures, reasons, recommended
from design.controllers.usual_compensator import usual_compensator
from design.drawn_loops import DrawnPlants
from design.drive_law import drive_law
from design.loop_frequencies import loop_frequencies
from design.machine.design import (
    DESIGNED_STRUCTURES,
    Controller,
    Design,
    From,
    Linear,
    Recommendation,
    Structure,
    margin_values,
)
from design.machine.drive import ForceLoop
from design.machine.model import Model, used
from design.machine.plausible import bandwidth_remarks, stored_remarks
from design.machine.readable import Display, number
from design.machine.versions import versions
from design.tracking import Demand
from design.tune import Asked, Goals, Tuned, tune_pid, tune_rst
from identification.arx.design_period import check_period
from identification.errors import BadModel, BadSpecification
from identification.model.plant import Actuator, Motor
from identification.remarks import MinorRemark

FINEST = 20  # times faster than its logs that a controller may be designed
LARGEST_STEP = 0.5  # of the travel seen in the logs, that a reference may take at once
SLOWED = 4  # times that a controller is made slower for the sake of its reference
ENOUGH = 0.95  # of the w_n that would just do
SLOWEST_CUT = 0.3  # of its w_n that is left at once, at least
OVERSHOOT = 0.05  # of a step, in the linear loop
NOISE_SHARE = 0.05  # of the Coulomb force that the position's noise may ask for
POLES_PLACED: tuple[Structure, ...] = ("rst", "pid")


def design(
    model: Model,
    asked: Asked | None = None,
    *,
    goals: Goals | None = None,
    source: From | None = None,
    period: float | None = None,
    structures: Sequence[Structure] | None = None,
) -> Design:
    """Controllers for a model with margins; poles searched where not asked.

    structures: RST and PID by pole placement, a P-PI cascade; by default the first two, and the
    cascade where the machine swings or has one now. source: the linear plant to design on, by
    default the sounder. period: of the position controller [s], by default the shortest of
    `periods` at which a controller keeps every goal.
    Raises BadSpecification where no controller meets what was asked, NotIdentifiable where the
    model carries no design.
    """
    for one in set(structures or ()) - set(DESIGNED_STRUCTURES):
        raise BadSpecification(f"structure {one!r}: {', '.join(DESIGNED_STRUCTURES)} are designed")
    usual = usual_structures(model, asked)
    first = placed_design(
        model, asked, goals=goals, source=source, period=period, structures=structures or usual
    )
    found = with_choice(model, first, recommended(model, first))
    by_itself = structures is None and (asked is None or asked == Asked())
    if not by_itself or "p-pi" in usual or not isinstance(model.simulated.actuator, Motor):
        return found
    try:
        cascade = placed_design(
            model, goals=goals, source=source, period=period, structures=("p-pi",)
        )
    except BadSpecification:
        return found
    return replace(found, remarks=(*found.remarks, *_tracks_better(model, cascade, found)))


def _tracks_better(model: Model, cascade: Design, found: Design) -> Iterator[str]:
    """What the P-PI of a motor's axis would do, where it would track clearly better than what is
    recommended, and the command that makes it."""
    choice, its = found.recommendation, compared(model, cascade)
    if choice is None or choice.controller == "none" or not its["p-pi"].passed:
        return
    taken = choice.controller + (COMPENSATED if choice.compensator else "")
    ours = compared(model, found)[taken].smooth_relative
    if its["p-pi"].smooth_relative < CLEARLY_LESS * ours and not _least_missed(cascade):
        figures = reasons("p-pi", False, {"p-pi": its["p-pi"]}, model.display)
        yield (
            f"a P-PI, the cascade of most drives, would track better: {own_figures(figures)};"
            " 'workbench design MODEL --structure p-pi' makes it"
        )


def usual_structures(model: Model, asked: Asked | None) -> tuple[Structure, ...]:
    """The structures that are designed where nobody says; poles that are asked for have no P-PI."""
    by_hand = asked is not None and (asked.dominant is not None or asked.auxiliary is not None)
    now = model.controller
    cascade = model.resonance is not None or (now is not None and now.kind == "P-PI")
    asks_none = asked is not None and not asked.integrator
    return POLES_PLACED if by_hand or asks_none or not cascade else (*POLES_PLACED, "p-pi")


def with_choice(model: Model, first: Design, chosen: Recommendation) -> Design:
    """The design with a controller recommended."""
    return replace(
        first,
        recommended=chosen.controller,
        recommendation=chosen,
        remarks=(*first.remarks, *_remarks(model, first, chosen)),
    )


DrawnFor = Callable[[Linear, ForceLoop | None], DrawnPlants]


def placed_design(
    model: Model,
    asked: Asked | None = None,
    *,
    goals: Goals | None = None,
    source: From | None = None,
    period: float | None = None,
    drawn: DrawnFor | None = None,
    structures: Sequence[Structure] = POLES_PLACED,
) -> Design:
    """The controllers of `design`, of which none is recommended yet.

    drawn: machines on so many of which the goals must hold, in place of the corners of the model's
    intervals, as the loop of a linear plant sees them.
    """
    asked = asked or Asked()
    _check_period(period, model)
    goals = goals or Goals(effort=effort_limit(model))
    first, _ = linear_of(model, source, period)
    tried: list[Design] = []
    slower: list[str] = []  # why not at a shorter period
    refusal: BadSpecification | None = None
    every = (first.h,) if period is not None or first.source == "arx" else periods(model)
    for h in every:
        try:
            linear = linear_of(model, source, h)
            found = _placed_at(model, asked, goals, linear, drawn, structures)
        except BadSpecification as error:
            refusal = refusal or error
            slower.append(f"not every {1e3 * h:.4g} ms: {error}")
            continue
        missed = _least_missed(found)
        if not missed:
            return replace(found, remarks=(*found.remarks, *slower))
        tried.append(found)
        slower.append(f"not every {1e3 * h:.4g} ms: {', '.join(missed)}")
    if not tried:
        raise refusal or BadSpecification("no sampling period to try; give --design-period")
    return min(tried, key=lambda one: len(_least_missed(one)))


def _least_missed(found: Design) -> tuple[str, ...]:
    """What the controller misses that misses the fewest goals."""
    return min((one.missed for one in found.controllers.values()), key=len)


def _followable(tune: Callable[..., Tuned], goals: Goals, speed: float | None) -> Tuned:
    """The controller, slowed down until it may be moved at the speed [m/s] that the logs show.

    A reference that starts at a speed v asks for about m w_n v of force: the faster the loop, the
    slower what it may follow.
    """
    found = tune(goals=goals)
    for _ in range(SLOWED):
        rate = found.followed.rate
        if speed is None or rate is None or rate >= speed:
            break
        try:
            fastest = ENOUGH * found.dominant[0] * max(rate / speed, SLOWEST_CUT)
            slower = tune(goals=replace(goals, fastest=fastest))
        except BadSpecification:
            break
        if slower.missed or slower.dominant[0] >= found.dominant[0]:
            break
        found = slower
    return found


def _placed_at(
    model: Model, asked: Asked, goals: Goals, linear: tuple[Linear, ForceLoop | None],
    drawn: DrawnFor | None, structures: Sequence[Structure],
) -> Design:  # fmt: skip
    """The controllers on a linear plant, above its force loop."""
    plant, force = linear
    machines = None if drawn is None else drawn(plant, force)
    found: dict[Structure, Controller] = {}
    refused, of_poles = dict[str, str](), goals
    a, b = stiff_body(model, plant, force)
    whole = (np.array(plant.A), np.array(plant.B)) if swings_of(model) else None
    others, demand = corners(model, plant, force), reference_demand(model, force)
    if model.resonance is not None:  # on one body, no faster than where two masses are still one
        most = 2.0 * np.pi * used(model.resonance["frequency"])
        of_poles = replace(goals, fastest=min(most, goals.fastest or most))
    placers: dict[Structure, Callable[..., Tuned]] = {"rst": tune_rst, "pid": tune_pid}
    for name, tune in placers.items():
        if name not in structures:
            continue
        if name == "pid" and not asked.integrator:
            refused[name] = "a PID has an integrator; asked for none"
            continue
        auxiliary = None if name == "pid" else asked.auxiliary
        wanted = replace(asked, whole=whole, auxiliary=auxiliary)
        try:
            tuned = partial(
                tune, a, b, plant.h, wanted, corners=others, demand=demand, drawn=machines
            )
            followed = _followable(tuned, of_poles, None if wanted.dominant else model.speed)
            found[name] = _controller(followed, plant, model.display)
        except BadSpecification as error:
            refused[name] = str(error)
    if "p-pi" in structures:
        try:
            cascade = tuned_cascade(model, plant, others, goals)
            found["p-pi"] = cascade_controller(model, plant, force, cascade)
        except BadSpecification as error:
            refused["p-pi"] = str(error)
    by_hand = asked.dominant is not None or asked.auxiliary is not None
    if not found or ("rst" in refused and by_hand):
        raise BadSpecification(next(iter(refused.values())))
    return _design_of(model, linear, found, refused)


def _design_of(
    model: Model, linear: tuple[Linear, ForceLoop | None],
    controllers: Mapping[Structure, Controller], refused: Mapping[str, str],
) -> Design:  # fmt: skip
    """The controllers as a design, with the compensator beside them; none is recommended yet."""
    plant, force = linear
    return Design(
        card=model.card,
        motion=model.rig.motion,
        plant=plant,
        force=force,
        rst=controllers.get("rst"),
        pid=controllers.get("pid"),
        p_pi=controllers.get("p-pi"),
        refused=refused,
        recommended="none",
        compensator=usual_compensator(model, plant.h, controllers.values()),
        remarks=(
            *model.read,
            *stored_remarks(model),
            *bandwidth_remarks([one.dominant[0] for one in controllers.values()], model.rig),
        ),
        versions=versions(),
        command=command_of(model, force),
        present=model.controller,
        lacks=model.lacks,
    )


def _check_period(period: float | None, model: Model) -> None:
    """Raises BadModel where a period [s] is far from what the model's logs show."""
    longest = max(model.log, key=lambda entry: entry.duration)
    check_period(period, longest.file, longest.duration)
    fastest = model.period
    if period is not None and period < fastest / FINEST:
        raise BadModel(
            f"design period {period:g} s, the model's logs were sampled every {fastest:g} s; ask"
            f" for at least {fastest / FINEST:.3g}"
        )


def reference_demand(model: Model, force: ForceLoop | None) -> Demand:
    """What a step of the reference may ask of this machine.

    Of force what the logs show at most, less the stick limit; of the command the rig's limit.
    """
    p, actuator, limit = model.karnopp, model.simulated.actuator, model.rig.control_limit
    low, high = model.travel
    most, command = min(model.force_peak, limit_force(model, force)), None
    per_jump, per_speed = 0.0, 0.0
    if isinstance(actuator, Actuator) and force is not None:
        command, per_jump = limit, force.k_i
        per_speed = abs(actuator.k2 / actuator.k1)
    left = most - max(p.F_sp, -p.F_sn, p.F_cp, p.F_cn)
    return Demand(
        step=LARGEST_STEP * (high - low),
        overshoot=OVERSHOOT,
        force=left if left > 0 else None,
        command=command,
        per_jump=per_jump,
        per_speed=per_speed,
    )


def effort_limit(model: Model) -> float | None:
    """Largest |S_up| [dB]: the position's noise may ask for a fifth of the Coulomb force."""
    p = model.karnopp
    coulomb = 0.5 * (p.F_cp + p.F_cn)
    if not (coulomb > 0 and model.fit.noise_y > 0):
        return None
    return float(20 * np.log10(NOISE_SHARE * coulomb / model.fit.noise_y))


def _controller(tuned: Tuned, plant: Linear, display: Display) -> Controller:
    rst, pid, taken = tuned.rst, tuned.pid, tuned.followed
    return Controller(
        R=tuple(rst.R.tolist()),
        S=tuple(rst.S.tolist()),
        T=tuple(rst.T.tolist()),
        h=rst.h,
        dominant=tuned.dominant,
        auxiliary=tuple((z.real, z.imag) for z in tuned.auxiliary),
        margins=margin_values(tuned.margins, tuned.worst, loop_frequencies(plant.A, plant.B, rst)),
        rate=taken.rate,
        lag=taken.lag,
        overshoot=taken.overshoot,
        missed=tuned.missed,
        gains=None if pid is None else pid.gains,
        note="; ".join(_notes(tuned, display)),
        # Where all of a controller forgot at once what a limit cut off, loops went on at the limit
        # for ever after large steps (EMPS at 4 V, both ways half of the time).
        W=drive_law(rst, 1.0 / tuned.dominant[0]).W,
    )


def _notes(tuned: Tuned, display: Display) -> Iterator[str]:
    """What to know of a controller's reference and form, in words."""
    pid, rate = tuned.pid, tuned.followed.rate
    if pid is not None and pid.gains is not None:
        b, c = (round(one, 6) + 0.0 for one in (pid.gains.b, pid.gains.c))
        yield f"set-point weights b = {b:.3g}, c = {c:.3g}"
    yield f"follows a ramp {1e3 * tuned.followed.lag:.3g} ms behind"
    if rate is not None:
        step, (speed, factor) = rate * tuned.rst.h, display.shown("velocity")
        yield (
            f"move the reference by at most {display.length_text(step)} in a sample"
            f" ({number(factor * rate)} {speed})"
        )
    if pid is not None and (said := pid.note or pid.reason):
        yield said


def _remarks(model: Model, found: Design, chosen: Recommendation) -> list[str]:
    out = list[str]()
    if chosen.controller == "none":
        out.append(MinorRemark(f"no controller is recommended, {chosen.why}"))
    names = unknown_viscous(model)
    if found.plant.source == "physical" and names:
        out.append(f"{' and '.join(names)} not identified: an assumed value stands in the design")
    if model.assumed:
        out.append(f"compensator: assumed, not identified: {', '.join(model.assumed)}")
    if model.rig.motor_inertia and model.friction["m"].value is not None:
        out.append(_inertia(model.friction["m"].value, model.rig.motor_inertia, model.display))
    if asks := [over for over in asked_for(model) if over != "direction"]:
        what = " and ".join(asks)
        out.append(
            MinorRemark(
                f"friction changes with {what}: --schedule {asks[0]} tries a table of gains"
            )
        )
    if model.resonance is not None:
        out += beside_resonance(model, found, chosen.controller)
    return out


def _inertia(whole: float, motor: float, display: Display) -> str:
    """The machine's inertia beside that of its motor, and the load's ratio to it, in words."""
    unit = display.mass
    said = f"inertia {number(whole, 4)} {unit}, {number(motor, 4)} {unit} of it the motor's"
    if whole < motor:
        return f"{said}: less than the motor's alone; check motor_inertia in the card"
    return f"{said}: the load is {number(whole / motor - 1.0, 2)} times the motor"
