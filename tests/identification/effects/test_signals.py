"""Effects on what is shown and on the command: play, scale, elasticity, dead zone, delay."""

from dataclasses import replace

import numpy as np
import pytest

from identification.arrays import Array
from identification.effects._library import built_in
from identification.log import Log
from identification.model.plant import Motor, Plant
from identification.simulation.effect_along_motion import contribution
from identification.simulation.free_run import FreeRun, free_run
from tests.identification.plants import ACTUATOR, command, table

H = 1e-3
T = H * np.arange(3000, dtype=np.float64)
U = command(T, 1)


def run(key: str, values: dict[str, float], u: Array = U, *, motor: bool = False) -> FreeRun:
    """A free run with one effect."""
    log = Log("made", {"t": T[: len(u)], "y": 0.0 * u, "u": u})
    plant = Plant(table(1), Motor(300.0) if motor else ACTUATOR)
    return free_run(
        replace(plant, effects=(built_in()[key].acting(values),)), log, (0.0, 0.0, 0.0), "command"
    )


def plain(u: Array = U, *, motor: bool = False) -> FreeRun:
    """The run of this command without effects."""
    return run("input_delay", {"tau": 0.0}, u, motor=motor)


def test_backlash_waits_after_a_reversal() -> None:
    width = 4e-3
    found = run("backlash", {"width": width})
    shown = [0.0]
    for y in found.y:
        shown.append(min(max(shown[-1], y - width / 2), y + width / 2))
    assert np.allclose(found.shown, shown[1:], atol=1e-15)
    assert np.array_equal(found.y, run("backlash", {"width": 0.0}).y)
    assert np.max(np.abs(found.shown - found.y)) == pytest.approx(width / 2)


def test_scale_and_elasticity_are_shown_only() -> None:
    bent = run("sensor_nonlinearity", {"a": 2.0, "b": -30.0})
    assert np.allclose(bent.shown, bent.y + 2.0 * bent.y**2 - 30.0 * bent.y**3, atol=1e-15)
    soft = run("compliance", {"flexibility": 1e-4})
    assert np.allclose(soft.shown, soft.y + 1e-4 * soft.F, atol=1e-15)
    assert np.max(np.abs(soft.y - bent.y)) < 1e-12


@pytest.mark.parametrize("motor", [False, True])
def test_dead_zone_is_a_smaller_command(motor: bool) -> None:
    found = run("valve_dead_zone", {"u_d": 0.03, "asymmetry": 0.5}, motor=motor)
    width = np.where(U >= 0, 0.045, 0.015)
    expected = plain(np.sign(U) * np.maximum(np.abs(U) - width, 0.0), motor=motor)
    assert np.max(np.abs(found.y - expected.y)) < 1e-14


def test_dead_zone_along_a_motion_is_of_the_direction_of_the_command() -> None:
    acting = built_in()["valve_dead_zone"].acting({"u_d": 0.03, "asymmetry": 0.5})
    signals = {"t": T, "y": T, "v": T, "F": T, "u": U, "d": -np.sign(U)}
    given = contribution(acting.effect, acting.values, signals, H, table(1))
    width = np.where(U >= 0, 0.045, 0.015)
    assert np.allclose(given, np.sign(U) * np.maximum(np.abs(U) - width, 0.0), atol=1e-15)


@pytest.mark.parametrize("motor", [False, True])
@pytest.mark.parametrize("late", [0, 1, 7])
def test_delay_of_whole_samples_is_an_older_command(late: int, motor: bool) -> None:
    found = run("input_delay", {"tau": late * H}, motor=motor)
    older = np.concatenate([np.full(late, U[0]), U[: len(U) - late]])
    assert np.max(np.abs(found.y - plain(older, motor=motor).y)) < 1e-10


def test_delay_of_half_a_sample_lies_between() -> None:
    half, one, two = (run("input_delay", {"tau": k * H}).y for k in (1.5, 1.0, 2.0))
    assert np.max(np.abs(half - 0.5 * (one + two))) < 0.05 * np.max(np.abs(one - two))


def test_force_without_command_leaks_away() -> None:
    u = np.where(T < 0.05, 0.012, 0.0)  # 11.7 N, which does not break away
    found = run("leakage", {"leak": 2.0}, u)
    rest = slice(50, None)
    assert np.all(found.v[rest] == 0.0)
    assert np.allclose(found.F[rest], found.F[50] * np.exp(-2.0 * (T[rest] - T[50])), rtol=1e-5)


def test_a_rest_raises_the_stick_limit() -> None:
    def breakaway(rest: float) -> float:
        t = H * np.arange(round((rest + 1.5) / H), dtype=np.float64)
        log = Log("made", {"t": t, "y": 0.0 * t, "F": 30.0 * np.maximum(t - rest, 0.0)})
        risen = built_in()["rising_stiction"].acting({"F_r": 10.0, "tau": 0.5})
        found = free_run(Plant(table(1), None, (risen,)), log, (0.0, 0.0, 0.0), "force")
        return float(log["F"][np.argmax(found.v > 0)])

    for rest in (0.0, 0.5, 3.0):
        force = breakaway(rest)
        expected = table(1).F_sp + 10.0 * (1.0 - np.exp(-(rest + force / 30.0) / 0.5))
        assert force == pytest.approx(expected, abs=0.1)
