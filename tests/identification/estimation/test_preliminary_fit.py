"""A first look at a fit tells what the whole fit tells, and says what it leaves open."""

import numpy as np
import pytest

from identification.estimation import preliminary_fit as looking
from identification.estimation.fit import fit_plant
from identification.estimation.preliminary_fit import preliminary_fit
from identification.log import Log, Rig
from identification.model.estimates import KarnoppFit
from identification.model.karnopp import NAMES
from tests.identification.motor_logs import K_A, made

RIG = Rig("motor", force_per_command=K_A)
STICK = ("dv_p", "dv_n", "F_sp", "F_sn")


def identifiable(fit: KarnoppFit) -> set[str]:
    """What of the nine a fit tells."""
    return {name for name in NAMES if fit.estimates[name].value is not None}


def touched() -> Log:
    """A log of which no run follows: the position drifts away from what the command makes of it."""
    log = made(3)
    wave = 4e-3 * np.sin(2.0 * np.pi * 0.9 * np.asarray(log["t"]))
    return log.with_signals(y=np.asarray(log["y"]) + wave)


@pytest.mark.slow
@pytest.mark.parametrize("followed", [True, False])
def test_it_tells_what_the_fit_tells(followed: bool) -> None:
    log = made(3) if followed else touched()
    first = preliminary_fit([log], RIG)
    fit = fit_plant([log], np.random.default_rng(5), rig=RIG)
    assert identifiable(first.fit) == identifiable(fit)
    assert first.fit.adequate == fit.adequate == followed
    assert (set(STICK) <= identifiable(fit)) == followed


@pytest.mark.slow
def test_a_run_that_is_near_when_the_look_ends_is_open(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not preliminary_fit([made(3)], RIG).open
    monkeypatch.setattr(looking, "SAMPLES_RUN", 1.0)
    monkeypatch.setattr(looking, "HOPELESS", np.inf)
    cut_off = preliminary_fit([touched()], RIG)
    assert cut_off.open == (not cut_off.fit.prescribed)
