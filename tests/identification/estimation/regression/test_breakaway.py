"""Stick limits by simulation: the limit of every breakaway, and what it grows with."""

import numpy as np
import pytest

from identification.estimation.regression.breakaway import breakaway_limits, risen_to, usual_limits
from tests.identification.motor_logs import NINE, made, plant, seen


def test_every_breakaway_gives_the_limit() -> None:
    found = breakaway_limits(seen(made(1)), NINE)
    assert len(found.at) > 10
    limit = np.where(found.direction > 0, NINE.F_sp, -NINE.F_sn)
    off = found.force * found.direction - limit
    assert abs(np.median(off)) < 0.1
    assert np.quantile(np.abs(off), 0.8) < 0.3


def test_a_limit_that_grows_with_the_rest_is_seen_to_grow() -> None:
    effects = {"rising_stiction": {"F_r": 5.0, "tau": 0.4}}
    found = breakaway_limits(seen(made(1, effects)), NINE)
    limit = np.where(found.direction > 0, NINE.F_sp, -NINE.F_sn)
    grown = found.force * found.direction - limit
    assert np.corrcoef(grown, found.rested)[0, 1] > 0.6
    assert np.median(grown) > 0.5


def test_a_body_that_never_moves_breaks_nowhere() -> None:
    log = made(1)
    still = np.random.default_rng(0).standard_normal(len(log)) * 1e-5
    assert len(breakaway_limits(seen(log.with_signals(y=still)), NINE).at) == 0


def test_the_force_has_risen_to_the_limit_where_motion_is_seen() -> None:
    """Never clearly less, and hardly more than it rises until then; with a noisy current too."""
    for sd in (0.0, 0.3):
        log = made(3)
        noise = sd * np.random.default_rng(1).standard_normal(len(log))
        found = risen_to([seen(log.with_signals(F=log["F"] + noise))], plant())
        for name, limit in (("F_sp", NINE.F_sp), ("F_sn", -NINE.F_sn)):
            force = abs(found[name].value)
            assert limit - 3.0 * found[name].sd < force < 1.2 * limit


def test_what_effects_push_is_in_the_force_at_breakaway() -> None:
    effects = {"constant_force": {"F_0": 3.0}}
    one = seen(made(3, effects))
    with_it, without = (risen_to([one], plant(some)) for some in (effects, None))
    assert with_it["F_sp"].value - without["F_sp"].value > 2.0
    assert with_it["F_sn"].value - without["F_sn"].value > 2.0


def test_a_body_that_never_rests_has_no_force_at_breakaway() -> None:
    log = made(1)
    still = seen(log.with_signals(y=1e-5 * np.random.default_rng(0).standard_normal(len(log))))
    assert risen_to([still], plant()) == {}


def test_most_breakaways_by_themselves_give_the_limits() -> None:
    found, rise = usual_limits([seen(made(1))], plant())
    assert found["F_sp"].value == pytest.approx(NINE.F_sp, rel=0.02)
    assert found["F_sn"].value == pytest.approx(NINE.F_sn, rel=0.02)
    assert 0.0 < found["F_sp"].sd < 0.5 and 0.0 < rise < 2.0


def test_what_effects_push_is_no_part_of_the_limits() -> None:
    pushed = {"constant_force": {"F_0": 3.0}}
    found, _ = usual_limits([seen(made(3, pushed))], plant(pushed))
    assert found["F_sp"].value == pytest.approx(NINE.F_sp, rel=0.03)
    assert found["F_sn"].value == pytest.approx(NINE.F_sn, rel=0.03)


def test_a_body_that_never_rests_has_no_usual_limits() -> None:
    log = made(1)
    still = seen(log.with_signals(y=1e-5 * np.random.default_rng(0).standard_normal(len(log))))
    assert usual_limits([still], plant()) == ({}, 0.0)
