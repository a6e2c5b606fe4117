"""The closed loop around a plant with effects: the plain loop without, written equations with."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from design.effect_loop import simulate_effect_loop
from design.force_pi import ForcePI
from design.loop import Cascade, LoopNoise, LoopRun, simulate_loop
from design.loop_signals import OfForce, pressures
from design.pid import pd_to_rst, pid_to_rst
from design.rst import RST
from identification.arrays import Array
from identification.effects._base import Acting
from identification.effects._library import built_in
from identification.errors import BadModel
from identification.log import Log, Rig
from identification.model.plant import Motor, Plant
from identification.signals.clean import applied_force
from identification.simulation.free_run import free_run
from tests.identification.plants import ACTUATOR, table

H, N = 1e-3, 4000
PLANT, MOTOR = Plant(table(1), ACTUATOR), Plant(table(1), Motor(35.15))
PI = ForcePI(0.02, 0.05)
PID = pid_to_rst(1754.0, 0.072, 0.018, 0.2, H)
PD_MOTOR = pd_to_rst(40.0, 0.05, 0.2, H)
CASCADE = Cascade(PID, PI)


def steps() -> Array:
    """A reference between 0 and 0.1 m."""
    return np.asarray(0.1 * ((np.arange(N) // 700) % 2), dtype=np.float64)


def noise() -> LoopNoise:
    """The paper's noise."""
    return LoopNoise.draw(N, 1e-5, 1e-2, np.random.default_rng(1))


def acting(key: str, values: Mapping[str, float] | None = None) -> Acting:
    """An effect with these, else its typical parameters."""
    effect = built_in()[key]
    return effect.acting(values or {p.name: p.typical for p in effect.params})


def loop(*effects: Acting, controller: RST = PID) -> LoopRun:
    """The loop of figure 5 with these effects."""
    plant = replace(PLANT, effects=effects)
    return simulate_effect_loop(plant, Cascade(controller, PI, 1.0), steps(), H, noise=noise())


@pytest.mark.parametrize("limit", [None, 1.0])
@pytest.mark.parametrize("motor", [False, True])
def test_without_effects_it_is_the_plain_loop(motor: bool, limit: float | None) -> None:
    plant, controller, pi = (MOTOR, PD_MOTOR, None) if motor else (PLANT, PID, PI)
    start = (0.002, 0.0, 0.0)
    runs = [
        simulate(plant, Cascade(controller, pi, limit), steps(), H, noise=noise(), start=start)
        for simulate in (simulate_loop, simulate_effect_loop)
    ]
    for name, size in (("y", 1e-11), ("F", 1e-7), ("u", 1e-9), ("y_measured", 1e-11)):
        plain, found = (getattr(one, name) for one in runs)
        assert np.max(np.abs(plain - found)) < size
    assert np.array_equal(runs[0].t, runs[1].t)
    assert np.array_equal(runs[0].r, runs[1].r)
    assert np.ptp(runs[0].y) > 1e-3


@pytest.mark.parametrize(
    "key",
    [k for k, e in built_in().items() if e.acts not in ("sensor", "delay") and not e.signals],
)
def test_the_plant_in_the_loop_is_the_one_of_free_runs(key: str) -> None:
    one = acting(key)
    found = loop(one)
    log = Log("made", {"t": found.t, "y": found.y, "u": found.u})
    free = free_run(replace(PLANT, effects=(one,)), log, (0.0, 0.0, 0.0), "command")
    # A body at rest takes a sample in one step there, in several here.
    assert np.max(np.abs(found.y - free.y)) < 1e-6
    assert np.max(np.abs(found.F - free.F)) < 2e-2
    assert found.F_measured.tolist() == (found.F + noise().F).tolist()


def test_the_controller_sees_what_is_shown() -> None:
    scale = acting("sensor_nonlinearity", {"a": 1.0, "b": 5.0})
    found = loop(scale)
    shown = found.y + found.y**2 + 5.0 * found.y**3
    assert np.max(np.abs(found.y_measured - shown - noise().y)) < 1e-15
    # It steers what is shown to the reference, not the body.
    assert np.max(found.y) < 0.93 * np.max(loop().y)


def test_backlash_is_shown_with_its_play() -> None:
    width = 2e-3
    found = loop(acting("backlash", {"width": width}))
    play = found.y_measured - noise().y - found.y
    assert np.max(np.abs(play)) == pytest.approx(width / 2, rel=1e-9)


def test_no_command_before_the_start() -> None:
    plant = replace(MOTOR, effects=(acting("input_delay", {"tau": 0.02}),))
    found = simulate_effect_loop(plant, Cascade(PD_MOTOR, None), np.full(100, 0.1), H)
    assert found.u[0] != 0.0
    assert np.all(found.F[:20] == 0.0)
    assert np.allclose(found.F[20:], 35.15 * found.u[:-20], rtol=1e-12)


def test_motor_gets_what_the_dead_zone_leaves() -> None:
    plant = replace(MOTOR, effects=(acting("valve_dead_zone", {"u_d": 0.2}),))
    found = simulate_effect_loop(plant, Cascade(PD_MOTOR, None), steps(), H, noise=noise())
    left = np.sign(found.u) * np.maximum(np.abs(found.u) - 0.2, 0.0)
    assert np.allclose(found.F, 35.15 * left, rtol=1e-12)


@pytest.mark.parametrize(("area_p", "area_n"), [(1e-3, 1e-3), (1.1e-3, 0.7e-3)])
def test_pressures_make_the_force(area_p: float, area_n: float) -> None:
    F = np.linspace(-50.0, 50.0, 11)
    made = pressures(area_p, area_n, 4e5, 6e5)
    log = Log("made", {"t": 0.0 * F, "p_p": made["p_p"](F), "p_n": made["p_n"](F)})
    rig = Rig("electro-pneumatic", area_p=area_p, area_n=area_n, supply_pressure=6e5)
    again = applied_force(log, rig)
    assert again is not None
    assert np.max(np.abs(again - F)) < 1e-9
    assert np.allclose(log["p_p"] + log["p_n"], 8e5)
    with pytest.raises(BadModel, match="must be > 0"):
        pressures(0.0, 1e-3, 4e5)


def test_friction_sees_the_pressures_of_the_force() -> None:
    seal = acting("pressure_dependent_friction", {"mu_p": 2e-5, "mu_n": 1e-5})
    plant, chambers = replace(PLANT, effects=(seal,)), pressures(1e-3, 1e-3, 3e5)
    found = simulate_effect_loop(plant, CASCADE, steps(), H, signals=chambers)
    signals = {name: signal(found.F) for name, signal in chambers.items()}
    log = Log("made", {"t": found.t, "y": found.y, "u": found.u, **signals})
    free = free_run(plant, log, (0.0, 0.0, 0.0), "command")
    # A body at rest takes a sample in one step there, in several here.
    assert np.max(np.abs(found.y - free.y)) < 1e-6
    constant = {name: signal(0.0 * steps()) for name, signal in chambers.items()}
    other = simulate_effect_loop(plant, CASCADE, steps(), H, signals=constant)
    assert np.max(np.abs(found.y - other.y)) > 1e-5
    with pytest.raises(BadModel, match="needs a signal p_p or p_n"):
        simulate_effect_loop(plant, CASCADE, steps(), H)
    with pytest.raises(BadModel, match=r"signal p_p: shape \(3,\)"):
        simulate_effect_loop(plant, CASCADE, steps(), H, signals={"p_p": np.zeros(3)})


def test_time_counts_from_the_start() -> None:
    found = loop(acting("warmup", {"a": 1.0, "tau": 0.5}))
    plain = simulate_loop(PLANT, Cascade(PID, PI, 1.0), steps(), H, noise=noise())
    early, late = slice(0, 200), slice(2000, None)
    assert np.max(np.abs(found.y[early] - plain.y[early])) < 1e-6
    assert np.max(np.abs(found.y[late] - plain.y[late])) > 1e-4


def test_a_run_without_bound_is_refused() -> None:
    backwards = RST(-1e6 * PID.R, PID.S, -1e6 * PID.T, H)
    with pytest.raises(BadModel, match="cannot be followed"):
        loop(acting("spring", {"k": -1e7}), controller=backwards)


def test_a_signal_of_the_force() -> None:
    assert OfForce(2.0, 3.0)(np.array([4.0])).tolist() == [14.0]
