"""Windows of a free run: begun at sure rests, and judged for what their states do not explain."""

from dataclasses import replace

import numpy as np

from identification.estimation.windowed_run import windows as module
from identification.estimation.windowed_run.run_errors import judge, mean_loss, misfit
from identification.estimation.windowed_run.window_places import FAST_SHARE
from identification.estimation.windowed_run.windows import (
    RUN_WINDOW,
    WHOLE,
    position_rms,
    starts,
    window_errors,
    window_run,
)
from identification.log import Log
from tests.identification.motor_logs import NOISE, H, made, plant, seen


def test_windows_begin_at_rest_where_the_body_rests() -> None:
    one = seen(made(1))
    begun = starts(one, "command")
    assert len(begun.at) > 6 and begun.at[0] == 0
    assert np.all(np.diff(begun.at) > 0)
    still = begun.sd[1] == 0.0
    assert np.mean(still) > 0.8
    assert np.all(begun.v[still] == 0.0)
    true = one.signals["smooth"][begun.at]
    assert np.max(np.abs(begun.y - true)[still]) < 3 * NOISE


def test_a_body_that_creeps_does_not_rest() -> None:
    n = 5000
    t = H * np.arange(n, dtype=np.float64)
    rng = np.random.default_rng(3)
    y = 1e-3 * t + NOISE * rng.standard_normal(n)  # slower than its sign is sure sample by sample
    none = np.zeros(n)
    one = seen(Log("creep", {"t": t, "y": y, "u": none, "F": none}))
    begun = starts(one, "command")
    assert not np.any(begun.sd[1] == 0.0)
    assert np.all(begun.v != 0.0)


def test_at_rest_on_one_count_a_body_is_anywhere_within_it() -> None:
    white = starts(seen(made(1)), "command")
    log, count = made(1), 3e-4
    counted = seen(log.with_signals(y=count * np.round(log["y"] / count)))
    begun = starts(counted, "command")
    still = begun.sd[1] == 0.0
    assert np.sum(still) > 4
    assert np.mean(begun.sd[0][still] == counted.noise.y) > 0.7  # else noise flips it
    assert np.all(white.sd[0][white.sd[1] == 0.0] < 0.5 * NOISE)


def test_the_true_plant_leaves_noise_alone_in_windows_and_over_all() -> None:
    one = seen(made(2))
    for seconds in (0.5, RUN_WINDOW, WHOLE):
        r = judge(plant(), [one], "command", seconds)(plant())
        assert abs(np.mean(r**2) - 1.0) < 0.1, seconds
    assert abs(misfit(plant(), [one], "command") - 1.0) < 0.05
    rms = position_rms(plant(), [one], "command")
    assert rms is not None and abs(rms / NOISE - 1.0) < 0.05


def test_what_unsure_states_make_of_it_is_taken_away() -> None:
    one = seen(made(2))
    begun = starts(one, "command", 0.3)
    assert np.any(begun.sd[1] > 0)  # some begin in motion
    run = window_run(plant(), one, "command", begun)
    free = module.freed(plant(), one, "command", begun)
    assert run is not None and free is not None
    raw = window_errors(run, one, "command")
    assert np.mean(raw**2) > 2.0 * np.mean(free(raw) ** 2)


def test_what_is_taken_away_is_the_likeliest_that_the_states_can_explain() -> None:
    one = seen(made(2))
    begun = starts(one, "command", 0.3)
    run = window_run(plant(), one, "command", begun)
    free = module.freed(plant(), one, "command", begun)
    assert run is not None and free is not None
    r = window_errors(run, one, "command")
    kept = r.copy()
    after, ends = free(r), [*begun.at[1:], len(one.log)]
    assert np.array_equal(r, kept)
    for low, high in zip(begun.at, ends, strict=True):
        B = free.B[:, :, low:high].reshape(3, -1).T
        own = (free.weight * r)[:, low:high].ravel()
        states = np.linalg.solve(np.eye(3) + B.T @ B, B.T @ own)
        assert np.max(np.abs(after[:, low:high].ravel() - (own - B @ states))) < 1e-8


def test_a_play_is_where_the_motion_left_it() -> None:
    effects = {"backlash": {"width": 4e-4}}
    one = seen(made(4, effects))
    assert misfit(plant(effects), [one], "command") < 1.1
    assert misfit(plant(), [one], "command") > 5.0


def test_a_run_by_a_noisy_force_is_judged_less_where_it_drifts() -> None:
    log = made(5)
    noisy = log["F"] + 0.5 * np.random.default_rng(0).standard_normal(len(log))
    one = seen(log.with_signals(F=noisy))
    by_force = replace(one, zoh=False, noise=replace(one.noise, F=0.5))
    free = module.freed(plant(), by_force, "force", starts(by_force, "force"))
    assert free is not None
    assert np.min(free.weight) < 0.5 < np.max(free.weight) <= 1.0
    even = module.freed(plant(), by_force, "force", starts(by_force, "force"), even=True)
    assert even is not None and np.all(even.weight == 1.0)


def test_a_window_that_a_run_loses_by_chance_bends_no_parameter() -> None:
    """A bump that no plant explains, in one window: all others count as they did."""
    one = seen(made(2))
    t = np.asarray(one.log["t"])
    bumped = one.log["y"] + 300.0 * NOISE * np.exp(-(((t - 0.5 * t[-1]) / 0.05) ** 2))
    lost = replace(one, log=one.log.with_signals(y=bumped))
    assert abs(misfit(plant(), [lost], "command") - 1.0) < 0.1
    assert misfit(plant(), [lost], "command", every=True) > 3.0
    r = judge(plant(), [lost], "command", RUN_WINDOW)(plant())
    own = np.mean(r**2)
    assert own < 1.1
    assert 0.05 < np.mean(r == 0.0) < 0.4  # that window alone


def test_of_few_windows_none_is_forgiven() -> None:
    r, window = np.ones(400), np.repeat(np.arange(4), 100).astype(np.int64)
    r[window == 2] = 100.0
    assert mean_loss(r, window) < 1.5
    three = window < 3
    assert mean_loss(r[three], window[three]) > 10.0


def test_a_window_in_motion_begins_fast() -> None:
    one = seen(made(3))
    begun = starts(one, "command", 0.3)
    moving = begun.sd[1] > 0.0
    speed = np.abs(one.signals["v"]) * (one.signals["d"] != 0)
    usual = np.median(speed[speed > 0])
    assert np.count_nonzero(moving) > 3
    assert np.mean(np.abs(begun.v[moving][1:]) >= FAST_SHARE * usual) > 0.9
