"""Two masses and a spring, identified from the motion of the first; one body is never taken for
two."""

import numpy as np
import pytest

from identification.effects._library import built_in
from identification.estimation.fit import fit_plant
from identification.estimation.two_masses import _left_of as left_by
from identification.estimation.two_masses import _windows as windows
from identification.estimation.two_masses import position_errors, two_masses
from identification.log import Log, Rig
from identification.tracing.trace import trace

H, SUB = 1e-3, 4
SECONDS = 10.0
RIG = Rig("force", motion="rotary")


def log_of(
    m_1: float, m_2: float, k: float, *, damping: float, seed: int, F_c: float = 0.05
) -> Log:
    """A motor with Coulomb friction that turns a load through a spring (k = 0: alone); with more
    than 0.05 N m of it left without a force for half a second of four, in which it stops."""
    rng, n = np.random.default_rng(seed), round(SECONDS / H)
    t = H * np.arange(n)
    steps = np.repeat(rng.uniform(-1.0, 1.0, n // 20), 20)
    force = 0.25 * np.sin(2.0 * np.pi * 0.7 * t) + 0.2 * np.sin(2.0 * np.pi * 3.1 * t) + 0.1 * steps
    force = np.where((F_c > 0.05) & (t % 4.0 > 3.5), 0.0, force)
    y = np.zeros(n)
    p, v, q, w = 0.0, 0.0, 0.0, 0.0
    dt = H / SUB
    for i in range(n):
        y[i] = p
        for _ in range(SUB):
            spring = k * (p - q) + damping * (v - w)
            free = v + dt * (force[i] - spring) / m_1
            stop = dt * F_c / m_1
            v = np.sign(free) * max(abs(free) - stop, 0.0)
            w += dt * spring / m_2
            p, q = p + dt * v, q + dt * w
    shown = np.asarray(y + 1e-5 * rng.standard_normal(n), dtype=np.float64)
    return Log("two", {"t": np.asarray(t, dtype=np.float64), "y": shown, "F": force})


@pytest.mark.parametrize(("m_1", "m_2", "hertz"), [(1e-3, 3e-3, 25.0), (2e-3, 1e-3, 40.0)])
def test_resonance_and_both_masses_are_found(m_1: float, m_2: float, hertz: float) -> None:
    k = (2.0 * np.pi * hertz) ** 2 * m_1 * m_2 / (m_1 + m_2)
    found = two_masses([log_of(m_1, m_2, k, damping=1e-3, seed=1)], RIG)
    assert found is not None
    assert found.frequency.value == pytest.approx(hertz, rel=0.002)
    assert found.m_1.value == pytest.approx(m_1, rel=0.01)
    assert found.m_2.value == pytest.approx(m_2, rel=0.01)
    assert found.F_cp.value == pytest.approx(0.05, rel=0.01)
    assert found.damping.value == pytest.approx(_damping(m_1, m_2, hertz), rel=0.1)


def _damping(m_1: float, m_2: float, hertz: float) -> float:
    """Of the resonance of a shaft of 1e-3 N m s."""
    return 0.5e-3 * (1.0 / m_1 + 1.0 / m_2) / (2.0 * np.pi * hertz)


@pytest.mark.parametrize("late", [-1, 1, 2])
def test_a_log_whose_force_is_samples_late_bends_neither_mass(late: int) -> None:
    """By a sample alone the motor's mass was 36 % off."""
    k = (2.0 * np.pi * 25.0) ** 2 * 0.75e-3
    log = log_of(1e-3, 3e-3, k, damping=1e-3, seed=1)
    found = two_masses([log.with_signals(F=np.roll(log["F"], late))], RIG)
    assert found is not None
    assert found.m_1.value == pytest.approx(1e-3, rel=0.01)
    assert found.m_2.value == pytest.approx(3e-3, rel=0.01)


def test_windows_in_which_the_motor_stops_bend_neither_mass() -> None:
    """By 5 and 1 %."""
    k = (2.0 * np.pi * 25.0) ** 2 * 0.75e-3
    found = two_masses([log_of(1e-3, 3e-3, k, damping=1e-3, seed=1, F_c=0.12)], RIG)
    assert found is not None
    assert found.frequency.value == pytest.approx(25.0, rel=0.02)
    assert found.m_1.value == pytest.approx(1e-3, rel=0.02)
    assert found.m_2.value == pytest.approx(3e-3, rel=0.005)


@pytest.mark.slow
def test_the_load_of_a_motor_is_found_by_its_command() -> None:
    """One body's mass was 3 % off, five deviations, without a word on a second one."""
    k = (2.0 * np.pi * 25.0) ** 2 * 0.75e-3
    log = log_of(1e-3, 3e-3, k, damping=1e-3, seed=1)
    motor = log.with_signals(u=log["F"])
    rig = Rig("motor", motion="rotary", force_per_command=1.0)
    fit = fit_plant([motor], np.random.default_rng(0), rig=rig)
    assert fit.surroundings.resonance is not None
    assert fit.estimates["m"].value == pytest.approx(4e-3, rel=0.02)


@pytest.mark.slow
def test_a_trace_takes_mass_and_friction_of_the_two() -> None:
    """Those of one body were 3 % off, beside advice to record more."""
    k = (2.0 * np.pi * 25.0) ** 2 * 0.75e-3
    logs = [log_of(1e-3, 3e-3, k, damping=1e-3, seed=seed) for seed in (1, 2)]
    found = trace(logs[:1], logs[1:], RIG, built_in(), np.random.default_rng(0))
    assert found.verdict == "unknown" and not found.effects and found.next_experiment == ""
    assert found.surroundings.resonance is not None
    assert found.parameters_after["m"].value == pytest.approx(4e-3, rel=1e-3)
    assert found.parameters_after["F_cp"].value == pytest.approx(0.05, rel=0.01)
    assert found.plant.friction.m == pytest.approx(4e-3, rel=1e-3)
    assert any("two masses predict the position of the test logs" in one for one in found.remarks)


def test_a_search_that_goes_astray_warns_of_nothing() -> None:
    """A real pendulum's had ended in coefficients of which scipy warns."""
    k = (2.0 * np.pi * 25.0) ** 2 * 0.75e-3
    cut = windows([log_of(1e-3, 3e-3, k, damping=1e-3, seed=1).part(0, 3000)], zoh=False)
    for p in np.random.default_rng(0).uniform(-30.0, 30.0, (40, 4)):
        assert np.all(np.isfinite(left_by(p, cut, H)))


def test_one_body_is_not_two() -> None:
    assert two_masses([log_of(2e-3, 1e-3, 0.0, damping=0.0, seed=2)], RIG) is None


def test_a_short_log_tells_nothing() -> None:
    log = log_of(1e-3, 3e-3, 18.5, damping=1e-3, seed=3)
    assert two_masses([log.part(0, 2000)], RIG) is None


def test_both_predict_the_position_of_a_log_that_neither_has_seen() -> None:
    """Of numbers from the training log alone, two masses down to the sensor's noise."""
    k = (2.0 * np.pi * 25.0) ** 2 * 0.75e-3
    train, test = (log_of(1e-3, 3e-3, k, damping=1e-3, seed=seed) for seed in (1, 2))
    found = two_masses([train], RIG)
    assert found is not None
    errors = position_errors(found, [train], [test], RIG)
    assert errors is not None
    one_body, two = errors
    assert two == pytest.approx(1e-5, rel=0.2) and one_body > 20.0 * two
    still = test.with_signals(y=np.zeros(len(test)))
    assert position_errors(found, [train], [still], RIG) is None
