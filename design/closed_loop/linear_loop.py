"""The linear plants of a machine under its loops: nominal, and at its parameters' intervals."""

import math
from collections.abc import Iterator

import numpy as np

from design.drive_law import DriveLaw
from design.elastic import Swing, elastic_plant
from design.linear import commanded_plant, force_gains, linear_plant
from design.machine.codec import Command
from design.machine.design import From, Linear
from design.machine.drive import ForceLoop
from design.machine.model import Model, used
from identification.arrays import Array
from identification.errors import BadSpecification, NotIdentifiable
from identification.estimation.estimates import reported_estimate
from identification.model.estimates import Estimate
from identification.model.plant import Actuator, Motor

FOLLOWS = 0.5  # free-run error of an ARX plant, relative to y, up to which it may carry a design
FORCE_LOOP_SAMPLES = 5  # of the force loop in one of the position loop; it has then done 80 %
LONGEST_PERIOD = 20e-3  # s, of a position loop that nobody asked for
WHOLE_SAMPLE = 1e-3  # of a sample, up to which a delay counts as whole
MULTIPLES = (1, 2, 5, 10, 20)  # of the drive's period, tried in turn
SWING_UNSURE = 0.02  # of a resonance, that it may lie beside its estimate, at least
Body = tuple[float, float, tuple[Swing, ...]]  # mass, viscous friction, elastic parts


def command_of(model: Model, force: ForceLoop | None) -> Command:
    """What the machine's drive takes: a command, or a force where no command is logged."""
    drive, rig = model.simulated.actuator, model.rig
    if isinstance(drive, Motor):
        return Command(rig.command_unit, rig.control_limit, drive.k_a)
    if force is not None:
        return Command(rig.command_unit, rig.control_limit, None)
    unit = model.display.force
    return Command(unit, rig.control_limit if rig.command_unit == unit else None, 1.0)


def linear_of(
    model: Model, source: From | None = None, period: float | None = None
) -> tuple[Linear, ForceLoop | None]:
    """The linear plant for a design and the force loop inside it, where there is an actuator.

    period [s]: of the position loop, by default the first of `periods`. The physical plant where
    the mass is identified: it holds the force loop and no noise. Raises NotIdentifiable where
    neither it nor an ARX plant that follows the logs is there, and of motion one way, unless an ARX
    plant is asked for: no log then shows what a loop meets about standstill.
    """
    known = model.friction["m"].value is not None
    if source is None and not known and model.identifies_one_way:
        found = ", ".join(name for name, one in model.friction.items() if one.known)
        raise NotIdentifiable(
            f"{model.log[0].file}: {found} alone identified, of motion in one direction; a design"
            " needs the mass, or a linear plant of motion in both; log motion both ways, with"
            " reversals, and identify again"
        )
    if source == "arx" or (source is None and not known):
        plant = _arx(model, period, known)
        return plant, _force_loop(model, plant.h)
    if not known:
        raise NotIdentifiable(f"no physical plant to design on: m: {model.friction['m'].reason}")
    h = periods(model)[0] if period is None else period
    force = _force_loop(model, h)
    a, b = _physical(_nominal(model), h, model, force)
    why = _why_physical(model, force)
    m, viscous = model.friction["m"], _viscous(model)
    linear = Linear(
        "physical", why, tuple(a.tolist()), tuple(b.tolist()), h, m, viscous, model.resonance
    )
    return linear, force


def carries_design(model: Model) -> bool:
    """Whether there is a linear plant for a design."""
    try:
        linear_of(model)
    except (NotIdentifiable, BadSpecification):
        return False
    return True


def periods(model: Model) -> tuple[float, ...]:
    """Sampling periods [s] of a position loop to try, the drive's own first, then multiples of it.

    The drive's own is that of the card's controller, else that of the logs: a log is not written
    faster than its drive runs. A position loop above a force loop leaves it a few samples.
    """
    now = model.controller
    base = now.law.h if now else model.period
    if isinstance(model.simulated.actuator, Actuator):
        base = max(base, FORCE_LOOP_SAMPLES * force_period(model))
    return tuple(n * base for n in MULTIPLES if n == 1 or n * base <= LONGEST_PERIOD)


def force_period(model: Model) -> float:
    """Sampling period of a force loop [s]: that of the card's own, else of the logs."""
    now = model.controller
    return now.force.h if now and now.force else model.period


def _why_physical(model: Model, force: ForceLoop | None) -> str:
    """Why the physical plant, and which of its parameters the logs do not identify."""
    known = "mass and viscous friction are identified"
    if names := unknown_viscous(model):
        known = f"the mass is identified, {' and '.join(names)} assumed"
    body = "sliding body" if model.resonance is None else "two masses, the first sliding"
    inside = "with the force as its input"
    if force:
        identified = all(e.known for e in (model.actuator or {}).values())
        actuator = "the actuator" if identified else "an actuator of assumed k1 and k2"
        inside = f"with {actuator} and its force loop"
    return f"{known}: {body}, {inside}, sampled exactly"


def law_to_force(model: Model) -> tuple[DriveLaw, float] | None:
    """The law that the machine has now, and by which its output becomes a force; None where there
    is none, or a force loop or an actuator stands between."""
    now, drive = model.controller, model.simulated.actuator
    if now is None or now.force is not None:
        return None
    if now.output == "force":
        return now.law, 1.0
    return (now.law, drive.k_a) if isinstance(drive, Motor) else None


def unknown_viscous(model: Model) -> list[str]:
    """Names of the viscous coefficients that no log identifies."""
    return [name for name in ("F_vp", "F_vn") if not model.friction[name].known]


def plants_of(
    machine: Model, h: float, force: ForceLoop | None, arx: bool = False
) -> list[tuple[Array, Array]]:
    """Linear plants (A, B) of a machine, from a law's output to the position, run every h [s].

    The nominal one first, then those at the corners of its intervals. The output is the force
    reference where there is a force loop, else the command. arx: the machine's own ARX plant alone,
    where it has one at this period. Raises BadSpecification where the force loop is unstable.
    """
    own = machine.plant
    gain = machine.simulated.actuator
    per = gain.k_a if isinstance(gain, Motor) else 1.0
    if arx and own is not None and own.input == "F" and abs(own.h - h) < 1e-6 * own.h:
        return [(np.array(own.A), per * np.array(own.B))]
    bodies = [_nominal(machine), *_corner_bodies(machine)]
    plants = [_physical(body, h, machine, force) for body in bodies]
    return [(a, per * b) for a, b in plants]


def swings_of(model: Model) -> tuple[Swing, ...]:
    """The elastic parts that the model knows of."""
    two = model.resonance
    if two is None:
        return ()
    names = ("frequency", "anti_resonance", "damping")
    return (Swing.of_two_masses(*(used(two[name]) for name in names)),)


def _physical(body: Body, h: float, model: Model, force: ForceLoop | None) -> tuple[Array, Array]:
    """The sampled plant of the model's machine with this body."""
    actuator, (m, f, swings) = model.simulated.actuator, body
    a, b = sampled(m, f, h, actuator, force, swings)
    return a, b if isinstance(actuator, Actuator) else delayed(b, dead_time(model) / h)


def sampled(
    m: float, f: float, h: float, actuator: Actuator | Motor | None, force: ForceLoop | None,
    swings: tuple[Swing, ...] = (),
) -> tuple[Array, Array]:  # fmt: skip
    """The plant (A, B) of a body every h [s], by the reference of the force loop, the command of an
    actuator without one, or else the force. Raises BadSpecification where the loop is unstable."""
    if not isinstance(actuator, Actuator):
        return elastic_plant(m, f, h, swings) if swings else linear_plant(m, f, h)
    gains = None if force is None else force.pi
    ratio = 1 if force is None else max(1, round(h / force.h))
    if swings:
        return elastic_plant(m, f, h, swings, actuator, gains, ratio)
    if gains is None:
        return commanded_plant(m, f, h, actuator)
    return linear_plant(m, f, h, actuator, gains, ratio)


def stiff_body(model: Model, plant: Linear, force: ForceLoop | None) -> tuple[Array, Array]:
    """The design's plant without elastic parts, on which poles are placed."""
    if plant.source == "arx" or not swings_of(model):
        return np.array(plant.A), np.array(plant.B)
    m, f, _ = _nominal(model)
    return _physical((m, f, ()), plant.h, model, force)


def dead_time(model: Model) -> float:
    """By how much the position, as measured, follows a motor's command or a force [s]."""
    late = model.effects.get("input_delay")
    if late is not None:
        return used(late["tau"])
    return max(used(model.lag), 0.0) if model.lag is not None else 0.0


def delayed(b: Array, samples: float) -> Array:
    """The numerator B(z^-1) of a plant whose input acts so many samples later.

    A part of a sample is shared between its two ends, as the mean of a zero-order-hold command is.
    """
    whole = math.floor(samples + WHOLE_SAMPLE)
    part = max(samples - whole, 0.0)
    share = np.array([1.0 - part, part]) if part > WHOLE_SAMPLE else np.array([1.0])
    return np.concatenate([np.zeros(whole), np.convolve(b, share)])


def _force_loop(model: Model, h: float) -> ForceLoop | None:
    """The force loop inside a position loop of period h [s]; None for a motor."""
    actuator = model.simulated.actuator
    if not isinstance(actuator, Actuator):
        return None
    ratio = max(1, round(h / force_period(model)))
    gains = force_gains(actuator, h / ratio)
    return ForceLoop(gains.k_i, gains.T_i, h / ratio)


def _nominal(model: Model) -> Body:
    """Mass, the mean of both viscous coefficients, and the elastic parts."""
    p = model.karnopp
    return p.m, 0.5 * (p.F_vp + p.F_vn), swings_of(model)


def _viscous(model: Model) -> Estimate:
    """The viscous coefficient of the linear plant: the mean over both directions."""
    one, other = model.friction["F_vp"], model.friction["F_vn"]
    mean = _nominal(model)[1]
    if unknown := unknown_viscous(model):
        reason = f"{' and '.join(unknown)} not identified"
        return Estimate(None, one.unit, reason=reason, assumed=mean)
    if one.sd is None or other.sd is None:
        return Estimate(mean, one.unit)
    return reported_estimate(mean, one.unit, 0.5 * math.hypot(one.sd, other.sd))


def _arx(model: Model, period: float | None, known: bool) -> Linear:
    found = model.plant
    unknown, advice = model.friction["m"].reason, "the mass is identified: design on it, physical"
    if unknown:
        advice = f"m: {unknown}; log a run in which the drive moves the body freely"
    if model.prescribed_motion:
        raise NotIdentifiable(
            "no plant to design on: the logged motion was prescribed; log a run in which the drive"
            " moves the body freely"
        )
    if found is None:
        raise NotIdentifiable(f"no ARX plant to design on ({model.plant_reason}); {advice}")
    if found.simulation_relative is None or found.simulation_relative > FOLLOWS:
        error = found.simulation_relative
        said = "runs away" if error is None else f"leaves {100 * error:.0f} % of the motion"
        raise NotIdentifiable(
            f"the ARX plant, run freely on held-out samples, {said} (at most {100 * FOLLOWS:.0f} %"
            f" needed), so it carries no design; {advice}"
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


def corners(
    model: Model, plant: Linear, force: ForceLoop | None
) -> tuple[tuple[Array, Array], ...]:
    """Linear plants at the corners of the intervals of mass and viscous friction; () for ARX.

    Raises BadSpecification where the force loop is unstable on one.
    """
    if plant.source == "arx":
        return ()
    return tuple(_physical(body, plant.h, model, force) for body in _corner_bodies(model))


def _corner_bodies(model: Model) -> list[Body]:
    """Mass, viscous friction and elastic parts at the corners of their intervals."""
    ends = [_ends(model.friction[name]) for name in ("F_vp", "F_vn")]
    least, most = min(low for low, _ in ends), max(high for _, high in ends)
    bodies = [(m, f) for m in _ends(model.friction["m"]) for f in (max(least, 0.0), most)]
    return [(m, f, swings) for m, f in bodies for swings in _known_resonances(model)]


def _known_resonances(model: Model) -> Iterator[tuple[Swing, ...]]:
    """The elastic parts at both ends of the interval of their frequency."""
    two = model.resonance
    if two is None:
        yield ()
        return
    frequency, middle = two["frequency"], used(two["frequency"])
    low, high = (middle if end is None else end for end in (frequency.low, frequency.high))
    unsure = max(high / middle - 1.0, 1.0 - low / middle, SWING_UNSURE)
    for factor in (1.0 - unsure, 1.0 + unsure):
        yield tuple(one.times(factor) for one in swings_of(model))


def _ends(found: Estimate) -> tuple[float, float]:
    """Interval of a parameter; that of its assumed value where there is none."""
    if found.at_most is not None:
        return 0.0, found.at_most
    low, high = (used(found) if end is None else end for end in (found.low, found.high))
    return low, high
