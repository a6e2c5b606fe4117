"""Lanes of a block against one plant at a time."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.arrays import Array
from identification.model.karnopp import Karnopp
from identification.simulation.free_run import run_kernel
from identification.simulation.karnopp_lanes import (
    WIDTH,
    march,
    march_forced,
    place,
    prepare_lanes,
    work_space,
)
from identification.simulation.karnopp_step import kernel_parameters
from tests.identification.plants import ACTUATOR, command, table

H = 1e-3


def excited(n: int, seed: int) -> Array:
    """A command of `n` samples."""
    return command(H * np.arange(n, dtype=np.float64), seed)


def spread(nine: Karnopp, seed: int, size: float = 0.3) -> Array:
    """Kernel parameters (WIDTH, 11) around a plant, lane 0 being it."""
    factors = np.exp(size * np.random.default_rng(seed).standard_normal((WIDTH, 9)))
    factors[0] = 1.0
    return np.stack(
        [kernel_parameters(nine.array * row, ACTUATOR.k1, ACTUATOR.k2) for row in factors]
    )


def lanes(p: Array, start: tuple[float, float, float], u: Array) -> Array:
    """Positions and forces (n, 2, WIDTH) of a block driven by a command, in two chunks."""
    s, modes, tables = work_space()
    prepare_lanes(p, H, tables, s)
    for lane in range(WIDTH):
        place(s, modes, tables, p, lane, *start)
    out, half = np.zeros((len(u), 2, WIDTH)), len(u) // 2
    march(p, tables, s, modes, u[:half], H, out[:half])
    march(p, tables, s, modes, u[half:], H, out[half:])
    return out


def alone(
    p: Array,
    start: tuple[float, float, float],
    u: Array,
    forced: tuple[Array, Array, Array] | None = None,
) -> Array:
    """Position, velocity and force (3, n) of one row of parameters."""
    n = len(u)
    zero, at = np.zeros(n), np.zeros(1, dtype=np.int64)
    force, slope, y_m = forced or (zero, zero, zero)
    y, v, f = (np.array([value]) for value in start)
    out, modes = np.zeros((3, n)), np.zeros(n, dtype=np.int64)
    run_kernel(p[None], H, forced is not None, 0.0, u, force, slope, y_m, at, y, v, f, out, modes)
    return out


@pytest.mark.parametrize("start", [(0.0, 0.0, 0.0), (0.02, 0.1, 30.0), (-0.01, -0.2, -50.0)])
@pytest.mark.parametrize("number", [1, 2, 3])
def test_lanes_are_the_scalar_run(number: int, start: tuple[float, float, float]) -> None:
    p = spread(table(number), number)
    u = excited(6000, number)
    out = lanes(p, start, u)
    for lane in range(WIDTH):
        one = alone(p[lane], start, u)
        assert np.max(np.abs(out[:, 0, lane] - one[0])) < 1e-12
        assert np.max(np.abs(out[:, 1, lane] - one[2])) < 1e-8


@pytest.mark.parametrize("coupling", [0.0, 1e3, 1e6])
def test_forced_lanes_are_the_scalar_run(coupling: float) -> None:
    p = spread(table(2), 7)
    p[:, 9], p[:, 10] = 0.0, coupling
    u = excited(4000, 4)
    truth = alone(spread(table(2), 7)[0], (0.0, 0.0, 0.0), u)
    y, force = truth[0], truth[2]
    slope_y, slope = (np.append(np.diff(a) / H, 0.0) for a in (y, force))
    s, modes, tables = work_space()
    prepare_lanes(p, H, tables, s)
    for lane in range(WIDTH):
        place(s, modes, tables, p, lane, y[0], 0.0, force[0])
    out = np.zeros((len(u), 2, WIDTH))
    march_forced(p, tables, s, modes, y, force, slope_y, slope, H, out)
    for lane in range(WIDTH):
        one = alone(p[lane], (y[0], 0.0, force[0]), 0.0 * u, (force, slope, y))
        assert np.max(np.abs(out[:, 0, lane] - one[0])) < 1e-12
        assert np.max(np.abs(out[:, 1, lane] - one[2])) < 1e-12 * max(coupling, 1e3)


@settings(max_examples=30)
@given(st.permutations(list(range(WIDTH))), st.integers(0, 100))
def test_lanes_do_not_see_each_other(order: list[int], seed: int) -> None:
    p = spread(table(1), seed)
    u = excited(1500, seed)
    rest = (0.0, 0.0, 0.0)
    assert np.array_equal(lanes(p[order], rest, u), lanes(p, rest, u)[:, :, order])


def test_parameters_given_are_not_changed() -> None:
    p, u = spread(table(1), 1), excited(500, 1)
    before = p.copy(), u.copy()
    lanes(p, (0.0, 0.0, 0.0), u)
    assert np.array_equal(p, before[0])
    assert np.array_equal(u, before[1])
