"""Designs to export, their machines, and the simulation that the code has to repeat."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from design.controllers.design import design
from design.controllers.schedule import scheduled
from design.generated.exported import Exported
from design.loop import LoopNoise
from design.machine.design import Design
from design.machine.model import Model
from design.servo import ServoRun, simulate_servo
from identification.arrays import Array
from identification.model.estimates import Estimate
from identification.model.karnopp import Karnopp
from identification.model.plant import Actuator, Motor, Plant
from tests.chain import EMPS, TABLES, designed, model_of

ACTUATOR = Actuator(19530.0, 10405.0)
RUBS = Karnopp(4.0, 15.0, 16.0, 40.0, 42.0, 3e-3, -3e-3, 18.0, -19.0)
START = 0.03  # m, where the simulated machine stands before its first sample


@dataclass(frozen=True)
class Case:
    """A design with its machine."""

    model: Model
    design: Design


@cache
def case(name: str) -> Case:
    """The design of a machine: "paper_table1" to 3 above a force loop (two-rate), "limited" with a
    limit of its command, "emps" with a motor, "cascade" a P-PI for the same, "schedule" PID and
    P-PI over the place, where its friction grows along the travel."""
    if name == "schedule":
        grows = {"position_dependent_friction": {
            "c1": Estimate(100.0, "N/m", 1.0, 98.0, 102.0), "period": Estimate(0.05, "m"),
        }}  # fmt: skip
        model = model_of(RUBS, k_a=20.0)
        model = replace(
            model, effects=grows, fit=replace(model.fit, noise_y=3e-7),
            rig=replace(model.rig, control_limit=10.0),
            log=(replace(model.log[0], speed=0.3, force_peak=90.0),),
        )  # fmt: skip
        found = design(model, structures=("pid", "p-pi"))
        return Case(model, scheduled(model, found, "place"))
    if name == "cascade":
        model = case("emps").model
        return Case(model, design(model, structures=("p-pi",)))
    if name == "emps":
        model = model_of(EMPS, k_a=35.15)
        model = replace(model, rig=replace(model.rig, control_limit=10.0))
    else:
        model = model_of(TABLES["paper_table1" if name == "limited" else name], ACTUATOR)
        if name == "limited":
            model = replace(model, rig=replace(model.rig, control_limit=0.2))
    return Case(model, designed(model))


NAMES = ("paper_table1", "paper_table2", "paper_table3", "limited", "emps")


def simulated(one: Case, what: Exported, n: int, seed: int = 0) -> tuple[ServoRun, Array]:
    """`n` samples of the simulated loop, and its inputs as the exported code takes them (n, k).

    The reference steps and turns, the sensors are noisy, and the run begins at rest off zero.
    """
    rng = np.random.default_rng(seed)
    h = what.loop.h
    t = h * np.arange(n)
    levels = 0.05 * rng.integers(-2, 3, size=n // round(2.0 / h) + 1)
    r = np.repeat(levels, round(2.0 / h))[:n] + 0.01 * np.sin(3.0 * t)
    noise = LoopNoise(1e-5 * rng.standard_normal(n), 1e-2 * rng.standard_normal(n))
    noise.y[0] = 0.0  # a block that begins at the position that it measures begins there too
    plant: Plant = one.model.simulated
    run = simulate_servo(
        plant if plant.actuator else replace(plant, actuator=Motor(1.0)),
        what.loop.servo,
        r,
        h,
        noise=noise,
        start=(START, 0.0, 0.0),
    )
    columns = {"r": r, "y": run.y_measured, "F_e": run.F_measured}
    inputs = np.stack([columns[signal.name] for signal in what.program.inputs], axis=1)
    return run, np.ascontiguousarray(inputs)
