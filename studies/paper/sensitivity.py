"""How the compensator's error and chatter depend on N_c, e_T, noise, and on wrong parameters."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from design.loop import LoopNoise
from design.servo import simulate_servo
from identification.arrays import Array
from identification.model.karnopp import NAMES, Karnopp
from studies.paper.measures import figures_of, measure
from studies.paper.settings import NOISE_F, NOISE_Y, friction_of, simulation, simulation_pd

N_CS = (1.2, 1.5, 2.0, 3.0, 5.0, 10.0)
E_TS = (0.2e-3, 0.5e-3, 1e-3, 2e-3, 3e-3, 5e-3, 10e-3)  # m
NOISES = (1.0, 10.0, 100.0)  # times the paper's
FACTORS = (0.5, 0.7, 0.85, 0.95, 1.0, 1.05, 1.15, 1.3, 1.5)
USED = tuple(name for name in NAMES if name not in ("m", "F_vp", "F_vn"))  # by eq. (4)


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """PD and compensator (4) on table 1 with its true values, unless a parameter is scaled.

    standstill [m] and chatter [N] (see `Figures`): (noises, N_c, e_T). wrong: parameter -> squared
    error relative to that with the true value, (factors,).
    """

    N_c: tuple[float, ...]
    e_T: tuple[float, ...]
    noises: tuple[float, ...]
    standstill: Array
    chatter: Array
    factors: tuple[float, ...]
    wrong: dict[str, Array]


def sensitivity(seeds: Sequence[int]) -> Sensitivity:
    """The maps, and one parameter of the compensator wrong at a time."""
    set_up, truth = simulation(), friction_of(1)
    shape = (len(NOISES), len(N_CS), len(E_TS))
    standstill, chatter = np.empty(shape), np.empty(shape)
    plant, n = set_up.plant(truth), len(set_up.reference)
    for i, j, k in np.ndindex(*shape):
        servo = replace(set_up, N_c=N_CS[j], e_T=E_TS[k]).compensation(truth)
        runs = []
        for seed in seeds:
            rng = np.random.default_rng(seed)
            noise = LoopNoise.draw(n, NOISES[i] * NOISE_Y, NOISES[i] * NOISE_F, rng)
            law = set_up.servo(simulation_pd(), servo)
            runs.append(simulate_servo(plant, law, set_up.reference, set_up.h, noise=noise))
        found = figures_of(set_up, runs)
        standstill[i, j, k] = np.nan if found.standstill is None else found.standstill
        chatter[i, j, k] = found.chatter
    return Sensitivity(
        N_CS, E_TS, NOISES, standstill, chatter, FACTORS,
        {name: _wrong(truth, name, seeds) for name in USED},
    )  # fmt: skip


def _wrong(truth: Karnopp, name: str, seeds: Sequence[int]) -> Array:
    """Squared error with this parameter scaled, relative to that with the true one."""
    set_up = simulation()
    errors = []
    for factor in FACTORS:
        scaled = replace(truth, **{name: factor * getattr(truth, name)})
        servo = set_up.servo(simulation_pd(), set_up.compensation(scaled))
        errors.append(measure(set_up, truth, servo, seeds).figures.squared_error)
    return np.array(errors) / errors[FACTORS.index(1.0)]
