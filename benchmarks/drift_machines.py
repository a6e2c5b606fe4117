"""Machines of `drift`'s hard parts, by the plain Euler steps of `outside_rig`; active models.

A motor stage with a Stribeck dip, whose model has none, behind an encoder of 1 um at 1 kHz; and a
rotary motor whose logs are short, slow and noisy, so that they hardly tell its friction.
"""

import numpy as np

from benchmarks.outside_rig import K_A, LENGTHS, RIGS, SIZES, reference, run
from identification.arrays import Array
from identification.drift.reference_model import ReferenceModel
from identification.estimation.windowed_run.parameters import values_of
from identification.log import Log, Rig
from identification.model.estimates import KarnoppFit
from identification.model.plant import Plant

STAGE = np.array([5.0, 8.0, 7.5, 80.0, 70.0, 0.006, -0.006, 11.0, -10.5])
DIP, DIP_SPEED = 0.3, 0.02  # N, m/s
STAGE_RIG = Rig("motor", force_per_command=K_A)
STAGE_KINDS = ("steps", "multisine", "triangle")
COUNT, UNDER_IT = 1e-6, 3e-7  # m: an encoder's step, and what shakes it

TURNED = np.array([0.02, 0.30, 0.28, 0.12, 0.11, 0.02, -0.02, 0.36, -0.34])  # kg m^2, N m, rad/s
TORQUE = 0.5  # N m/V
TURNED_RIG = Rig("motor", force_per_command=TORQUE, motion="rotary")
TURNED_GAINS = (8.0, 0.3, 6.0)
WIDER = 10.0  # rad of the rotary reference for a metre of the stage's
LINES = 3e-2  # rad


def _sizes(**some: float) -> Array:
    return np.array([{**dict.fromkeys(SIZES, 0.0), **LENGTHS, **some}[name] for name in SIZES])


def stage(seed: int, number: int, worn: float = 1.0, seconds: float = 12.0) -> Log:
    """A log of the stage; worn: factor on Coulomb friction and stick limits."""
    rng = np.random.default_rng([seed, number])
    nine = STAGE.copy()
    nine[[1, 2, 7, 8]] *= worn
    nine[[7, 8]] -= np.sign(nine[[7, 8]]) * DIP  # the dip adds to the stick limit too
    h, gains = 1e-3, np.array(RIGS["motor"].gains)
    r = reference(STAGE_KINDS[number % 3], rng, h, seconds)
    noise = UNDER_IT * rng.standard_normal(len(r))
    effect = _sizes(slow=DIP, slow_speed=DIP_SPEED)
    y, u, F = run(nine, gains, K_A, 0.0, 10.0, True, effect, r, noise, h, COUNT)
    return Log(
        f"stage{number}", {"t": h * np.arange(len(r), dtype=np.float64), "y": y, "u": u, "F": F}
    )


def turned(seed: int, number: int, drifted: float = 1.0, seconds: float = 4.0) -> Log:
    """A log of the rotary motor; drifted: factor on Coulomb friction."""
    rng = np.random.default_rng([seed, number])
    nine = TURNED.copy()
    nine[[1, 2]] *= drifted
    h = 5e-3
    r = WIDER * reference("triangle", rng, h, seconds)
    noise = LINES * rng.standard_normal(len(r))
    y, u, F = run(
        nine, np.array(TURNED_GAINS), TORQUE, 0.0, 10.0, True, _sizes(), r, noise, h, LINES
    )
    return Log(
        f"turned{number}", {"t": h * np.arange(len(r), dtype=np.float64), "y": y, "u": u, "F": F}
    )


def active(fit: KarnoppFit, rig: Rig, key: str = "", fastest: float = 0.0) -> ReferenceModel:
    """A fit as the active model; fastest [m/s]: speed in its logs, 0 if unknown."""
    plant = Plant(fit.friction, fit.actuator, fit.effects)
    at = [i for i, name in enumerate(fit.free) if fit.estimates[name].known]
    names = tuple(fit.free[i] for i in at)
    return ReferenceModel(
        plant, names, values_of(plant, names), fit.covariance[np.ix_(at, at)], rig, fit.drive,
        chi_square=fit.chi_square, prescribed=fit.prescribed,
        not_identifiable={
            name: one.reason or "" for name, one in fit.estimates.items() if not one.known
        },
        key=key, fastest=fastest,
    )  # fmt: skip
