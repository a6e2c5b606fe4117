"""Exact steps against fine Euler steps, against themselves in finer samples, and case by case."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.arrays import Array, IntArray
from identification.model.karnopp import Karnopp, slip_friction
from identification.simulation.free_run import run_kernel
from identification.simulation.karnopp_step import (
    BAND_N,
    BAND_P,
    EDGE_P,
    K2,
    SLIP_N,
    SLIP_P,
    STUCK,
    Parameters,
    glided,
    kernel_parameters,
    mode_at,
    parameters,
    resolve,
    resolve_until,
)
from tests.identification.oracle import MUTANTS, euler
from tests.identification.plants import ACTUATOR, command, table

K1, COUPLING = ACTUATOR.k1, ACTUATOR.k2
H = 1e-3
State = tuple[float, float, float]


def run(
    nine: Karnopp,
    u: Array,
    h: float = H,
    k1: float = K1,
    k2: float = COUPLING,
    start: State = (0.0, 0.0, 0.0),
) -> tuple[Array, IntArray]:
    """Position, velocity and force (3, n) of the kernel driven by a command, and modes."""
    n = len(u)
    out, modes, zero = np.zeros((3, n)), np.zeros(n, dtype=np.int64), np.zeros(n)
    at = np.zeros(1, dtype=np.int64)
    y, v, force = (np.array([value]) for value in start)
    p = kernel_parameters(nine.array, k1, k2)[np.newaxis]
    run_kernel(p, h, False, 0.0, u, zero, zero, zero, at, y, v, force, out, modes)
    return out, modes


def followed(nine: Karnopp, state: State, mode: int, g: float, h: float) -> tuple[State, int]:
    """One sample without coupling, switch by switch."""
    p = parameters(kernel_parameters(nine.array, 1.0, 0.0)[np.newaxis], 0)
    return traced(p, state, mode, g, h)


def traced(p: Parameters, state: State, mode: int, g: float, h: float) -> tuple[State, int]:
    """`resolve` from and to a state."""
    y, v, force, mode = resolve(p, state[0], state[1], state[2], mode, g, h)
    return (y, v, force), mode


def excited(seconds: float, seed: int, h: float = H) -> Array:
    """A command that reaches every mode."""
    return command(h * np.arange(round(seconds / h), dtype=np.float64), seed)


@pytest.mark.parametrize("number", [1, 2, 3])
def test_fine_euler_steps_come_to_the_same(number: int) -> None:
    nine, u = table(number), excited(2.0, 3)
    exact, modes = run(nine, u)
    fine = euler(nine, K1, COUPLING, u, H, 2000)
    assert {SLIP_P, SLIP_N, BAND_P, BAND_N, STUCK} <= set(modes.tolist())
    assert np.max(np.abs(exact[0] - fine[0])) < 2e-6
    assert np.max(np.abs(exact[2] - fine[2])) < 2e-6 * COUPLING
    assert np.median(np.abs(exact[1] - fine[1])) < 1e-6


@pytest.mark.parametrize("wrong", MUTANTS)
def test_wrong_variants_are_distinguished(wrong: int) -> None:
    nine, u = table(3), excited(2.0, 3)
    exact, _ = run(nine, u)
    mutant = euler(nine, K1, COUPLING, u, H, 200, wrong)
    assert np.max(np.abs(exact[0] - mutant[0])) > 1e-4


@pytest.mark.parametrize("parts", [2, 5])
@pytest.mark.parametrize("number", [1, 2, 3])
def test_shorter_samples_change_nothing(number: int, parts: int) -> None:
    nine, u = table(number), excited(40.0, 5)
    whole, modes = run(nine, u)
    split, split_modes = run(nine, np.repeat(u, parts), H / parts)
    assert np.max(np.abs(whole[0] - split[0, ::parts])) < 1e-11
    assert np.max(np.abs(whole[2] - split[2, ::parts])) < 1e-7
    assert np.mean(modes != split_modes[::parts]) < 1e-3


@pytest.mark.parametrize("h", [1e-2, 5e-2])
def test_long_samples_with_several_switches_are_exact(h: float) -> None:
    nine, u = replace(table(1), F_vp=900.0, F_vn=700.0, m=0.3), excited(40.0, 2, h)
    whole, _ = run(nine, u, h)
    split, _ = run(nine, np.repeat(u, 50), h / 50)
    assert np.max(np.abs(whole[0] - split[0, ::50])) < 1e-10
    fine = euler(nine, K1, COUPLING, u[:100], h, 50_000)
    assert np.max(np.abs(whole[0, :100] - fine[0])) < 5e-6


def test_no_coupling_and_no_viscous_friction() -> None:
    nine = replace(table(1), F_vp=0.0, F_vn=0.0)
    u = 0.1 * np.cos(2 * np.pi * 5.0 * H * np.arange(1000))
    exact, modes = run(nine, u, k2=0.0)
    fine = euler(nine, K1, 0.0, u, H, 2000)
    assert {SLIP_P, SLIP_N} <= set(modes.tolist())
    assert np.max(np.abs(exact[0] - fine[0])) < 2e-5 * np.max(np.abs(fine[0]))
    p = kernel_parameters(nine.array, K1, 0.0)
    assert p[K2] == 0.0


def test_a_constant_mode_of_closed_form() -> None:
    nine, force, v = table(1), 60.0, 0.1
    (y, v_end, _), mode = followed(nine, (0.0, v, force), SLIP_P, 0.0, 0.02)
    rest = (force - nine.F_cp) / nine.F_vp
    decay = np.exp(-nine.F_vp / nine.m * 0.02)
    assert mode == SLIP_P
    assert v_end == pytest.approx(rest + (v - rest) * decay, rel=1e-12)
    assert y == pytest.approx(rest * 0.02 + (v - rest) * (1 - decay) / 300.0, rel=1e-11)


def test_sticking_body_does_not_move() -> None:
    nine, force = table(1), np.linspace(-23.0, 20.6, 400)
    u = np.diff(force, prepend=0.0) / (K1 * H)
    out, modes = run(nine, u[1:], start=(0.01, 0.0, -23.0))
    assert set(modes.tolist()) == {STUCK}
    assert np.all(out[0] == 0.01)
    assert np.all(out[1] == 0.0)


@pytest.mark.parametrize(("limit", "slope", "mode"), [(20.6, 1e3, BAND_P), (-23.0, -1e3, BAND_N)])
def test_breakaway_at_the_limit(limit: float, slope: float, mode: int) -> None:
    nine, before = table(1), 1e-3 * slope
    state, after = followed(nine, (0.0, 0.0, limit - before), STUCK, slope, 1e-3 * (1 - 1e-9))
    assert after == STUCK
    assert state[:2] == (0.0, 0.0)
    (y, v, force), after = followed(nine, (0.0, 0.0, limit - before), STUCK, slope, 3e-3)
    assert after == mode
    # a = slope t/m from the instant of breakaway on
    assert v == pytest.approx(slope * 2e-3**2 / 2, rel=1e-9)
    assert y == pytest.approx(slope * 2e-3**3 / 6, rel=1e-9)
    assert force == pytest.approx(limit + 2 * before, rel=1e-12)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_band_with_too_little_force_stops_the_body_at_once(sign: float) -> None:
    nine = table(1)
    p = parameters(kernel_parameters(nine.array, 1.0, 0.0)[np.newaxis], 0)
    assert mode_at(p, sign * 0.039, sign * 15.0) == STUCK
    (y, v, _), mode = followed(
        nine, (0.0, sign * 0.05, sign * 15.0), SLIP_P if sign > 0 else SLIP_N, 0.0, 0.01
    )
    assert (mode, v) == (STUCK, 0.0)
    assert 0.0 < sign * y < 0.05 * 0.01


def test_slides_along_the_edge_where_slip_friction_holds_more_than_the_stick_limit() -> None:
    nine = table(1)
    at_edge = float(slip_friction(np.array([nine.dv_p]), nine)[0])
    assert at_edge == 24.0 > nine.F_sp
    (y, v, _), mode = followed(nine, (0.0, 0.0, 22.0), BAND_P, 0.0, 0.1)
    assert (mode, v) == (EDGE_P, nine.dv_p)
    reached = nine.m * nine.dv_p / (22.0 - nine.F_sp)
    assert y == pytest.approx(nine.dv_p * (0.1 - reached / 2), rel=1e-12)
    (_, v, _), mode = followed(nine, (0.0, nine.dv_p, 22.0), EDGE_P, 100.0, 0.03)
    assert mode == SLIP_P
    assert v > nine.dv_p
    (_, v, _), mode = followed(nine, (0.0, nine.dv_p, 22.0), EDGE_P, -100.0, 0.03)
    assert (mode, v) == (STUCK, 0.0)


def test_band_is_left_and_entered_again_within_one_sample() -> None:
    # Stiff coupling: out of the band, back through it and stuck before the sample is over.
    nine = Karnopp(2.3, 19.7, 24.4, 275.0, 208.0, 0.0117, -0.00681, 16.8, -26.26)
    p = parameters(kernel_parameters(nine.array, K1, 1.185e6)[np.newaxis], 0)
    state: State = (0.0, -0.00608, -38.34)
    g, mode, seen = 31.5e3, BAND_N, set()
    (whole, _, _), _ = traced(p, state, mode, g, 1e-3)
    for _ in range(64):
        state, mode = traced(p, state, mode, g, 1e-3 / 64)
        seen.add(mode)
    assert {BAND_N, SLIP_N, STUCK} <= seen
    assert whole == pytest.approx(state[0], abs=1e-14)


def mirrored(nine: Karnopp) -> Karnopp:
    """The plant seen from the other side."""
    return Karnopp(
        nine.m,
        nine.F_cn,
        nine.F_cp,
        nine.F_vn,
        nine.F_vp,
        -nine.dv_n,
        -nine.dv_p,
        -nine.F_sn,
        -nine.F_sp,
    )


plants = st.builds(
    Karnopp,
    m=st.floats(0.2, 10.0),
    F_cp=st.floats(0.0, 30.0),
    F_cn=st.floats(0.0, 30.0),
    F_vp=st.floats(0.0, 900.0),
    F_vn=st.floats(0.0, 900.0),
    dv_p=st.floats(1e-3, 0.1),
    dv_n=st.floats(-0.1, -1e-3),
    F_sp=st.floats(1.0, 40.0),
    F_sn=st.floats(-40.0, -1.0),
)
couplings = st.sampled_from([0.0, 300.0, COUPLING, 1e6])


@settings(max_examples=60)
@given(plants, couplings, st.integers(0, 1000))
def test_mirrored_plant_under_mirrored_command(nine: Karnopp, k2: float, seed: int) -> None:
    u = excited(1.0, seed)
    one, _ = run(nine, u, k2=k2)
    other, _ = run(mirrored(nine), -u, k2=k2)
    assert np.array_equal(one, -other)


@settings(max_examples=60)
@given(plants, couplings, st.integers(0, 1000))
def test_halved_samples_of_any_plant(nine: Karnopp, k2: float, seed: int) -> None:
    u = excited(1.0, seed)
    whole, _ = run(nine, u, k2=k2)
    split, _ = run(nine, np.repeat(u, 2), H / 2, k2=k2)
    assert np.max(np.abs(whole[0] - split[0, ::2])) < 1e-9 * max(1.0, np.max(np.abs(whole[0])))


@settings(max_examples=60)
@given(plants, st.sampled_from([0.0, 300.0, COUPLING]), st.integers(0, 1000))
def test_friction_never_drives(nine: Karnopp, k2: float, seed: int) -> None:
    # While sliding. In the band eq. (1) sets friction against the force, whatever way v points.
    u = np.repeat(excited(1.0, seed), 10)
    (y, v, force), modes = run(nine, u, H / 10, k2=k2)
    energy, work = 0.5 * nine.m * v**2, 0.5 * (force[1:] + force[:-1]) * np.diff(y)
    sliding = (modes[1:] == modes[:-1]) & np.isin(modes[1:], [SLIP_P, SLIP_N])
    gain = (np.diff(energy) - work)[sliding]
    assert np.all(gain <= 1e-4 * (np.max(energy) + 1e-9))
    stuck = modes == STUCK
    assert np.all(v[stuck] == 0.0)
    assert np.all((force[stuck] <= nine.F_sp + 1e-9) & (force[stuck] >= nine.F_sn - 1e-9))


@pytest.mark.parametrize("mode", [SLIP_P, SLIP_N, BAND_P])
def test_a_short_glide_is_the_exact_step_or_none(mode: int) -> None:
    p = parameters(kernel_parameters(table(1).array, 0.0, COUPLING)[None], 0)
    side = -1.0 if mode == SLIP_N else 1.0
    taken = 0
    drawn = np.random.default_rng(0).uniform((0.0, -40.0, -2e4), (0.3, 80.0, 2e4), (500, 3))
    for v, force, g in drawn:
        at = side * float(v), side * float(force), mode, side * float(g), 2.5e-4
        moved, after, on = glided(p, *at)
        y, exact, _, ends = resolve(p, 0.0, *at)
        if on:
            assert moved == pytest.approx(y, abs=1e-13)
            assert after == pytest.approx(exact, abs=1e-11)
            assert ends == mode
        elif mode != BAND_P and v > 0.0:  # a body that slides away from the band glides
            assert min(abs(after), v) < 0.08
        taken += on
    assert (taken == 0) == (mode == BAND_P)


def test_a_step_from_switch_to_switch_is_the_whole_step() -> None:
    p = parameters(kernel_parameters(table(1).array, 9000.0, COUPLING)[None], 0)
    nine, switched = table(1), 0
    for force, g in ((0.9 * nine.F_sp, 4e3), (0.9 * nine.F_sn, -4e3), (1.2 * nine.F_sp, -9e3)):
        mode = STUCK if abs(force) < nine.F_sp else BAND_P
        whole = resolve(p, 0.0, 0.0, force, mode, g, 2e-3)
        y, v, f, left, pieces = 0.0, 0.0, force, 2e-3, 0
        while left > 0.0:
            before = mode
            y, v, f, mode, left = resolve_until(p, y, v, f, mode, g, left, 1)
            pieces += 1
            assert mode != before or left == 0.0
        switched += pieces - 1
        assert (y, v, f, mode) == whole
    assert switched >= 4
    assert resolve_until(p, 0.0, 0.0, 0.0, STUCK, 0.0, 2e-3, 1)[3:] == (STUCK, 0.0)


@pytest.mark.parametrize("m", [1e-9, 1e-5])
def test_a_body_next_to_weightless_is_refused_not_followed_for_ever(m: float) -> None:
    nine = np.array([m, 15.0, 12.0, 160.0, 185.0, 0.03, -0.03, 18.0, -15.0])
    p = parameters(kernel_parameters(nine, 9000.0, 8000.0)[np.newaxis], 0)
    y, v, force, mode = 0.0, 0.0, 17.9, STUCK
    for _ in range(20):
        y, v, force, mode = resolve(p, y, v, force, mode, 9000.0 * 0.07, 2e-3)
    assert np.isnan(y)
