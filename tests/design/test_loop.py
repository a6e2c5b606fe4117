"""The closed loop against a loop written out in plain Python, one plant against many, limits."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from design.force_pi import ForcePI
from design.loop import Cascade, LoopNoise, LoopRun, loop_costs, simulate_loop, simulate_loops
from design.loop_kernels import force_command
from design.pid import pd_to_rst, pid_to_rst
from design.rst import RST
from identification.arrays import Array
from identification.effects._library import built_in
from identification.errors import BadModel
from identification.log import Log
from identification.model.karnopp import Karnopp
from identification.model.plant import Actuator, Motor, Plant
from identification.simulation.free_run import free_run
from identification.simulation.karnopp_step import STUCK
from tests.identification.oracle import euler
from tests.identification.plants import ACTUATOR, table

H = 1e-3
PLANT = Plant(table(1), ACTUATOR)
MOTOR = Plant(table(1), Motor(35.15))
PI = ForcePI(0.02, 0.05)
PID = pid_to_rst(1754.0, 0.072, 0.018, 0.2, H)
PD = pd_to_rst(200.0, 0.1, 0.2, H)
CASCADE = Cascade(PID, PI)
# Degree 4, T unlike R, a tracking model: everything that an RST may have.
GENERAL = RST(
    R=1500.0 * np.convolve([1.2, -1.0], [0.5, 0.3, 0.1, 0.1]),
    S=np.convolve([2.0, -0.6], [1.0, -0.3, 0.1, 0.02]),
    T=np.array([700.0, 800.0, -1200.0]),
    h=H,
    B_m=np.array([0.0, 0.05]),
    A_m=np.array([1.0, -0.95]),
)


def steps(n: int, height: float = 0.1, dwell: int = 700) -> Array:
    """A reference that steps between 0 and `height` every `dwell` samples."""
    return np.asarray(height * ((np.arange(n) // dwell) % 2), dtype=np.float64)


def noise(n: int, seed: int = 1) -> LoopNoise:
    """The paper's noise."""
    return LoopNoise.draw(n, 1e-5, 1e-2, np.random.default_rng(seed))


def written_out(
    controller: RST, reference: Array, run: LoopRun, limit: float, pi: ForcePI | None
) -> Array:
    """The command that the written equations give for what the run measured, from rest at 0."""
    u_all, r, f_ref = np.zeros(len(reference)), np.zeros(len(reference)), np.zeros(len(reference))

    def past(c: Array, x: Array, k: int, first: int = 0) -> float:
        return sum(float(c[j] * x[k - j]) for j in range(first, len(c)) if k >= j)

    integral = 0.0
    for k in range(len(reference)):
        model = past(controller.B_m, reference, k) - past(controller.A_m, r, k, 1)
        r[k] = model / controller.A_m[0]
        f_ref[k] = past(controller.T, r, k) - past(controller.R, run.y_measured, k)
        f_ref[k] = (f_ref[k] - past(controller.S, f_ref, k, 1)) / controller.S[0]
        if pi is None:
            f_ref[k] = u_all[k] = np.clip(f_ref[k], -limit, limit)
            continue
        error = f_ref[k] - run.F_measured[k]
        free = pi.k_i * error + integral
        u_all[k] = np.clip(free, -limit, limit)
        if abs(free) <= limit or free * error < 0:
            integral += pi.k_i * H / pi.T_i * error
    return u_all


@pytest.mark.parametrize("controller", [PD, PID, GENERAL])
@pytest.mark.parametrize("limit", [np.inf, 0.1])
def test_controllers_are_the_written_equations(controller: RST, limit: float) -> None:
    r = steps(2000)
    bound = None if limit == np.inf else limit
    run = simulate_loop(PLANT, Cascade(controller, PI, bound), r, H, noise=noise(2000))
    assert np.max(np.abs(run.u - written_out(controller, r, run, limit, PI))) < 1e-9
    assert np.max(np.abs(run.u)) == limit if bound else np.max(np.abs(run.u)) > 0.1


@pytest.mark.parametrize("controller", [PD, PID])
def test_motor_takes_the_command_at_once(controller: RST) -> None:
    r = steps(2000)
    scaled = replace(controller, R=controller.R / 35.15, T=controller.T / 35.15)
    limit = 3.0 if controller is PID else 0.6
    run = simulate_loop(MOTOR, Cascade(scaled, None, limit), r, H, noise=noise(2000))
    assert np.max(np.abs(run.u)) == limit
    assert np.max(np.abs(run.u - written_out(scaled, r, run, limit, None))) < 1e-6
    assert np.array_equal(run.F, 35.15 * run.u)
    assert np.array_equal(run.F_measured, run.F)
    assert np.max(run.y) > 5e-4


def test_plant_is_the_written_equation() -> None:
    run = simulate_loop(PLANT, CASCADE, steps(2500), H, noise=noise(2500))
    fine = euler(table(1), ACTUATOR.k1, ACTUATOR.k2, run.u, H, 2000)
    assert np.max(np.abs(run.y - fine[0])) < 2e-6
    assert np.max(np.abs(run.F - fine[2])) < 2e-6 * ACTUATOR.k2


def test_shorter_plant_steps_change_nothing_over_40_s() -> None:
    n = 40_001
    run = simulate_loop(PLANT, CASCADE, steps(n, dwell=5000), H, noise=noise(n))
    for parts in (1, 2, 3):
        u = np.repeat(run.u, parts)
        t = H / parts * np.arange(len(u), dtype=np.float64)
        log = Log("replay", {"t": t, "u": u, "y": np.zeros(len(u))})
        replay = free_run(PLANT, log, (0.0, 0.0, 0.0), "command")
        assert np.max(np.abs(replay.y[::parts] - run.y)) < 1e-11
        assert np.max(np.abs(replay.F[::parts] - run.F)) < 1e-7


def many(count: int, actuator: Actuator | Motor, seed: int = 0) -> list[Plant]:
    """Plants around table 1."""
    factors = np.exp(0.2 * np.random.default_rng(seed).standard_normal((count, 9)))
    return [Plant(Karnopp.from_array(table(1).array * row), actuator) for row in factors]


@pytest.mark.slow
@pytest.mark.parametrize("controller", [PD, PID, GENERAL])
@pytest.mark.parametrize("motor", [False, True])
def test_many_plants_are_each_alone(controller: RST, motor: bool) -> None:
    n, count = 1500, 18
    tolerance = 1e4 if motor else 1.0  # each stop in a hunting loop magnifies the last digit
    plants = many(count, Motor(35.15) if motor else ACTUATOR)
    pi = None if motor else PI
    if motor:
        controller = replace(controller, R=controller.R / 35.15, T=controller.T / 35.15)
    rng = np.random.default_rng(2)
    own = LoopNoise(1e-5 * rng.standard_normal((n, count)), 1e-2 * rng.standard_normal((n, count)))
    cascade, start = Cascade(controller, pi, 2.0), (0.01, 0.0, 3.0)
    for given in (None, noise(n), own):
        runs = simulate_loops(plants, cascade, steps(n), H, noise=given, start=start)
        assert runs.y.shape == (n, count)
        for i in (0, 7, 15, 16, 17):
            one_noise = LoopNoise(own.y[:, i], own.F[:, i]) if given is own else given
            one = simulate_loop(plants[i], cascade, steps(n), H, noise=one_noise, start=start)
            for name in ("y", "v", "y_measured"):
                apart = np.abs(getattr(runs, name)[:, i] - getattr(one, name))
                assert np.max(apart) < 1e-11 * tolerance
            for name in ("F", "F_measured", "u"):
                apart = np.abs(getattr(runs, name)[:, i] - getattr(one, name))
                assert np.max(apart) < 1e-7 * tolerance
            assert np.mean(runs.mode[:, i] != one.mode) < 1e-2


def test_costs_are_the_sums_over_the_window() -> None:
    n, plants = 1200, many(20, ACTUATOR)
    runs = simulate_loops(plants, CASCADE, steps(n), H, noise=noise(n))
    for window in (None, (300, 900)):
        part = slice(*window) if window else slice(None)
        costs = loop_costs(plants, CASCADE, steps(n), H, noise=noise(n), window=window)
        error = (runs.r[:, None] - runs.y)[part]
        assert costs.squared_error == pytest.approx(np.sum(error**2, axis=0), rel=1e-12)
        assert costs.squared_command == pytest.approx(np.sum(runs.u[part] ** 2, axis=0), rel=1e-12)


def test_noise_enters_through_the_controller_only() -> None:
    n = 500
    disturbed = noise(n)
    run = simulate_loop(PLANT, CASCADE, steps(n, dwell=100), H, noise=disturbed)
    assert run.y_measured - run.y == pytest.approx(disturbed.y, abs=1e-16)
    assert run.F_measured - run.F == pytest.approx(disturbed.F, abs=1e-12)
    quiet = simulate_loop(PLANT, CASCADE, steps(n, dwell=100), H)
    assert np.array_equal(quiet.y, quiet.y_measured)
    assert 0.0 < np.max(np.abs(quiet.y - run.y)) < 1e-3


@pytest.mark.parametrize("y_0", [0.0, 0.07, -0.2])
@pytest.mark.parametrize("controller", [PD, PID])
def test_at_rest_on_its_target_it_stays(controller: RST, y_0: float) -> None:
    run = simulate_loop(PLANT, Cascade(controller, PI), np.full(300, y_0), H, start=(y_0, 0.0, 0.0))
    assert np.all(run.y == y_0)
    assert np.max(np.abs(run.u)) < 1e-9
    assert set(run.mode.tolist()) == {STUCK}
    assert run.t == pytest.approx(H * np.arange(300))


def test_integral_rests_while_the_limit_holds_the_error_up() -> None:
    command: Callable[..., tuple[float, float, float]] = force_command
    assert command(10.0, 0.0, 0.0, 0.02, 0.001, 5.0) == pytest.approx((0.2, 0.2, 0.01))
    assert command(400.0, 0.0, 1.0, 0.02, 0.001, 5.0) == pytest.approx((5.0, 9.0, 1.0))
    assert command(-400.0, 0.0, -1.0, 0.02, 0.001, 5.0) == pytest.approx((-5.0, -9.0, -1.0))
    # On its way back it integrates although it is still clipped.
    assert command(-10.0, 0.0, 9.0, 0.02, 0.001, 5.0) == pytest.approx((5.0, 8.8, 8.99))


def test_without_compensation_pd_rests_off_target_and_pid_pushes_on() -> None:
    # Paper, figure 6: the error stays without the compensator; an integral builds up force.
    n = 20_000
    rest, half = np.full(n, 0.1), slice(n // 2, None)
    pd = simulate_loop(PLANT, Cascade(PD, PI), rest, H, noise=noise(n))
    assert np.ptp(pd.y[half]) < 1e-4
    assert abs(pd.y[-1] - 0.1) > 5e-3
    pid = simulate_loop(PLANT, CASCADE, rest, H, noise=noise(n))
    assert np.max(np.abs(pid.y[half] - 0.1)) < 1e-3
    assert abs(pid.F[-1] - pid.F[n // 2]) > 1.0


def test_arrays_given_are_not_changed() -> None:
    r, given = steps(300), noise(300)
    before = r.copy(), given.y.copy()
    run = simulate_loop(PLANT, CASCADE, r, H, noise=given)
    simulate_loops([PLANT, PLANT], CASCADE, r, H, noise=given)
    assert np.array_equal(r, before[0])
    assert np.array_equal(given.y, before[1])
    with pytest.raises(ValueError, match="read-only"):
        run.r[0] = 1.0


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"plant": Plant(table(1))}, "no actuator"),
        ({"plant": MOTOR}, "no force controller"),
        ({"pi": None}, "a force controller"),
        ({"h": 2e-3}, "sampled at 0.001 s"),
        ({"reference": np.zeros((4, 2))}, "shape"),
        ({"reference": np.zeros(0)}, "shape"),
        ({"reference": np.array([0.0, np.nan])}, "finite"),
        ({"limit": 0.0}, "control limit 0 V"),
        ({"noise": noise(3)}, "noise of y"),
    ],
)
def test_refusals(change: dict[str, object], reason: str) -> None:
    parts: dict[str, object] = {
        "plant": PLANT,
        "pi": PI,
        "h": H,
        "reference": steps(50),
        "limit": None,
        "noise": None,
        **change,
    }
    plant, pi, h, reference, limit, given = parts.values()
    with pytest.raises(BadModel, match=reason):
        simulate_loop(
            plant,  # type: ignore[arg-type]
            Cascade(PID, pi, limit),  # type: ignore[arg-type]
            reference,  # type: ignore[arg-type]
            h,  # type: ignore[arg-type]
            noise=given,  # type: ignore[arg-type]
        )


def test_plants_of_one_kind_only() -> None:
    with pytest.raises(BadModel, match="of 2 kinds"):
        simulate_loops([PLANT, MOTOR], CASCADE, steps(50), H)
    with pytest.raises(BadModel, match="0 plants"):
        simulate_loops([], CASCADE, steps(50), H)
    for T_i in (0.0, -1.0, np.nan):
        with pytest.raises(BadModel, match="T_i"):
            ForcePI(0.02, T_i)


def test_effects_are_refused_by_the_plain_loops() -> None:
    sprung = replace(PLANT, effects=(built_in()["spring"].acting({"k": 40.0}),))
    for simulate in (simulate_loops, loop_costs):
        with pytest.raises(BadModel, match="spring: simulate it by simulate_servo"):
            simulate([PLANT, sprung], CASCADE, steps(10), H)
    with pytest.raises(BadModel, match="simulate_servo"):
        simulate_loop(sprung, CASCADE, steps(10), H)
