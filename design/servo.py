"""The whole servo in simulation: position law, friction countermeasure, force loop, plant.

Figures 2, 4, 5 and 10 of the paper; figure 1 with a motor. The plant may have effects.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from design.compensator import Compensator
from design.drive_law import forgetting
from design.feed_forward import FeedForward
from design.filters import PASS, CompensatorFilters, Sampled, sampled, steady_state
from design.force_pi import ForcePI
from design.loop import Cascade, LoopNoise, LoopRun, observer_form, prepared_loop
from design.loop_signals import Signals, command_delay, effect_signals
from design.rivals import RULES, DisturbanceObserver, Dither, FrictionObserver, IntegralPID
from design.rst import RST
from design.schedule import OVERS, Schedule
from design.servo_kernels import (
    COMPENSATOR,
    DISTURBANCE,
    FEED_FORWARD,
    KALMAN,
    NO_COUNTERMEASURE,
    PID_LAW,
    RST_LAW,
    SCHEDULED_LAW,
    Law,
    Memory,
    friction_force,
    profiled,
)
from design.servo_loop import SERVO_ROWS, plain_servo_kernel, servo_kernel
from identification.arrays import Array
from identification.errors import BadModel
from identification.model.plant import Motor, Plant
from identification.signals.filters import Filter, slope_filter
from identification.simulation.effect_table import ON_ACTUATOR, effect_table, pieces


@dataclass(frozen=True)
class Compensation:
    """The compensator with its filters A, B, C and the velocity (5)."""

    compensator: Compensator
    filters: CompensatorFilters


STEPS_PER_RADIAN = 20.0  # in which a load's swinging is followed


@dataclass(frozen=True)
class SecondMass:
    """A load behind a spring: mass [kg], stiffness [N/m] and damping [N s/m] of the spring."""

    mass: float
    stiffness: float
    damping: float

    @classmethod
    def of(
        cls, frequency: float, anti_resonance: float, damping: float, mass: float
    ) -> "SecondMass":
        """By resonance and anti-resonance [Hz], damping of the resonance, and the load's mass."""
        k = mass * (2.0 * math.pi * anti_resonance) ** 2
        return cls(mass, k, 2.0 * damping * k / (2.0 * math.pi * frequency))

    def of_body(self, first: float, h: float) -> Array:
        """As the kernels take it, (4,), behind a body of its own mass [kg], sampled every h [s]."""
        w = math.sqrt(self.stiffness * (1.0 / first + 1.0 / self.mass))
        steps = max(1.0, math.ceil(STEPS_PER_RADIAN * w * h))
        return np.array([self.mass, self.stiffness, self.damping, steps])


DIRECT = ForcePI(0.0, 1.0)  # as the kernels take it that there is no force loop
Countermeasure = Compensation | DisturbanceObserver | FrictionObserver | FeedForward


@dataclass(frozen=True)
class Servo:
    """What stands between the sensors and the valve.

    position: gives the force reference [N], with a motor the command [V]. force: None with a
    motor. friction: what adds a force to the force reference (with a motor: that force over k_a to
    the command). dither: added to the command. control_limit: of |u| [V]; force_limit: of the
    force reference [N]. anti_windup [s]: in which time an RST's integrator forgets what a clipped
    command did not carry out; 0: the whole controller forgets it at once; None: never. A PID stops
    its sum while it would drive the command further out. W: in place of anti_windup, that of a
    `DriveLaw`. k_a: by which the friction's force becomes a command, None: the motor's own.
    direct: an actuator takes the position controller's output as its command, without a force loop.
    rate: the reference is moved at most at this speed [m/s], None: at any; acceleration: and with
    at most this [m/s^2], so that it stops where it should, None: with any; it needs a rate, and
    leaves a reference that is a path already as it is.

    Source: Astrom & Wittenmark, Computer-Controlled Systems, section 9.4 (anti-windup).
    """

    position: RST | IntegralPID
    force: ForcePI | None
    friction: Countermeasure | None = None
    dither: Dither | None = None
    control_limit: float | None = None
    force_limit: float | None = None
    anti_windup: float | None = None
    W: tuple[float, ...] | None = None
    k_a: float | None = None
    rate: float | None = None
    direct: bool = False
    acceleration: float | None = None
    schedule: Schedule | None = None

    def __post_init__(self) -> None:
        if self.acceleration is not None and (self.rate is None or not self.acceleration > 0):
            raise BadModel("a reference of limited acceleration needs one > 0, and a rate")
        if self.direct and (self.force is not None or self.friction is not None):
            raise BadModel(
                "a command without a force loop takes no force of a loop or a countermeasure"
            )
        if self.schedule is not None and not isinstance(self.position, RST):
            raise BadModel("a gain schedule stands in the place of an RST")

    @property
    def linear(self) -> RST:
        """The position controller without the rule of its integral."""
        return self.position if isinstance(self.position, RST) else self.position.linear


@dataclass(frozen=True, eq=False)
class ServoRun(LoopRun):
    """A `LoopRun` with what the servo computed, (n,).

    force_reference [N] of the position controller alone (with a motor its command [V]),
    compensation [N] before filter C and compensation_filtered [N] behind it, and the velocity
    [m/s] that the countermeasure works with.
    """

    force_reference: Array
    compensation: Array
    compensation_filtered: Array
    velocity: Array


class FrictionCompensator:
    """A countermeasure as a sampled object: `step` once every h [s].

    y_0 [m]: the position at which the machine stands before the first step, F_0 [N] its force.
    """

    def __init__(self, what: Countermeasure, h: float, y_0: float = 0.0, F_0: float = 0.0) -> None:
        self._law = friction_law(what, h)
        self._memory = friction_memory(self._law, y_0, F_0)

    def step(self, r: float, y: float, F: float) -> float:
        """F_compf [N] to add to the force reference, at r, position y [m] and force F [N]."""
        return friction_force(self._law, self._memory, r, y, F)

    @property
    def velocity(self) -> float:
        """The velocity of the last step [m/s]."""
        return float(self._memory.last[3])


def simulate_servo(
    plant: Plant,
    servo: Servo,
    reference: ArrayLike,
    h: float,
    *,
    noise: LoopNoise | None = None,
    start: tuple[float, float, float] = (0.0, 0.0, 0.0),
    signals: Signals | None = None,
    load: SecondMass | None = None,
) -> ServoRun:
    """One run along the reference r [m], (n,); the force loop runs every h [s]; see `Servo`.

    load: of the plant's mass, that swings behind the body which is measured and rubs.

    start: y [m], v [m/s], F [N] at the first sample, before which the servo stood at y. signals:
    those that the plant's effects use, by name, each (n,) or `OfForce`, of the plant's own force at
    the sample's start (`pressures`). The run's y is the body's position, y_measured what the
    transducer shows of it plus noise. Time counts from the start; before it no command was given.
    Raises BadModel where the parts do not fit together, a needed signal is missing or the run
    cannot be followed.
    """
    swinging = np.zeros(4)
    if load is not None:
        plant = _without_load(plant, load)
        swinging = load.of_body(plant.friction.m, h)
    ratio = max(1, round(servo.linear.h / h))
    cascade = Cascade(servo.linear, DIRECT if servo.direct else servo.force, servo.control_limit)
    loop, p = prepared_loop([plant], cascade, reference, h, noise, start, ratio)
    n, table = len(loop.reference), effect_table(plant.effects)
    codes = np.where(table.codes == ON_ACTUATOR, -1, table.codes) if loop.motor else table.codes
    base, gain = effect_signals(plant.effects, signals or {}, n)
    late = command_delay(plant.effects) / h
    t = h * np.arange(n, dtype=np.float64)
    k_a = 0.0
    if isinstance(plant.actuator, Motor):
        k_a = plant.actuator.k_a if servo.k_a is None else servo.k_a
    law = servo_law(servo, h, k_a)
    memory = servo_memory(servo, law, loop.start[0], loop.start[2])
    shake = servo.dither.signal(t) if servo.dither else np.zeros(n)
    out, modes = np.empty((SERVO_ROWS, n)), np.empty(n, dtype=np.int64)
    y_noise, f_noise = (np.ascontiguousarray(one[:, 0]) for one in (loop.noise.y, loop.noise.F))
    around = (law, memory, loop.reference, shake, y_noise, f_noise, loop.start, out, modes)
    if plant.effects or load is not None:
        history = np.zeros(n + math.ceil(late) + 1)
        servo_kernel(
            p, h, pieces(table, h), codes, table.addresses, table.p, base, gain, history, late,
            swinging, *around,
        )  # fmt: skip
    else:
        plain_servo_kernel(p, h, *around)
    y, v, F, u, measured, *inside = out
    if not np.all(np.isfinite(y)):
        raise BadModel(
            f"the loop cannot be followed beyond t = {h * int(np.argmin(np.isfinite(y))):g} s;"
            " check the controller's gains and the effects' parameters"
        )
    return ServoRun(t, loop.reference, y, v, F, measured, F + f_noise, u, modes, *inside)


def moved_reference(servo: Servo, reference: Array, h: float) -> Array:
    """The reference [m], (n,) every h [s], as the servo moves it: at most at its speed and with its
    acceleration; the servo takes it as it is."""
    law = servo_law(servo, h)
    past = servo_memory(servo, law, float(reference[0]), 0.0).past
    out = np.array(reference, dtype=np.float64)
    for i, r in enumerate(out.tolist()):
        if servo.acceleration is not None:
            out[i] = profiled(law.rate, law.acceleration, past, r)
        elif i:
            out[i] = out[i - 1] + min(max(r - out[i - 1], -law.rate), law.rate)
    return out


def _without_load(plant: Plant, load: SecondMass) -> Plant:
    """The plant with the mass of its body alone."""
    left = plant.friction.m - load.mass
    if not left > 0.0:
        raise BadModel(
            f"a load of {load.mass:g} kg is not less than the whole mass of {plant.friction.m:g} kg"
        )
    return replace(plant, friction=replace(plant.friction, m=left))


def friction_law(what: Countermeasure | None, h: float) -> Law:
    """The countermeasure as the kernels take it, with no position controller; h [s]."""
    none, pass_ = np.zeros(1), sampled(PASS)
    kind, law, kalman = NO_COUNTERMEASURE, none, none
    first = second = third = pass_
    match what:
        case Compensation(compensator, filters):
            kind, law = COMPENSATOR, compensator.law
            first = sampled(filters.velocity, slope_filter(h, filters.N_d))
            second, third = sampled(filters.error), sampled(filters.force)
        case DisturbanceObserver():
            kind = DISTURBANCE
            first, second = (sampled(one) for one in what.filters(h))
        case FrictionObserver(m, F_vp, F_vn, q_v, q_F, r_y):
            kind, kalman = KALMAN, np.array([m, F_vp, F_vn, q_v, q_F, r_y])
        case FeedForward():
            kind, law = FEED_FORWARD, what.law
            first, second = (sampled(one) for one in what.filters(h))
    return Law(
        position=RST_LAW, R=none, S=none, W=none, b_r=pass_.b, a_r=pass_.a, pid=none,
        friction=kind, law=law, b_v=first.b, a_v=first.a, b_e=second.b, a_e=second.a,
        b_c=third.b, a_c=third.a, kalman=kalman, h=h, k_i=0.0, k_int=0.0, k_a=0.0,
        limit=math.inf, force_limit=math.inf, rate=math.inf, acceleration=math.inf, ratio=1,
        over=0, knots=none, rows=none, decay=0.0, span=1.0,
    )  # fmt: skip


def friction_memory(law: Law, y_0: float, F_0: float) -> Memory:
    """The state of a countermeasure that has stood at y_0 [m] under F_0 [N]."""
    kalman = np.zeros(12)
    if law.friction == KALMAN:
        variance = law.kalman[5] ** 2
        kalman[:3] = y_0, 0.0, F_0
        kalman[3:] = np.diag([variance, 1e-6, 1e2]).reshape(9)
    first = F_0 if law.friction == DISTURBANCE else y_0
    return Memory(
        x=np.zeros(1), pid=np.zeros(3), z_r=steady_state(Sampled(law.b_r, law.a_r), y_0),
        z_v=steady_state(Sampled(law.b_v, law.a_v), first),
        z_e=steady_state(Sampled(law.b_e, law.a_e), y_0),
        z_c=np.zeros(law.b_c.size), kalman=kalman, last=np.zeros(4),
        past=np.array([y_0, 0.0, 0.0, 0.0, y_0, 0.0, 0.0, 0.0]), turn=np.zeros(1, dtype=np.int64),
        now=np.zeros(1),
    )  # fmt: skip


def servo_law(servo: Servo, h: float, k_a: float = 0.0) -> Law:
    """The servo as the kernels take it; its force loop runs every h [s], k_a [N/V] of a motor."""
    ratio = max(1, round(servo.linear.h / h))
    k_i, T_i = (servo.force.k_i, servo.force.T_i) if servo.force else (0.0, 1.0)
    limit, force_limit, rate, acceleration = (
        math.inf if one is None else one
        for one in (servo.control_limit, servo.force_limit, servo.rate, servo.acceleration)
    )
    law = friction_law(servo.friction, ratio * h)._replace(
        k_i=k_i, k_int=k_i * h / T_i, k_a=k_a, limit=limit, force_limit=force_limit,
        rate=rate * h, acceleration=acceleration * h * h, ratio=ratio,
    )  # fmt: skip
    if servo.schedule is not None:
        what, period = servo.schedule, ratio * h
        return law._replace(
            position=SCHEDULED_LAW, over=OVERS.index(what.over), knots=np.array(what.at),
            rows=what.rows.ravel(), decay=what.decay(period), span=what.span * period,
        )  # fmt: skip
    if isinstance(servo.position, RST):
        R, S, _ = observer_form(servo.position, 0.0)
        b_r, a_r = _reference_filter(servo.position)
        return law._replace(R=R, S=S, W=_observer(S, servo, ratio * h), b_r=b_r, a_r=a_r)
    pid = servo.position
    per_difference, pole = pid.T_d / pid.eps, math.exp(-ratio * h / pid.eps)
    rule = float(RULES.index(pid.rule))
    constants = np.array([pid.k_R, ratio * h / pid.T_i, per_difference, pole, pid.zone, rule])
    return law._replace(position=PID_LAW, pid=constants)


def servo_memory(servo: Servo, law: Law, y_0: float, F_0: float) -> Memory:
    """The state of the servo that has stood at y_0 [m] under F_0 [N]."""
    if servo.schedule is not None:
        rest, now = np.array([0.0, y_0, y_0]), servo.schedule.rows[0].copy()
        x = np.zeros(servo.schedule.size)
        return friction_memory(law, y_0, F_0)._replace(x=x, pid=rest, now=0.0 * now)
    _, _, x = observer_form(servo.linear, y_0)
    return friction_memory(law, y_0, F_0)._replace(x=x)


def _reference_filter(controller: RST) -> Sampled:
    """T B_m/A_m, divided by S[0], for the kernels."""
    lead = controller.A_m[0]
    b = np.convolve(controller.T, controller.B_m) / (controller.S[0] * lead)
    return sampled(Filter(tuple(b.tolist()), tuple((controller.A_m / lead).tolist())))


def _observer(S: Array, servo: Servo, h: float) -> Array:
    if servo.W is None:
        return forgetting(S, servo.anti_windup, h)
    return np.pad(np.array(servo.W), (0, len(S) - len(servo.W)))
