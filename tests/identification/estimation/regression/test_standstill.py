"""Evidence at rest: only what cannot be sliding is rest, and a noisy force makes no creep."""

import numpy as np

from identification.arrays import Array
from identification.effects._library import built_in
from identification.estimation.regression.motion_log import motion_log
from identification.estimation.regression.standstill import MEAN, borne, rests
from identification.log import Log
from identification.signals.sampling import samples
from identification.simulation.effect_along_motion import elastic_displacement
from tests.identification.motor_logs import NINE, NOISE, H, made, seen


def standing(F: Array, rng: np.random.Generator) -> Log:
    """A body at rest under this force [N], (n,)."""
    t = H * np.arange(len(F), dtype=np.float64)
    return Log("rest", {"t": t, "y": NOISE * rng.standard_normal(len(F)), "F": F})


def test_rest_is_what_the_coulomb_level_holds() -> None:
    F = np.concatenate([np.linspace(-14.0, 14.0, 3000), np.linspace(14.0, -14.0, 3000)])
    one = motion_log(standing(F, np.random.default_rng(1)), zoh=False, by_command=False)
    found = rests(one, 12.0, 10.0)
    means = np.array([F[k : k + MEAN].mean() for k in found.start])
    assert means.max() < 12.0 and means.min() > -10.0
    assert means.max() > 11.0 and means.min() < -9.0
    assert len(rests(one, 20.0, 20.0).start) > len(found.start) > 100


def test_the_noise_of_a_force_bends_no_bristle_further() -> None:
    rng = np.random.default_rng(2)
    log = standing(6.0 + 0.05 * rng.standard_normal(20_000), rng)
    one = motion_log(log, zoh=False, by_command=False)
    bent = elastic_displacement(
        built_in()["presliding"], {"sigma_0": 1e5}, one.signals, log.h, NINE
    )
    assert abs(bent[1500] - bent[1000]) < 0.1 * bent[1000]


def test_what_a_body_bore_at_rest_is_about_its_stick_limit() -> None:
    up, down = borne([seen(made(2))])
    assert 0.9 * NINE.F_sp < up < 1.1 * NINE.F_sp
    assert 0.9 * -NINE.F_sn < down < 1.1 * -NINE.F_sn
    assert borne([]) == (0.0, 0.0)


def test_counts_of_samples_follow_a_faster_clock() -> None:
    assert samples(MEAN, H) == MEAN
    assert samples(MEAN, 0.5 * H) == 2 * MEAN
    assert samples(MEAN, 3.0 * H) == MEAN  # a mean of fewer would be as noisy as a sample
