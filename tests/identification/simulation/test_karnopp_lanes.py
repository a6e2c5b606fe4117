"""Lanes of a block against one plant at a time."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.arrays import Array, IntArray
from identification.compiled import compiled
from identification.model.karnopp import Karnopp
from identification.simulation.free_run import run_kernel
from identification.simulation.karnopp_lanes import (
    GAIN,
    WIDTH,
    F,
    Y,
    advance,
    place,
    prepare_lanes,
    settle_flagged,
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


@compiled
def march(
    p: Array,
    tables: Array,
    s: Array,
    modes: IntArray,
    u: Array,
    h: float,
    out: Array,
) -> None:
    """Steps driven by a command: out[k, 0] positions, out[k, 1] forces before step k, per lane."""
    flat = out.reshape(-1)
    for k in range(len(u)):
        command, at, flagged = u[k], 2 * WIDTH * k, 0
        for i in range(WIDTH):
            force = s[F * WIDTH + i]
            flat[at + i] = s[Y * WIDTH + i]
            flat[at + WIDTH + i] = force
            flagged |= advance(s, i, h, force, s[GAIN * WIDTH + i] * command)
        if flagged:
            settle_flagged(flagged, s, modes, tables, p, h, flat, at)


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


def alone(p: Array, start: tuple[float, float, float], u: Array) -> Array:
    """Position, velocity and force (3, n) of one row of parameters."""
    n = len(u)
    zero, at = np.zeros(n), np.zeros(1, dtype=np.int64)
    y, v, f = (np.array([value]) for value in start)
    out, modes = np.zeros((3, n)), np.zeros(n, dtype=np.int64)
    run_kernel(p[None], H, False, 0.0, u, zero, zero, zero, at, y, v, f, out, modes)
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
