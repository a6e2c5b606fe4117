"""The gate: what it promises a fit keeps, and what a log cannot tell it says."""

import numpy as np
import pytest

from identification.effects._library import built_in
from identification.estimation.fit import fit_plant
from identification.estimation.recorded_logs import recorded_logs
from identification.experiment.identifiability import identifiability, tellable_effects
from identification.log import Log, Rig
from identification.thresholds import HALF
from tests.identification.motor_logs import K_A, made

RIG = Rig("motor", force_per_command=K_A)


@pytest.mark.slow
def test_a_fit_is_as_sure_as_promised() -> None:
    log = made(3)
    promised = identifiability(recorded_logs([log], RIG))
    fit = fit_plant([log], np.random.default_rng(0), rig=RIG)
    for name, one in promised.items():
        assert one <= HALF, name
        found = fit.estimates[name]
        assert found.value is not None
        assert found.sd is not None
        assert 1.96 * found.sd / abs(found.value) <= 2.0 * one, name


def test_less_noise_identifies_better() -> None:
    log, rng = made(3), np.random.default_rng(1)
    noisy = log.with_signals(y=log["y"] + 3e-3 * rng.standard_normal(len(log)))
    clear, dim = (identifiability(recorded_logs([one], RIG)) for one in (log, noisy))
    assert all(dim[name] >= clear[name] for name in clear)
    assert any(dim[name] > 1.5 * clear[name] for name in clear)


def test_a_short_piece_of_one_way_cannot_tell_the_other() -> None:
    log = made(3)
    u = np.where((log["t"] > 0.5) & (log["t"] < 0.8), 3.0, 0.0)
    y = np.concatenate([[0.0], np.cumsum(np.where(u[1:] > 0, 1e-4, 0.0))])
    rng = np.random.default_rng(0)
    one_way = Log("one way", {"t": log["t"], "u": u, "F": K_A * u,
                              "y": y + 1e-6 * rng.standard_normal(len(y))})  # fmt: skip
    of_run = identifiability(recorded_logs([one_way], RIG))
    assert of_run["F_cn"] > HALF
    assert of_run["F_sn"] > HALF


def test_an_effect_shows_where_the_motion_calls_for_it() -> None:
    library = {key: built_in()[key] for key in ("stribeck", "spring", "rising_stiction")}
    log = made(3)
    shown = tellable_effects(recorded_logs([log], RIG), library)
    assert set(shown) == set(library)
    assert shown["spring"] > 10.0
    rng = np.random.default_rng(2)
    noisy = log.with_signals(y=log["y"] + 3e-4 * rng.standard_normal(len(log)))
    dim = tellable_effects(recorded_logs([noisy], RIG), library)
    assert dim["spring"] < 0.5 * shown["spring"]
