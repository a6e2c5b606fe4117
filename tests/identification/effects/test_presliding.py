"""Elastic micro-motion against the LuGre model integrated by scipy; rest, stiffness, energy."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from identification.arrays import Array
from identification.effects._library import built_in
from identification.log import Log
from identification.model.karnopp import Karnopp
from identification.model.plant import Motor, Plant
from identification.simulation import free_run as simulate
from identification.simulation.effect_table import LONGEST_BRISTLE, EffectTable, pieces
from identification.simulation.free_run import FreeRun, free_run
from tests.identification.plants import table

H = 1e-3
NINE = table(1)
K_A = 100.0


def driven(
    u: Array, sigma_0: float, nine: Karnopp = NINE, step: float = LONGEST_BRISTLE
) -> FreeRun:
    """The plant with a bristle under the force K_A u, held over every sample."""
    log = Log("made", {"t": H * np.arange(len(u), dtype=np.float64), "y": 0.0 * u, "u": u})
    bristle = built_in()["presliding"].acting({"sigma_0": sigma_0})
    plant = Plant(nine, Motor(K_A), (bristle,))
    return free_run(plant, log, (0.0, 0.0, 0.0), "command", bristle_step=step)


def lugre(u: Array, sigma_0: float, nine: Karnopp = NINE, damping: float = 0.5) -> Array:
    """Position and velocity (2, n) of the LuGre model, whose sigma_1 is for this damping."""
    sigma_1 = 2.0 * damping * math.sqrt(sigma_0 * nine.m)

    def rates(_t: float, x: Array, F: float) -> list[float]:
        _, v, z = x
        up = v > 0 or (v == 0 and z >= 0)
        low, high, edge, viscous = (
            (nine.F_cp, nine.F_sp, nine.dv_p, nine.F_vp)
            if up
            else (nine.F_cn, -nine.F_sn, nine.dv_n, nine.F_vn)
        )
        level = low + (high - low) * math.exp(-((v / edge) ** 2))
        bent = 1.0 - z * (1.0 if up else -1.0) / level
        friction = z + sigma_1 * max(bent, 0.0) * v + viscous * v
        return [v, (F - friction) / nine.m, sigma_0 * bent * v]

    out, x = np.zeros((2, len(u))), np.zeros(3)
    for k, one in enumerate(u):
        out[:, k] = x[:2]
        found = solve_ivp(
            rates, (0.0, H), x, args=(K_A * one,), rtol=1e-7, atol=1e-10, method="LSODA"
        )
        x = found.y[:, -1]
    return out


def strokes(seconds: float) -> Array:
    """Micro-motion within the stick limits, then breakaways in both directions."""
    t = H * np.arange(round(seconds / H), dtype=np.float64)
    size = np.where(t < 0.3, 0.1, 0.6)
    return np.asarray(size * np.sin(2 * np.pi * 4.0 * t))


@pytest.mark.slow
@pytest.mark.parametrize("sigma_0", [2e3, 1e5])
def test_it_is_the_lugre_model(sigma_0: float) -> None:
    u = strokes(0.8)
    found, expected = driven(u, sigma_0), lugre(u, sigma_0)
    size = float(np.max(np.abs(expected[0])))
    assert size > 0.005
    assert np.max(np.abs(found.y - expected[0])) < 2e-4 * size
    assert np.max(np.abs(found.v - expected[1])) < 2e-3 * np.max(np.abs(expected[1]))
    small = slice(0, 300)
    assert np.max(np.abs(found.y[small] - expected[0, small])) < 2e-3 * np.ptp(expected[0, small])
    other = lugre(u, 1.1 * sigma_0)
    assert np.max(np.abs(found.y[small] - other[0, small])) > 1e-2 * np.ptp(expected[0, small])


def test_below_the_limit_it_is_a_spring() -> None:
    u = 0.02 * np.minimum(H * np.arange(2000, dtype=np.float64), 1.0)
    run = driven(u, 1e5)
    z = 2.0  # N, of a limit of 20.6 N
    limit = NINE.F_sp
    assert run.y[-1] == pytest.approx(-limit / 1e5 * math.log(1.0 - z / limit), rel=0.02)
    assert abs(run.v[-1]) < 1e-9
    free = driven(np.concatenate([u, u[::-1]]), 1e5)
    # Unloading follows the other branch: what stays is the Dahl model's hysteresis.
    assert 0.0 < free.y[-1] < 0.15 * run.y[-1]


@pytest.mark.parametrize("sigma_0", [1e4, 1e6, 1e8])
def test_any_stiffness_is_stable_and_comes_to_rest(sigma_0: float) -> None:
    u = np.concatenate([strokes(1.0), np.zeros(2000)])
    run = driven(u, sigma_0)
    assert np.max(np.abs(run.y)) < 0.2
    assert abs(run.v[-1]) < 1e-6
    assert run.mode[-1] == 0
    free = K_A * u[:-1] * np.diff(run.y) - 0.5 * NINE.m * np.diff(run.v**2)
    assert np.min(np.cumsum(free)) > -1e-9


def test_without_micro_damping_it_would_ring() -> None:
    # LuGre without sigma_1, by the oracle: the body at rest rings on for long.
    u = np.concatenate([np.full(50, 0.05), np.zeros(250)])
    ringing, damped = lugre(u, 1e5, damping=0.0), driven(u, 1e5)
    assert np.ptp(ringing[1, -50:]) > 20.0 * np.ptp(damped.v[-50:])


def test_half_the_sub_step_gives_the_same_from_breakaway_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    u = strokes(1.0)
    runs = []
    for parts in (1, 4):

        def finer(table: EffectTable, h: float, bristle: float, parts: int = parts) -> int:
            return parts * pieces(table, h, bristle)

        monkeypatch.setattr(simulate, "pieces", finer)
        runs.append(driven(u, 1e5, replace(NINE, dv_p=0.005, dv_n=-0.005)))
    assert np.max(np.abs(runs[0].y - runs[1].y)) < 1e-6


def test_an_eighth_of_the_sub_step_errs_by_far_less() -> None:
    # From breakaways through sliding to reversals; of first order it would err by an eighth.
    u = strokes(1.0)
    exact = driven(u, 1e5, step=3.90625e-6).y
    coarse, fine = (
        float(np.sqrt(np.mean((driven(u, 1e5, step=step).y - exact) ** 2)))
        for step in (5e-4, 6.25e-5)
    )
    assert coarse < 5e-6
    assert fine < 0.05 * coarse
