"""Runs with an effect against plain Euler of the written equations; wrong equations are found."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from identification.arrays import Array
from identification.effects._library import built_in
from identification.log import Log
from identification.model.karnopp import Karnopp
from identification.model.plant import Plant
from identification.simulation.free_run import free_run
from tests.identification.effects.oracle import Evolve, Written, euler
from tests.identification.motor_logs import made
from tests.identification.motor_logs import plant as motor
from tests.identification.plants import ACTUATOR, table

H, SECONDS, SUB = 1e-3, 2.0, 100
NINE: Karnopp = table(1)
VALUES: Mapping[str, Mapping[str, float]] = {
    "stribeck": {"F_s": 6.0, "v_s": 0.06, "asymmetry": 0.4, "delta": 1.4},
    "nonlinear_viscous": {"k": 400.0, "n": 2.0, "asymmetry": -0.3},
    "position_dependent_friction": {
        "c1": 80.0,
        "a": 4.0,
        "b": 2.0,
        "period": 0.02,
        "at_rest_p": 1.5,
        "at_rest_n": 0.5,
    },
    "tight_spot": {"size": 6.0, "y_0": 0.002, "width": 0.002, "at_rest_p": 1.5, "at_rest_n": 0.5},
    "load_dependent_friction": {"mu": 0.3, "asymmetry": 0.4},
    "warmup": {"a": -0.4, "b": 100.0, "tau": 1.0, "asymmetry": 0.2, "at_rest_p": 0.5},
    "spring": {"k": 400.0},
    "cogging": {"a": 8.0, "b": 4.0, "period": 0.01, "a_2": 3.0, "b_2": -2.0},
    "end_cushion": {"k_p": 5e3, "k_n": 5e4, "y_p": 0.005, "y_n": -0.005},
    "leakage": {"leak": 5.0},
    "rising_stiction": {"F_r": 10.0, "tau": 0.1, "asymmetry": -0.3},
    "frictional_lag": {"tau": 0.02},
}


def lagging(dt: float, x: dict[str, float], z: float) -> float:
    """Friction that follows itself late, by Euler."""
    to = np.clip(x["F"], -x["f"], x["f"]) if x["d"] == 0 else x["d"] * x["f"]
    return float(z + dt * (to - z) / VALUES["frictional_lag"]["tau"])


def resting(dt: float, x: dict[str, float], z: float) -> float:
    """Time at rest."""
    return z + dt if x["d"] == 0 else 0.0


EVOLVE: Mapping[str, Evolve] = {"frictional_lag": lagging, "rising_stiction": resting}


def command() -> Array:
    """To and fro with rests, so that everything shows within two seconds."""
    t = H * np.arange(round(SECONDS / H), dtype=np.float64)
    return np.asarray(0.13 * np.sin(2 * np.pi * 1.7 * t) * (np.sin(2 * np.pi * 0.9 * t) > -0.4))


def differs(key: str, wrong: str = "") -> tuple[float, float]:
    """Largest distance [m] to the written equations, and to the plant without the effect."""
    u = command()
    log = Log("made", {"t": H * np.arange(len(u), dtype=np.float64), "y": 0.0 * u, "u": u})
    acting = built_in()[key].acting(VALUES[key])
    plant = Plant(NINE, ACTUATOR)
    found = free_run(replace(plant, effects=(acting,)), log, (0.0, 0.0, 0.0), "command")
    plain = free_run(plant, log, (0.0, 0.0, 0.0), "command")
    fine = euler(
        NINE, ACTUATOR.k1, ACTUATOR.k2, Written.of(acting, EVOLVE.get(key), wrong), u, H, SUB
    )
    return (
        float(np.max(np.abs(found.y - np.array(fine[0])))),
        float(np.max(np.abs(found.y - plain.y))),
    )


@pytest.mark.method
@pytest.mark.parametrize("key", list(VALUES))
def test_it_is_the_written_equation(key: str) -> None:
    error, size = differs(key)
    assert error < 2e-5
    assert size > 10.0 * error


@pytest.mark.slow
@pytest.mark.parametrize(
    ("key", "wrong"),
    [
        ("spring", "k*y"),
        ("stribeck", "F_s*exp(-(Abs(v)/v_s)**delta)"),
        ("cogging", "a*sin(2*pi*y/period) + b*cos(2*pi*y/period)"),
        ("load_dependent_friction", "mu*(1 + asymmetry*d)*F"),
        ("warmup", "(a*c + b*Abs(v))*(1 + asymmetry*d)"),
    ],
)
def test_wrong_equations_are_found(key: str, wrong: str) -> None:
    assert differs(key, wrong)[0] > 5e-5


@pytest.mark.parametrize(
    ("key", "values", "most"),
    [
        ("rising_stiction", {"F_r": 5.0, "tau": 0.4}, 1e-9),
        ("frictional_lag", {"tau": 0.01}, 5e-7),
        ("stribeck", {"F_s": 4.0, "v_s": 0.03}, 5e-6),
    ],
)
def test_a_switch_within_a_sub_step_is_where_it_is_in_finer_ones(
    key: str, values: Mapping[str, float], most: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    log, one = made(1), motor({key: values})
    coarse = free_run(one, log, (0.0, 0.0, 0.0), "command").y
    monkeypatch.setattr("identification.simulation.free_run.pieces", lambda *_: 80)
    monkeypatch.setattr("identification.simulation.free_run.fewer", lambda *_: 80)
    fine = free_run(one, log, (0.0, 0.0, 0.0), "command").y
    assert np.max(np.abs(coarse - fine)) < most
