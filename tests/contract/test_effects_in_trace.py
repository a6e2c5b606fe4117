"""Every effect of the library once through `trace`: named with its size from a short log, or, where
no log of this machine can show it, nothing wrong is said.

The paper's machine of table 1 by its command, 8 s at 500 Hz; the library holds that one effect.
"""

from collections.abc import Mapping

import numpy as np
import pytest

from identification.arrays import Array
from identification.effects._library import built_in
from identification.log import Log, Rig
from identification.model.plant import Plant
from identification.simulation.free_run import free_run
from identification.tracing.trace import trace
from tests.identification.estimation.test_surroundings import TURNING, pendulum
from tests.identification.plants import ACTUATOR, NOISE_F, NOISE_Y, table

H, SECONDS = 2e-3, 8.0
# Sizes, the first of which has to be identified; what is not given is at its default.
SIZES: Mapping[str, Mapping[str, float]] = {
    "backlash": {"width": 1e-3},
    "cogging": {"a": 4.0, "period": 0.03},
    "compliance": {"flexibility": 3e-5},
    "end_cushion": {"k_p": 400.0, "k_n": 400.0, "y_p": 0.03, "y_n": -0.03},
    "frictional_lag": {"tau": 0.02},
    "input_delay": {"tau": 0.02},
    "leakage": {"leak": 1.0},
    "nonlinear_viscous": {"k": 150.0, "n": 2.0},
    "position_dependent_friction": {"c1": 100.0, "a": 3.0, "period": 0.05},
    "presliding": {"sigma_0": 2e4},
    "pressure_dependent_friction": {"mu_p": 5e-5},
    "rising_stiction": {"F_r": 8.0, "tau": 0.2},
    "sensor_nonlinearity": {"a": 0.5},
    "spring": {"k": 200.0},
    "stribeck": {"F_s": 6.0, "v_s": 0.08},
    "tight_spot": {"size": 8.0, "y_0": 0.0, "width": 0.02},
    "valve_dead_zone": {"u_d": 0.01},
    "warmup": {"a": -0.3, "tau": 4.0},
}
# Taken up by the plain model: as unequal levels of friction or, without hard braking, as a scale
# of all friction. Gravity of a rotary machine is part of it too.
TAKEN_UP: Mapping[str, Mapping[str, float]] = {
    "constant_force": {"F_0": 4.0},
    "load_dependent_friction": {"mu": 0.15},
}
TOLERANCES = {"rising_stiction": 0.2}  # of few rests; the others are known to 5 %
SEEN_IN_PART = ("presliding",)  # a bristle leaves more than noise at this rate


def command(t: Array, seed: int) -> Array:
    """Three sines with rests in between, and a small dither [V]."""
    rng = np.random.default_rng(seed)
    swings = ((0.3, 0.05), (0.9, 0.06), (2.1, 0.06))
    u = sum(size * np.sin(2 * np.pi * f * t + rng.uniform(0, 2 * np.pi)) for f, size in swings)
    dither = 0.002 * rng.standard_normal(len(t))
    return np.asarray(u * (np.sin(2 * np.pi * 0.4 * t) > -0.3) + dither)


def recorded(key: str, sizes: Mapping[str, float], seed: int) -> Log:
    """A log of the machine with the effect."""
    t = H * np.arange(round(SECONDS / H), dtype=np.float64)
    signals = {
        "t": t, "y": np.zeros(len(t)), "u": command(t, seed),
        "p_p": 3e5 + 1e5 * np.sin(1.3 * t + seed), "p_n": 3e5 - 1e5 * np.sin(0.7 * t),
    }  # fmt: skip
    plant = Plant(table(1), ACTUATOR, (built_in()[key].acting(sizes),))
    run = free_run(plant, Log("made", signals), (0.0, 0.0, 0.0), "command")
    noise = np.random.default_rng(seed + 50).standard_normal((2, len(t)))
    seen = {"y": run.shown + NOISE_Y * noise[0], "F": run.F + NOISE_F * noise[1]}
    return Log(f"made {seed}", {**signals, **seen})


@pytest.mark.parametrize("key", sorted(SIZES))
def test_it_is_named_with_its_size(key: str) -> None:
    train, test = (recorded(key, SIZES[key], seed) for seed in (1, 2))
    library = {key: built_in()[key]}
    found = trace([train], [test], Rig("force"), library, np.random.default_rng(0))
    assert [one.effect.key for one in found.effects] == [key]
    name, true = next(iter(SIZES[key].items()))
    assert found.effects[0].params[name].value == pytest.approx(true, rel=TOLERANCES.get(key, 0.05))
    if key not in SEEN_IN_PART:
        assert found.verdict == "effect"
        before, after = found.before["test"], found.after["test"]
        errors = ((getattr(before, e), getattr(after, e)) for e in ("force_rms", "position_rms",
                  "actuator_rms"))  # fmt: skip
        assert min(now / was for was, now in errors if was and now) < 0.8


@pytest.mark.parametrize("key", sorted(TAKEN_UP))
def test_what_the_plain_model_takes_up_is_no_discovery(key: str) -> None:
    train, test = (recorded(key, TAKEN_UP[key], seed) for seed in (1, 2))
    found = trace([train], [test], Rig("force"), {key: built_in()[key]}, np.random.default_rng(0))
    assert found.verdict == "none" and found.effects == ()


@pytest.mark.slow
def test_gravity_is_reported_beside_friction_and_is_no_discovery() -> None:
    logs = [pendulum(1, 3.0, seconds=12.0)], [pendulum(2, 3.0, seconds=12.0)]
    found = trace(*logs, TURNING, built_in(), np.random.default_rng(0))
    assert found.effects == ()
    assert found.surroundings.sine.value == pytest.approx(3.0, rel=0.02)
    assert found.plant.effects[-1].key == "gravity"


def test_no_effect_is_left_out() -> None:
    assert {*SIZES, *TAKEN_UP, "gravity"} == set(built_in())
