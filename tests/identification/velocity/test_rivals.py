"""What the plain valve leaves is named where held-out windows say so, and only there."""

from dataclasses import replace

import numpy as np
import pytest

from identification.log import Log
from identification.velocity.model import Valve
from identification.velocity.record import recorded
from identification.velocity.rivals import clearly_better, is_noise, left_by_valve
from tests.identification.velocity.made import TRUE, made

RICHER = {
    "curved_gain": replace(TRUE, curve_p=0.25, curve_n=0.25),
    "lag_by_direction": replace(TRUE, lag_other=1.0),
    "second_lag": replace(TRUE, lag=0.2, second_lag=0.6),
    "creep": replace(TRUE, creep=2e-3),
    "place_dependent_gain": replace(TRUE, place=0.15),
}


def slow(seed: int, valve: Valve = TRUE) -> Log:
    """A log at 50 Hz."""
    return made(seed, valve, h=0.02)


@pytest.mark.slow
def test_nothing_is_named_where_nothing_is_missing() -> None:
    found = left_by_valve(recorded([slow(60)]))
    assert (found.verdict, found.named, found.complete) == ("none", None, True)
    assert len(found.rivals) == len(RICHER)


@pytest.mark.method
@pytest.mark.slow
@pytest.mark.parametrize("key", RICHER)
def test_what_is_missing_is_named(key: str) -> None:
    found = left_by_valve(recorded([slow(61, RICHER[key])]))
    assert (found.verdict, found.named) == ("effect", key)
    best = next(one for one in found.rivals if one.key == key)
    assert best.left.rms[0] < 0.6 * found.unextended.rms[0]


def test_on_a_log_that_no_fit_has_seen() -> None:
    valve = RICHER["curved_gain"]
    train, test = recorded([slow(62, valve)]), recorded([slow(63, valve)])
    found = left_by_valve(train, replace(test, u_max=train.u_max))
    assert (found.verdict, found.named) == ("effect", "curved_gain")
    assert len(found.unextended.long) == test.windows
    assert found.fitted.valve.curve_p == pytest.approx(0.25, abs=0.02)


def test_what_no_rival_has_is_unknown() -> None:
    log = slow(64)
    shaken = log.with_signals(y=log["y"] + 5e-3 * np.sin(2.0 * np.pi * 0.9 * log["t"] ** 1.1))
    found = left_by_valve(recorded([shaken]))
    assert (found.verdict, found.named) == ("unknown", None)


def test_time_that_is_up_is_reported() -> None:
    found = left_by_valve(recorded([slow(65)]), keep_going=lambda: False)
    assert set(found.not_tried) == set(RICHER)


def test_better_is_sure_and_matters() -> None:
    plain = np.linspace(1.0, 2.0, 20)
    assert clearly_better(0.8 * plain, plain)[0]
    assert not clearly_better(0.95 * plain, plain)[0]  # 2.5 % of the error
    assert not clearly_better(0.5 * plain[:4], plain[:4])[0]  # by chance 1 in 16
    assert not clearly_better(plain, plain)[0]


def test_noise_of_two_readings() -> None:
    assert is_noise(2.0 * 0.9**2, 0.9)
    assert not is_noise(5.0 * 0.9**2, 0.9)
