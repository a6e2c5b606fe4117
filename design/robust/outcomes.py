"""The machines that there may be, drawn from a model's errors and from how it has drifted, and what
a loop comes to on every one: margins, errors, forces, a limit cycle."""

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from design.asked import Limits
from design.closed_loop.drawn_plants import drawn_plants, in_loop
from design.closed_loop.driven_loop import DrivenLoop, limit_on, run_plant
from design.closed_loop.linear_loop import sampled
from design.closed_loop.loop_motion import loop_motion
from design.drawn_loops import DrawnPlants, loop_margins
from design.machine.drive import ForceLoop
from design.machine.model import Model
from identification.arrays import Array
from identification.errors import BadSpecification, UserError
from identification.estimation.windowed_run.parameters import plant_with, values_of
from identification.model.estimates import Estimate
from identification.model.karnopp import NAMES
from identification.model.plant import Motor, Plant


@dataclass(frozen=True, eq=False)
class DrawnMachines:
    """A model, and the plants drawn around it."""

    model: Model
    plants: tuple[Plant, ...]

    def linear(self, h: float, force: ForceLoop | None, probability: float) -> DrawnPlants:
        """The linear plants as a law that asks for force sees them every h [s]; see `each_linear`.

        Raises BadSpecification where the force loop is stable on none.
        """
        each = self.each_linear(h, force)
        drawn = [one for one in each if one is not None]
        return DrawnPlants.of(drawn, probability, len(each) - len(drawn))

    def each_linear(
        self, h: float, force: ForceLoop | None
    ) -> tuple[tuple[Array, Array] | None, ...]:
        """(A, B) of every plant, None where the force loop is not stable on it.

        Their input is the reference of the force loop, the command of an actuator without one, or
        else the force that the model's motor would give: another k_a is another gain.
        """
        own, out = self.model.simulated.actuator, list[tuple[Array, Array] | None]()
        for plant in self.plants:
            p, drive = plant.friction, plant.actuator
            gain = 1.0
            if isinstance(drive, Motor) and isinstance(own, Motor):
                gain = drive.k_a / own.k_a
            try:
                a, b = sampled(p.m, 0.5 * (p.F_vp + p.F_vn), h, drive, force)
            except BadSpecification:
                out.append(None)
                continue
            out.append((a, gain * b))
        return tuple(out)


def drawn_machines(
    model: Model, rng: np.random.Generator, count: int, drift: Mapping[str, float] | None = None
) -> DrawnMachines:
    """So many machines, drawn from the errors of the model's parameters, and by `drift_found`."""
    errors, drift_rng = rng.spawn(2)
    plants = drawn_plants(model, errors, count)
    if drift:
        names = tuple(drift)
        spread = np.array(list(drift.values()))
        factors = np.exp(spread * drift_rng.standard_normal((count, len(names))))
        plants = tuple(
            plant_with(plant, names, values_of(plant, names) * row)
            for plant, row in zip(plants, factors, strict=True)
        )
    return DrawnMachines(model, plants)


def drift_found(models: Sequence[Mapping[str, Estimate]]) -> dict[str, float]:
    """By how much each of the nine has changed from one active model to the next: the relative
    deviation of a step, what the models themselves are unsure of taken off; only those that have.

    models: their friction, in the order in which they were active.
    """
    out = {}
    for name in NAMES:
        steps = [
            step
            for before, after in pairwise(models)
            if (step := _squared_step(before.get(name), after.get(name))) is not None
        ]
        if steps and (mean := float(np.mean(steps))) > 0.0:
            out[name] = math.sqrt(mean)
    return out


def _squared_step(old: Estimate | None, new: Estimate | None) -> float | None:
    """The squared logarithm of new over old, less its expectation where nothing has changed; None
    where a model does not know the parameter."""
    if old is None or new is None or not old.value or not new.value or old.unit != new.unit:
        return None
    if old.value * new.value < 0.0:
        return None
    unsure = sum(((one.sd or 0.0) / (one.value or 1.0)) ** 2 for one in (old, new))
    return math.log(new.value / old.value) ** 2 - unsure


SLOW_SHARE = 0.5  # of the narrowest stick band, at which a slow ramp moves
SLOW_SECONDS = 10.0  # s that it lasts, the last half of which is tested
BARELY = 1.0 - 1e-9  # of a limit of the command, at which it is reached

Kind = Literal["share", "samples", "length", "time", "number"]


class Measure(NamedTuple):
    """What is tested of a loop: name, in words, what kind of number it is; floor: at least the
    limit is kept, else at most."""

    name: str
    words: str
    kind: Kind
    floor: bool = False


MEASURES = (
    Measure("modulus", "modulus margin", "number", floor=True),
    Measure("delay", "delay margin", "samples", floor=True),
    Measure("standstill", "error at standstill, of the step", "share"),
    Measure("tracking", "rms error along the smooth reference, of its amplitude", "share"),
    Measure("overshoot", "overshoot, of the step", "share"),
    Measure("force", "largest force, of that in the logs", "number"),
    Measure("command", "largest command, of its limit", "number"),
    Measure("limit_cycle", "limit cycle at rest, peak to peak", "length"),
    Measure("staircase", "staircase on a slow ramp, peak to peak", "length"),
    Measure("settling", "settling time", "time"),
)


@dataclass(frozen=True, eq=False)
class Motion:
    """The references of a loop [m], one each of its samples: steps, smooth, and a ramp slower than
    the stick band."""

    steps: Array
    smooth: Array
    slow: Array


@dataclass(frozen=True, eq=False)
class Outcomes:
    """Every measure on every machine, (k,), by name; infinite (a margin: 0) where the loop runs
    away; without those that the machine has not (a limit of the command)."""

    values: Mapping[str, Array]

    def within(self, limits: Mapping[str, float]) -> dict[str, NDArray[np.bool_]]:
        """Whether each limit is kept on each machine, (k,)."""
        return {
            one.name: self.values[one.name] >= limits[one.name]
            if one.floor
            else self.values[one.name] <= limits[one.name]
            for one in MEASURES
            if one.name in limits and one.name in self.values
        }


def limits_by_name(limits: Limits, staircase: float | None = None) -> dict[str, float]:
    """The limits of `validate` by measure, that of the staircase [m] where one is asked for."""
    out = {**asdict(limits), "command": BARELY, "limit_cycle": 0.0}
    return out if staircase is None else {**out, "staircase": staircase}


def slow_ramp(model: Model, h: float) -> tuple[Array, float]:
    """A ramp at half the narrowest stick band [m], (n,), and its speed [m/s]."""
    p = in_loop(model).friction
    speed = SLOW_SHARE * min(p.dv_p, -p.dv_n)
    return speed * h * np.arange(round(SLOW_SECONDS / h), dtype=np.float64), speed


def outcomes(
    machines: DrawnMachines, loop: DrivenLoop, motion: Motion, seeds: Sequence[np.random.Generator]
) -> Outcomes:
    """The loop on every machine, along one motion, with the sensors' noise by its own generator."""
    model = machines.model
    limit = limit_on(model, loop) if model.simulated.actuator is not None else None

    def of(plant: Plant, rng: np.random.Generator) -> tuple[float, ...]:
        return _on_one(model, plant, loop, motion, limit, rng)

    with ThreadPoolExecutor(2) as pool:
        rows = np.array(list(pool.map(of, machines.plants, seeds[: len(machines.plants)])))
    names = ("standstill", "tracking", "overshoot", "force", "command", "limit_cycle", "staircase",
             "settling")  # fmt: skip
    values = dict(zip(names, rows.T, strict=True))
    if limit is None:
        del values["command"]
    if not model.force_peak > 0.0:
        del values["force"]
    return Outcomes({**_margins(machines, loop), **values})


def _margins(machines: DrawnMachines, loop: DrivenLoop) -> dict[str, Array]:
    """Modulus and delay margin on every machine, 0 where the force loop is not stable on it."""
    law, drive = loop.law.rst, machines.model.simulated.actuator
    per = drive.k_a if isinstance(drive, Motor) else 1.0  # of the law's output, to force
    each = machines.each_linear(law.h, loop.force)
    stable = np.array([one is not None for one in each])
    modulus, delay = np.zeros(len(each)), np.zeros(len(each))
    if np.any(stable):
        drawn = DrawnPlants.of([one for one in each if one is not None], 0.5)
        found = loop_margins(drawn.A, per * drawn.B, law)
        modulus[stable], delay[stable] = found.modulus, found.delay
    return {"modulus": modulus, "delay": delay}


def _on_one(
    model: Model, plant: Plant, loop: DrivenLoop, motion: Motion, limit: float | None,
    rng: np.random.Generator,
) -> tuple[float, ...]:  # fmt: skip
    """The measures of `outcomes` on one plant, margins left out."""
    along = (motion.steps, motion.smooth, motion.slow)
    try:
        steps, smooth, slow = (run_plant(model, plant, loop, r, rng) for r in along)
    except UserError:  # cannot be followed: it runs away
        return (np.inf,) * 8
    found = loop_motion(steps, smooth, model.fit.noise_y, limit)
    if not found.stable:
        return (np.inf,) * 8
    off = (slow.y - slow.r)[len(slow.r) // 2 :]
    return (
        found.standstill_relative,
        found.smooth_relative,
        found.overshoot,
        found.force_peak / model.force_peak if model.force_peak > 0.0 else 0.0,
        0.0 if limit is None else (found.command_peak or 0.0) / limit,
        0.0 if found.limit_cycle is None else found.limit_cycle.amplitude,
        float(np.ptp(off)),
        found.settling,
    )
