"""Log + model -> the force without friction, of which a linear body's motion would come."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from design.closed_loop.linear_loop import dead_time
from design.machine.model import Model, used
from design.measured.predict import refuse_missing
from identification.arrays import Array, BoolArray
from identification.effects._base import Acting
from identification.frequency.machine import Recording
from identification.frequency.modes import Modes
from identification.frequency.swinging_load import Load, Rests
from identification.log import Log
from identification.model.inverse_model import SURE_SLIDING
from identification.signals.differentiate import differentiate
from identification.simulation.inverse_dynamics import of_body, opposing_force, with_motor_force

LINEAR_EFFECTS = frozenset({"compliance", "input_delay"})  # they stay in the response
RUNG_OUT = 4.0  # s, in which a load behind a spring has come to rest

# Force that a linear body needs for a velocity (n,) whose acceleration is (n,), every h [s].
BodyForce = Callable[[Array, Array, float], Array]


def plain_recording(log: Log, zero_order_hold: bool) -> Recording:
    """The log as it stands, its force with all friction in it."""
    return Recording(log.h, log["y"], log["F"], log["F"], log.signals.get("r"), zero_order_hold)


@dataclass(frozen=True, eq=False)
class Freed:
    """A log whose force is freed of friction where the body surely slides.

    plain: as it stands, but for what its transducer shows of the body; v, a: the motion, over each
    sample [m/s, m/s^2]; slides: where `left` [N] is what friction leaves of the force, (n,) each.
    """

    plain: Recording
    v: Array
    a: Array
    slides: BoolArray
    left: Array

    def without_friction(self, body: BodyForce) -> Recording:
        """The log with its force without friction: where the body rests or is slow friction is
        whatever holds it, and the force is what the motion needs of a linear body."""
        resting = body(self.v, self.a, self.plain.h)
        if np.any(self.slides):  # a motion identifies a spring's force up to a constant
            resting = resting + np.mean((self.left - resting)[self.slides])
        return replace(self.plain, linear=np.where(self.slides, self.left, resting))

    @property
    def rests(self) -> Rests:
        """Where the body rests or is slow, and its acceleration, for `swinging_load`."""
        return Rests(~self.slides, self.a)


def freed(log: Log, model: Model) -> Freed:
    """The log without friction and what else of the model is not linear, where the body slides.

    Raises BadLog where the log lacks a signal of an effect.
    """
    plant = replace(model.simulated, effects=tuple(_nonlinear(model)))
    refuse_missing(log, plant.effects)
    zero_order_hold = model.rig.kind == "motor"
    moved = of_body(with_motor_force(log, plant), plant)
    motion, late, t = differentiate(moved["y"], log.h), dead_time(model), log["t"]
    v, least = motion.v, SURE_SLIDING * motion.v_noise
    up, down = max(plant.friction.dv_p, least), min(plant.friction.dv_n, -least)
    d = np.where(v > up, 1.0, np.where(v < down, -1.0, 0.0))  # 0: stuck, or lost in the noise
    opposed, slides = opposing_force(moved, plant, motion.y, v, d), d != 0
    # What is slow is not at rest: an encoder's steps hide motion that a multisine makes.
    a = np.asarray(np.gradient(v, log.h))
    if zero_order_hold:  # each over the period that follows
        opposed = 0.5 * (opposed + np.append(opposed[1:], opposed[-1]))
        slides = slides & np.append(slides[1:], slides[-1])
        a = np.diff(v, append=v[-1]) / log.h
    if late > 0.0:  # at the force's own times, which the body feels so much later
        opposed = np.interp(t + late, t, opposed)
    y, F = np.asarray(moved["y"]), np.asarray(moved["F"])
    plain = replace(plain_recording(log, zero_order_hold), y=y, F=F)
    return Freed(plain, v, a, slides, F - opposed)


def _nonlinear(model: Model) -> Iterator[Acting]:
    """The model's effects that are not linear, a spring by its cube alone."""
    for one in model.acting:
        if one.key == "spring":
            yield one.effect.acting({**one.values, "k": 0.0})
        elif one.key not in LINEAR_EFFECTS:
            yield one


def of_model(model: Model) -> BodyForce:
    """The force by the model's mass and viscous friction, and its second mass, where it has one."""
    if model.resonance is None:
        return of_load(model, None)
    shape = {name: used(one) for name, one in model.resonance.items()}
    share = shape["m_2"] / (shape["m_1"] + shape["m_2"])
    anti = shape["anti_resonance"]
    return of_load(model, Load(anti, shape["damping"] * anti / shape["frequency"], share))


def stiffness_of(model: Model) -> float:
    """Of the model's spring to the ground [N/m], 0 where it has none."""
    return sum(one.values["k"] for one in model.acting if one.key == "spring")


def of_load(model: Model, load: Load | None) -> BodyForce:
    """The force by the model's mass, viscous friction and spring to the ground (but for a
    constant), a share of the mass behind a spring."""
    p, stiffness = model.karnopp, stiffness_of(model)
    viscous = 0.5 * (p.F_vp + p.F_vn)

    def force(v: Array, a: Array, h: float) -> Array:
        moved = a if load is None else a + load.share * load.beyond(a, h)
        return np.asarray(p.m * moved + viscous * v + stiffness * h * np.cumsum(v))

    return force


def of_modes(modes: Modes, highest: float) -> BodyForce:
    """The force by the modes of a measured response, which is taken as it is up to so many Hz."""

    def force(v: Array, _a: Array, h: float) -> Array:
        n = len(v) + round(RUNG_OUT / h)
        f = np.fft.rfftfreq(n, h)
        known = np.clip(f, f[1], highest)
        impedance = 2j * np.pi * f / modes.undelayed(known)
        impedance[0] = impedance[1].real
        return np.asarray(np.fft.irfft(np.fft.rfft(v, n) * impedance, n)[: len(v)])

    return force
