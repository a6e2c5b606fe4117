"""The valve's numbers from logs whose truth is known."""

from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest

from identification.errors import NotIdentifiable
from identification.log import Log
from identification.model.estimates import Estimate
from identification.signals.renewal import renewed
from identification.velocity.fit import fit
from identification.velocity.model import NUMBERS, Valve
from identification.velocity.record import recorded
from identification.velocity.valve_estimates import units, valve_estimates
from tests.identification.velocity.made import TRUE, command, made

U = command(np.random.default_rng(5), 0.01, 25.0)
T = 0.01 * np.arange(2500)


def found_in(log: Log) -> Mapping[str, Estimate]:
    record = recorded([log])
    return valve_estimates(record, fit(record), units("linear", "V"))


def near(found: Mapping[str, Estimate], h: float, true: Valve = TRUE) -> None:
    """Gains within 1 %, dead zones within 3 %, the delay within half a sample."""
    for name in ("g_p", "g_n"):
        assert found[name].value == pytest.approx(getattr(true, name), rel=0.01)
    for name in ("d_p", "d_n"):
        assert found[name].value == pytest.approx(getattr(true, name), rel=0.03)
    assert found["delay"].value == pytest.approx(true.delay, abs=0.5 * h)
    assert found["lag"].value == pytest.approx(true.lag, abs=0.5 * h)


@pytest.mark.parametrize(
    ("seed", "how"),
    [(40, {}), (41, {"step": 1e-3, "noise": 0.0}), (42, {"noise": 1e-3}), (43, {"h": 0.02})],
)
def test_it_finds_the_truth(seed: int, how: Mapping[str, Any]) -> None:
    log = made(seed, **how)
    near(found_in(log), log.h)


def test_a_position_that_is_held_in_a_faster_log() -> None:
    log = renewed(made(44, h=0.002, zoh=10, noise=1e-4, duration=30.0)).log
    assert log.h == pytest.approx(0.02)
    near(found_in(log), log.h)


@pytest.mark.parametrize("size", [1e-6, 1e3])
def test_a_machine_of_another_size_is_fitted_as_exactly(size: float) -> None:
    """On a micrometre's stage a gradient in metres had been small before the first step."""
    log = made(40)
    scaled = log.with_signals(y=size * log["y"])
    one, other = (asdict(fit(recorded([each])).valve) for each in (log, scaled))
    gains = {"g_p": size, "g_n": size}
    for name, value in one.items():
        assert other[name] == pytest.approx(value * gains.get(name, 1.0), rel=1e-5)


def test_a_machine_wired_the_other_way_round() -> None:
    true = replace(TRUE, g_p=-TRUE.g_p, g_n=-TRUE.g_n)
    near(found_in(made(45, true)), 0.01, true)


def test_several_logs_are_one_machine() -> None:
    record = recorded([made(46, duration=15.0), made(47, duration=15.0)])
    near(valve_estimates(record, fit(record), units("linear", "V")), 0.01)


def test_one_direction_tells_that_one_alone() -> None:
    found = found_in(made(48, u=np.abs(U)))
    assert found["g_p"].value == pytest.approx(TRUE.g_p, rel=0.01)
    for name in ("g_n", "d_n"):
        assert found[name].value is None
        assert "no command in the negative direction" in str(found[name].reason)


def test_commands_that_never_move_it_tell_no_gain() -> None:
    found = found_in(made(49, u=np.maximum(U, -0.7)))
    assert found["g_p"].known
    assert found["g_n"].value is None and found["d_n"].value is None


def test_no_dead_zone_is_reported_as_small() -> None:
    found = found_in(made(50, replace(TRUE, d_p=0.0, d_n=0.0)))
    for name in ("d_p", "d_n"):
        assert found[name].value is None and found[name].known
        assert float(found[name].at_most or 1.0) < 0.01


def test_one_size_of_command_tells_no_gain_from_a_dead_zone() -> None:
    with pytest.raises(NotIdentifiable, match="gain and dead zone of the positive direction"):
        found_in(made(51, u=np.where(np.sin(2.0 * T) > 0.0, 4.0, -4.0)))


def test_a_command_that_jumps_over_the_dead_zone_does_not_tell_it() -> None:
    u = np.sign(np.sin(T)) * (2.5 + 1.5 * np.sin(7.0 * T) ** 2)
    u[np.abs(u) < 1.2] = 2.0
    found = found_in(made(52, u=u))
    assert found["g_p"].known and not found["d_p"].known
    assert "inside the dead zone" in str(found["d_p"].reason)


@pytest.mark.parametrize(("passages", "known"), [(2, False), (3, True)])
def test_so_many_passages_tell_a_dead_zone(passages: int, known: bool) -> None:
    u = np.sign(np.sin(T)) * (2.5 + 1.5 * np.sin(7.0 * T) ** 2)
    u[0] = 2.0
    for k in range(passages):
        u[400 + 500 * k : 500 + 500 * k] = 3.0 * np.sin(np.linspace(-1.5, 1.5, 100))
    assert found_in(made(54, u=u))["d_p"].known == known


@pytest.mark.parametrize(
    ("log", "said"),
    [
        (made(53, duration=8.0), "lasts 7.99 s, at least 9 s needed"),
        (made(53, u=np.full(2500, 2.0)), "the command stays at 2"),
        (made(53, h=0.25), "sampled every 0.25 s, at most 0.2 s needed"),
        (made(53, u=0.1 * U), "how the velocity follows the command is not identifiable"),
    ],
)
def test_what_tells_nothing_is_refused(log: Log, said: str) -> None:
    with pytest.raises(NotIdentifiable, match=said):
        found_in(log)


def test_units() -> None:
    assert units("linear", "V")["g_p"] == "m/(s V)"
    assert units("rotary", "1")["g_n"] == "rad/s"
    assert units("linear", "mA")["d_p"] == "mA"


@pytest.mark.method
@pytest.mark.parametrize("how", [{}, {"step": 1e-3, "noise": 0.0}])
def test_intervals_hold(how: Mapping[str, Any]) -> None:
    """Over 30 seeds that served no choice, 90 % of the intervals hold, of each number 80 %."""
    holds = np.zeros(len(NUMBERS))
    for seed in range(500, 530):
        log = made(seed, **how)
        found = found_in(log)
        near(found, log.h)
        for i, name in enumerate(NUMBERS):
            low, high = found[name].low, found[name].high
            assert low is not None and high is not None
            holds[i] += low <= getattr(TRUE, name) <= high
    assert np.mean(holds) >= 27.0
    assert np.min(holds) >= 24.0
