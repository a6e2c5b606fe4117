"""Stick limits by simulation: the limit of every breakaway, and what it grows with."""

from dataclasses import replace

import numpy as np

from identification.estimation.regression.breakaway import _costs, breakaway_limits
from identification.log import Log
from tests.identification.motor_logs import NINE, made, seen


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


def test_a_limit_that_falls_with_the_first_motion_is_seen_whole() -> None:
    F_r, tau = 5.0, 0.4
    one = seen(made(1, {"rising_stiction": {"F_r": F_r, "tau": tau}}))
    off = []
    for falls in (False, True):
        found = breakaway_limits(one, NINE, falls)
        limit = np.where(found.direction > 0, NINE.F_sp, -NINE.F_sn)
        true = limit + F_r * (1.0 - np.exp(-found.rested / tau))
        off.append(float(np.median(np.abs(found.force * found.direction - true))))
    assert off[1] < 0.25 < 0.5 < off[0]


def test_a_limit_reached_with_the_last_sample_moves_nothing() -> None:
    one = replace(seen(made(1)), held=False)
    force = np.linspace(0.0, 20.0, 60)
    signals = {"t": 2e-3 * np.arange(60.0), "y": np.zeros(60), "F": force, "u": force}
    limits = force[-2:]  # one sample beyond it, and none
    assert np.all(_costs(one, NINE, True, Log("part", signals), 0.0, 1.0, limits) == 0.0)


def test_a_body_that_never_moves_breaks_nowhere() -> None:
    log = made(1)
    still = np.random.default_rng(0).standard_normal(len(log)) * 1e-5
    assert len(breakaway_limits(seen(log.with_signals(y=still)), NINE).at) == 0
