"""The posterior agrees with the fit's intervals where both can be believed, and is silent else."""

from dataclasses import replace

import numpy as np
import pytest

from identification.estimation.fit import fit_plant
from identification.estimation.posterior import Posterior, sample_posterior
from identification.log import Log, Rig
from identification.model.estimates import KarnoppFit
from tests.identification.plants import made_log, table

RIG = Rig("force")


def fitted(log: Log) -> KarnoppFit:
    return fit_plant([log], np.random.default_rng(1), rig=RIG)


def compared(found: Posterior, fit: KarnoppFit) -> tuple[list[float], list[float]]:
    """By how many deviations the medians differ, and how much wider the posterior is."""
    off, wider = [], []
    for name, (low, middle, high) in found.interval().items():
        one = fit.estimates[name]
        if one.value is not None and one.sd is not None:
            off.append((middle - one.value) / one.sd)
            wider.append((high - low) / (2 * 1.96 * one.sd))
    return off, wider


@pytest.mark.method
def test_posterior_of_whole_runs_agrees_with_the_fit() -> None:
    log = made_log(table(2), seed=11, seconds=5.0)
    fit, shares = fitted(log), list[float]()
    found = sample_posterior(
        fit, [log], np.random.default_rng(2), rig=RIG, on_progress=shares.append
    )
    assert found.converged and found.verdict.startswith("converged: R-hat at most 1.0")
    assert "the run over the whole of each log" in found.verdict
    assert found.names == fit.free and found.ensembles == 4
    assert found.chains.shape[1] * found.ensembles <= found.evaluations
    assert set(found.r_hat) == set(found.ess) == set(fit.free)
    assert shares[-1] == 1.0
    off, wider = compared(found, fit)
    assert len(off) >= 9 and np.max(np.abs(off)) < 1.5
    assert np.min(wider) > 0.6 and np.max(wider) < 1.3
    narrow, wide = found.interval(0.5), found.interval(0.95)
    assert all(wide[n][0] < narrow[n][0] < narrow[n][2] < wide[n][2] for n in narrow)


@pytest.mark.slow
def test_a_posterior_by_a_noisy_force_lies_about_the_sliding_friction_of_the_fit() -> None:
    """As that of the prediction errors, which is not where the run's own likelihood is largest."""
    log = made_log(table(2), seed=14, seconds=6.0)
    log = Log("by force", {name: log[name] for name in ("t", "y", "F")})
    fit = fitted(log)
    one = fit.estimates["F_vp"]
    assert one.sd is not None and one.value is not None
    other = one.value + 4.0 * one.sd
    moved = replace(fit, friction=replace(fit.friction, F_vp=other))
    found = sample_posterior(moved, [log], np.random.default_rng(2), rig=RIG)
    assert abs(found.interval()["F_vp"][1] - other) < one.sd


@pytest.mark.slow
def test_a_short_sampling_gives_no_interval() -> None:
    log = made_log(table(3), seed=12, seconds=4.0)
    fit = fitted(log)
    found = sample_posterior(fit, [log], np.random.default_rng(2), rig=RIG, steps=12)
    assert not found.converged
    assert not found.interval()
    assert found.verdict.startswith("not converged, so no interval: R-hat at most")
    assert "\n" not in found.verdict


@pytest.mark.method
def test_logs_and_fit_are_left_as_they_are_and_a_seed_gives_the_same() -> None:
    log = made_log(table(2), seed=13, seconds=3.0)
    fit = fitted(log)
    before = {name: log[name].copy() for name in ("t", "y", "F", "u")}
    once, again = (
        sample_posterior(fit, [log], np.random.default_rng(3), rig=RIG, steps=110) for _ in "12"
    )
    assert np.array_equal(once.chains, again.chains)
    assert all(np.array_equal(log[name], before[name]) for name in before)


@pytest.mark.method
def test_by_force_it_is_as_wide_as_the_noise_moves_the_fit() -> None:
    log = made_log(table(2), seed=14, seconds=5.0)
    fit = fit_plant([log], np.random.default_rng(1), rig=RIG, drive="force")
    found = sample_posterior(fit, [log], np.random.default_rng(2), rig=RIG)
    assert found.converged and "windows" in found.verdict
    off, wider = compared(found, fit)
    assert np.max(np.abs(off)) < 4.0
    assert 0.5 < np.median(wider) < 1.6
