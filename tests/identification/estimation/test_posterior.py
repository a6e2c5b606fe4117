"""The posterior agrees with the fit's intervals where both can be believed."""

import numpy as np

from identification.estimation.fit import fit_plant
from identification.estimation.posterior import sample_posterior
from identification.log import Rig
from tests.identification.plants import made_log, table


def test_posterior_agrees_with_the_fit() -> None:
    log = made_log(table(2), seed=11, seconds=5.0)
    rig = Rig("force")
    fit = fit_plant([log], np.random.default_rng(1), rig=rig)
    shares: list[float] = []
    found = sample_posterior(
        fit, [log], np.random.default_rng(2), rig=rig, steps=400, on_progress=shares.append
    )
    assert found.names == fit.free
    assert shares[-1] == 1.0
    assert "autocorrelation" in found.verdict
    assert found.converged == found.verdict.startswith("converged")
    for name, (low, middle, high) in found.interval().items():
        assert low < middle < high
        one = fit.estimates[name]
        if one.value is not None and one.sd is not None:
            assert abs(middle - one.value) < 4 * one.sd


def test_a_short_chain_says_so() -> None:
    log = made_log(table(3), seed=12, seconds=4.0)
    rig = Rig("force")
    fit = fit_plant([log], np.random.default_rng(1), rig=rig)
    found = sample_posterior(fit, [log], np.random.default_rng(2), rig=rig, steps=40)
    assert not found.converged
    assert "take more steps" in found.verdict
