"""The responses of a body in a noisy loop, beside the truth."""

from dataclasses import replace

import numpy as np
import pytest

from identification.frequency.estimate import Response
from identification.frequency.machine import body_by_force, machine_responses
from identification.frequency.stretches import hold
from tests.identification.frequency.linear_loop import H, controller, logged, true_position


def off(found: Response, truth: object, low: float = 0.0) -> tuple[float, float, int]:
    """Error [dB, deg] that a twentieth of the sure points exceed, and how many points these are."""
    sure = found.sure & (found.f > low)
    error = found.H[sure] / np.asarray(truth)[sure]
    return (
        float(np.quantile(np.abs(20 * np.log10(np.abs(error))), 0.95)),
        float(np.quantile(np.abs(np.degrees(np.angle(error))), 0.95)),
        int(sure.sum()),
    )


def test_plant_velocity_and_controller_are_the_bodys() -> None:
    found = machine_responses([logged(1)])
    truth = true_position(found.f)
    assert found.instrument
    decibel, degree, points = off(found.position, truth)
    assert decibel < 1.0 and degree < 7.0 and points > 500
    np.testing.assert_allclose(
        found.velocity.H, found.position.H * 2j * np.pi * found.f, rtol=1e-12
    )
    assert found.controller is not None
    decibel, degree, points = off(found.controller, controller(found.f) * hold(found.f, H))
    assert decibel < 0.5 and degree < 3.0 and points > 400
    # What of the position follows the reference alone does not tell R from T.
    assert not np.any(found.controller.seen[found.f < 10.0])


def test_the_controller_is_distinguished_from_a_prefilter_of_the_reference() -> None:
    found = machine_responses([logged(3, forward=0.5)]).controller
    assert found is not None
    decibel, degree, points = off(found, controller(found.f) * hold(found.f, H))
    assert decibel < 0.5 and degree < 3.0 and points > 400


def test_noise_round_the_loop_bends_the_curve_without_the_instrument() -> None:
    """Direct spectra lie near -1/controller where noise drives both; the reference does not."""
    run = logged(2, noise=1e-4)
    by_reference, direct = body_by_force([run]), body_by_force([replace(run, r=None)])
    f = by_reference.f
    truth = -((2 * np.pi * f) ** 2) * true_position(f)
    fast = (f > 20.0) & (f < 100.0)
    error = np.abs(direct.H / truth)[fast & direct.seen]
    assert np.median(np.abs(20 * np.log10(error))) > 6.0
    inside = fast & by_reference.seen
    if np.any(inside):
        error = np.abs(by_reference.H / truth)[inside]
        assert np.median(np.abs(20 * np.log10(error))) < 1.5
    slow = (f < 10.0) & by_reference.sure
    error = np.abs(by_reference.H / truth)[slow]
    assert slow.sum() > 20 and np.median(np.abs(20 * np.log10(error))) < 0.5


def test_the_bands_hold_what_they_promise() -> None:
    inside = []
    for seed in range(4):
        found = body_by_force([logged(10 + seed, noise=3e-6, two=False, seconds=25.0)])
        use = found.seen & (found.f < 150.0)
        truth = -((2 * np.pi * found.f) ** 2) * true_position(found.f, two=False)
        off_by = np.abs(np.abs(found.H / truth) - 1.0)[use]
        inside.append(np.mean(off_by < found.half_band[use]))
    assert 0.85 < np.mean(inside) < 0.995


def test_logs_of_several_rates_and_lengths_are_averaged() -> None:
    runs = [logged(4, 15.0), logged(5, 12.0, h=2e-3), logged(6, 1.0)]
    found = machine_responses(runs)
    decibel, degree, points = off(found.position, true_position(found.f))
    assert decibel < 1.5 and degree < 10.0 and points > 150
    alone, together = (machine_responses(one, 3.0).body.averages[0] for one in (runs[:1], runs))
    assert together > 1.5 * alone
    assert found.f[-1] == pytest.approx(400.0, rel=0.02)


def test_a_reference_at_rest_is_no_instrument() -> None:
    run = logged(7, 10.0)
    still = replace(run, r=np.zeros(len(run.y)))
    found = machine_responses([still])
    assert not found.instrument and found.controller is None


def test_what_only_noise_moves_is_not_seen() -> None:
    rng = np.random.default_rng(8)
    run = logged(8, 20.0)
    n = len(run.y)
    noise = replace(
        run, y=rng.standard_normal(n), F=rng.standard_normal(n), linear=rng.standard_normal(n)
    )
    assert np.mean(machine_responses([noise]).body.seen) < 0.02
