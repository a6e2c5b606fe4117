"""Model -> Design: PID and RST by pole placement, compensator, margins."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Literal

import numpy as np

from design.filters import filters_at
from design.linear import ForceGains, force_gains, linear_plant
from design.tracking import Demand
from design.tune import Asked, Goals, Tuned, tune_pid, tune_rst
from identification.arrays import Array
from identification.errors import BadModel, BadSpecification, NotIdentifiable
from identification.estimation.estimates import told_estimate
from identification.model.estimates import Estimate
from identification.model.plant import Actuator, Motor
from workbench.cards.parameter_units import Shown, shown
from workbench.documents.design import (
    CompensatorValues,
    Controller,
    Design,
    From,
    Linear,
    margin_values,
)
from workbench.documents.drive import Command, ForceLoop
from workbench.documents.model import Model, used, versions
from workbench.documents.plausible import bandwidth_remarks, stored_remarks
from workbench.steps.identify import check_period

DEFAULT_PERIOD = 10e-3  # s, the paper's rig
FINEST = 20  # times faster than its logs that a controller may be designed
N_C = 2.0  # the paper's, in simulation and on the rig
E_T_PER_TRAVEL = 0.03  # the paper's 3 mm on steps of 0.1 m
LARGEST_STEP = 0.5  # of the travel seen in the logs, that a reference may take at once
OVERSHOOT = 0.05  # of a step, in the linear loop
NOISE_SHARE = 0.05  # of the Coulomb force that the position's noise may ask for
FOLLOWS = 0.5  # free-run error of an ARX plant, relative to y, up to which it may carry a design


def design(
    model: Model,
    asked: Asked | None = None,
    *,
    goals: Goals | None = None,
    source: From | None = None,
    period: float | None = None,
) -> Design:
    """PID and RST for a model, by pole placement, with margins; poles searched where not asked.

    source: the linear plant to design on, by default the sounder. period: of the position
    controller [s]. Raises BadSpecification where no controller meets what was asked,
    NotIdentifiable where the model carries no design.
    """
    asked = asked or Asked()
    _check_period(period, model)
    plant, force = linear_of(model, source, period)
    goals = goals or Goals(effort=effort_limit(model))
    command = command_of(model, force)
    found: dict[str, Controller] = {}
    refused: dict[str, str] = {}
    a, b = np.array(plant.A), np.array(plant.B)
    others, demand = corners(model, plant, force), reference_demand(model, force)
    for name, tune in (("rst", tune_rst), ("pid", tune_pid)):
        if name == "pid" and not asked.integrator:
            refused[name] = "a PID has an integrator; asked for none"
            continue
        wanted = asked
        if name == "pid" and asked.auxiliary is not None:
            wanted = Asked(asked.dominant, None, asked.integrator)
        try:
            tuned = tune(a, b, plant.h, wanted, goals, others, demand)
        except BadSpecification as error:
            refused[name] = str(error)
            continue
        found[name] = _controller(tuned, command, shown(model.rotary))
    by_hand = asked.dominant is not None or asked.auxiliary is not None
    if not found or ("rst" in refused and by_hand):
        raise BadSpecification(refused["rst"])
    recommended = _recommended(found)
    return Design(
        card=model.card,
        motion=model.rig.motion,
        plant=plant,
        force=force,
        rst=found.get("rst"),
        pid=found.get("pid"),
        refused=refused,
        recommended=recommended,
        compensator=_compensator(model, plant.h),
        remarks=(
            *model.read,
            *stored_remarks(model),
            *bandwidth_remarks([one.dominant[0] for one in found.values()], model.rig),
            *_remarks(model, plant, found),
        ),
        versions=versions(),
        command=command,
    )


def command_of(model: Model, force: ForceLoop | None) -> Command:
    """What the machine's drive takes: a command, or a force where no command is logged."""
    drive, rig = model.simulated.actuator, model.rig
    if isinstance(drive, Motor):
        return Command(rig.command_unit, rig.control_limit, drive.k_a)
    if force is not None:
        return Command(rig.command_unit, rig.control_limit, None)
    unit = shown(model.rotary).force
    return Command(unit, rig.control_limit if rig.command_unit == unit else None, 1.0)


def _check_period(period: float | None, model: Model) -> None:
    """Raises BadModel where a period [s] is far from what the model's logs show."""
    longest = max(model.log, key=lambda entry: entry.duration)
    check_period(period, longest.file, longest.duration)
    fastest = min(entry.h for entry in model.log)
    if period is not None and period < fastest / FINEST:
        raise BadModel(
            f"design period {period:g} s, the model's logs were sampled every {fastest:g} s; ask"
            f" for at least {fastest / FINEST:.3g}"
        )


def _recommended(found: Mapping[str, Controller]) -> Literal["rst", "pid", "none"]:
    """The RST where it keeps every goal, else the PID where that does; else none."""
    if "rst" in found and not found["rst"].missed:
        return "rst"
    return "pid" if "pid" in found and not found["pid"].missed else "none"


def reference_demand(model: Model, force: ForceLoop | None) -> Demand:
    """What a step of the reference may ask of this machine.

    Of force what the logs show at most, less the stick limit; of the command the rig's limit.
    """
    p, actuator, limit = model.karnopp, model.simulated.actuator, model.rig.control_limit
    low, high = model.travel
    most, command = model.force_peak, None
    per_jump, per_speed = 0.0, 0.0
    if isinstance(actuator, Motor) and limit is not None:
        most = min(most, abs(actuator.k_a) * limit)
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


def linear_of(
    model: Model, source: From | None = None, period: float | None = None
) -> tuple[Linear, ForceLoop | None]:
    """The linear plant for a design and the force loop inside it, where there is an actuator.

    The physical one where the mass is identified: it holds the force loop and no noise. Raises
    NotIdentifiable where neither it nor an ARX plant that follows the logs is there.
    """
    known = model.friction["m"].value is not None
    if source == "arx" or (source is None and not known):
        plant = _arx(model, period, known)
        return plant, _force_loop(model, plant.h)
    if not known:
        raise NotIdentifiable(f"no physical plant to design on: m: {model.friction['m'].reason}")
    h_log = max(entry.h for entry in model.log)
    h = period
    if h is None:
        h = model.plant.h if model.plant else max(DEFAULT_PERIOD, h_log)
    force = _force_loop(model, h)
    a, b = _physical(*_nominal(model), h, model, force)
    why = _why_physical(model, force)
    m, viscous = model.friction["m"], _viscous(model)
    return Linear("physical", why, tuple(a.tolist()), tuple(b.tolist()), h, m, viscous), force


def _why_physical(model: Model, force: ForceLoop | None) -> str:
    """Why the physical plant, and which of its parameters the logs do not tell."""
    known = "mass and viscous friction are identified"
    if names := _unknown_viscous(model):
        known = f"the mass is identified, {' and '.join(names)} assumed"
    inside = "with the force as its input"
    if force:
        told = all(e.known for e in (model.actuator or {}).values())
        actuator = "the actuator" if told else "an actuator of assumed k1 and k2"
        inside = f"with {actuator} and its force loop"
    return f"{known}: sliding body, {inside}, sampled exactly"


def _unknown_viscous(model: Model) -> list[str]:
    return [name for name in ("F_vp", "F_vn") if not model.friction[name].known]


def linear_plant_of(machine: Model, found: Design) -> Linear:
    """The machine's own linear plant under a design's force loop and period.

    ARX where the design is and the machine has one at that period, else the physical one.
    """
    own = machine.plant
    fits = own is not None and own.input == "F" and abs(own.h - found.plant.h) < 1e-6 * own.h
    if found.plant.source == "arx" and own is not None and fits:
        return Linear("arx", "", own.A, own.B, own.h, None, None)
    a, b = _physical(*_nominal(machine), found.plant.h, machine, found.force)
    m, viscous = machine.friction["m"], _viscous(machine)
    return Linear("physical", "", tuple(a.tolist()), tuple(b.tolist()), found.plant.h, m, viscous)


def _physical(
    m: float, f: float, h: float, model: Model, force: ForceLoop | None
) -> tuple[Array, Array]:
    actuator = model.simulated.actuator
    if force is None or not isinstance(actuator, Actuator):
        return linear_plant(m, f, h)
    gains = ForceGains(force.k_i, force.T_i)
    return linear_plant(m, f, h, actuator, gains, max(1, round(h / force.h)))


def _force_loop(model: Model, h: float) -> ForceLoop | None:
    """The force loop inside a position loop of period h, at the logs' period; None for a motor."""
    actuator = model.simulated.actuator
    if not isinstance(actuator, Actuator):
        return None
    ratio = max(1, round(h / max(entry.h for entry in model.log)))
    gains = force_gains(actuator, h / ratio)
    return ForceLoop(gains.k_i, gains.T_i, h / ratio)


def _nominal(model: Model) -> tuple[float, float]:
    """Mass and the mean of both viscous coefficients."""
    p = model.karnopp
    return p.m, 0.5 * (p.F_vp + p.F_vn)


def _viscous(model: Model) -> Estimate:
    """The viscous coefficient of the linear plant: the mean over both directions."""
    one, other = model.friction["F_vp"], model.friction["F_vn"]
    mean = _nominal(model)[1]
    if unknown := _unknown_viscous(model):
        reason = f"{' and '.join(unknown)} not identified"
        return Estimate(None, one.unit, reason=reason, assumed=mean)
    if one.sd is None or other.sd is None:
        return Estimate(mean, one.unit)
    return told_estimate(mean, one.unit, 0.5 * math.hypot(one.sd, other.sd))


def _arx(model: Model, period: float | None, known: bool) -> Linear:
    found = model.plant
    why_not = model.friction["m"].reason or "mass identified"
    if model.imposed:
        raise NotIdentifiable(
            "no plant to design on: the logged motion was imposed on the body; log a run in which"
            " the drive moves it freely"
        )
    if found is None:
        raise NotIdentifiable(f"no ARX plant to design on ({model.plant_reason}); m: {why_not}")
    if found.simulation_relative is None or found.simulation_relative > FOLLOWS:
        error = found.simulation_relative
        said = "runs away" if error is None else f"leaves {100 * error:.0f} % of the motion"
        raise NotIdentifiable(
            f"the ARX plant, run freely on held-out samples, {said} (at most {100 * FOLLOWS:.0f} %"
            f" needed), so it carries no design; m: {why_not}; log a run in which the drive moves"
            " the body freely"
        )
    if period is not None and abs(period - found.h) > 1e-6 * period:
        raise BadSpecification(
            f"the ARX plant is sampled every {found.h:g} s, {period:g} s asked; identify again with"
            f" --design-period {period:g}"
        )
    if found.input == "u":
        raise NotIdentifiable("the ARX plant's input is the command, a force is needed to design")
    why = "asked for" if known else "the mass is not identified; the ARX plant follows the logs"
    return Linear("arx", why, found.A, found.B, found.h, None, None)


def effort_limit(model: Model) -> float | None:
    """Largest |S_up| [dB]: the position's noise may ask for a fifth of the Coulomb force."""
    p = model.karnopp
    coulomb = 0.5 * (p.F_cp + p.F_cn)
    if not (coulomb > 0 and model.fit.noise_y > 0):
        return None
    return float(20 * np.log10(NOISE_SHARE * coulomb / model.fit.noise_y))


def _controller(tuned: Tuned, command: Command, units: Shown) -> Controller:
    rst, pid, taken = tuned.rst, tuned.pid, tuned.followed
    found = Controller(
        R=tuple(rst.R.tolist()),
        S=tuple(rst.S.tolist()),
        T=tuple(rst.T.tolist()),
        h=rst.h,
        dominant=tuned.dominant,
        auxiliary=tuple((z.real, z.imag) for z in tuned.auxiliary),
        margins=margin_values(tuned.margins, tuned.worst),
        rate=taken.rate,
        lag=taken.lag,
        overshoot=taken.overshoot,
        missed=tuned.missed,
        gains=None if pid is None else pid.gains,
        note="; ".join(_notes(tuned, units)),
    )
    return replace(found, W=found.law(command).W)


def _notes(tuned: Tuned, units: Shown) -> Iterator[str]:
    """What to know of a controller's reference and form, in words."""
    pid, rate = tuned.pid, tuned.followed.rate
    if pid is not None and pid.gains is not None:
        yield f"set-point weights b = {pid.gains.b:.3g}, c = {pid.gains.c:.3g}"
    yield f"follows a ramp {1e3 * tuned.followed.lag:.3g} ms behind"
    if rate is not None:
        step = rate * tuned.rst.h
        yield (
            f"move the reference by at most {step:.4g} {units.position} in a sample"
            f" ({rate:.3g} {units.velocity})"
        )
    if pid is not None and (said := pid.note or pid.reason):
        yield said


def corners(
    model: Model, plant: Linear, force: ForceLoop | None
) -> tuple[tuple[Array, Array], ...]:
    """Linear plants at the corners of the intervals of mass and viscous friction; () for ARX.

    Raises BadSpecification where the force loop is unstable on one.
    """
    if plant.source == "arx":
        return ()
    m, viscous = model.friction["m"], (model.friction["F_vp"], model.friction["F_vn"])
    ends = [_ends(v) for v in viscous]
    least, most = min(low for low, _ in ends), max(high for _, high in ends)
    return tuple(
        _physical(mass, f, plant.h, model, force)
        for mass in _ends(m)
        for f in (max(least, 0), most)
    )


def _ends(found: Estimate) -> tuple[float, float]:
    """Interval of a parameter; that of its assumed value where there is none."""
    if found.at_most is not None:
        return 0.0, found.at_most
    low, high = (used(found) if end is None else end for end in (found.low, found.high))
    return low, high


def _compensator(model: Model, h: float) -> CompensatorValues:
    low, high = model.travel
    e_T = E_T_PER_TRAVEL * (high - low)
    return CompensatorValues(N_C, e_T, model.friction, filters_at(h), h)


def _remarks(model: Model, plant: Linear, found: Mapping[str, Controller]) -> list[str]:
    out = []
    if _recommended(found) == "none":
        said = "; ".join(f"{name.upper()}: {', '.join(c.missed)}" for name, c in found.items())
        out.append(f"no controller is recommended, none keeps every goal ({said})")
    names = _unknown_viscous(model)
    if plant.source == "physical" and names:
        out.append(f"{' and '.join(names)} not identified: an assumed value stands in the design")
    if model.assumed:
        out.append(f"compensator: assumed, not identified: {', '.join(model.assumed)}")
    if not model.fit.adequate:
        out.append("the model leaves more than noise; check the loop on the machine with care")
    return out
