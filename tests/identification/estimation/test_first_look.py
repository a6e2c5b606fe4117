"""A first look at a fit tells what the whole fit tells, and says what it leaves open."""

import numpy as np
import pytest

from identification.estimation import first_look as looking
from identification.estimation.first_look import first_look
from identification.estimation.fit import fit_plant
from identification.log import Log, Rig
from identification.model.estimates import KarnoppFit
from identification.model.karnopp import NAMES
from tests.identification.motor_logs import K_A, made

RIG = Rig("motor", force_per_command=K_A)
STICK = ("dv_p", "dv_n", "F_sp", "F_sn")


def told(fit: KarnoppFit) -> set[str]:
    """What of the nine a fit tells."""
    return {name for name in NAMES if fit.estimates[name].value is not None}


def touched() -> Log:
    """A log of which no run follows: the position walks away from what the command makes of it."""
    log = made(3)
    wave = 4e-3 * np.sin(2.0 * np.pi * 0.9 * np.asarray(log["t"]))
    return log.with_signals(y=np.asarray(log["y"]) + wave)


@pytest.mark.slow
@pytest.mark.parametrize("followed", [True, False])
def test_it_tells_what_the_fit_tells(followed: bool) -> None:
    log = made(3) if followed else touched()
    look = first_look([log], RIG)
    fit = fit_plant([log], np.random.default_rng(5), rig=RIG)
    assert told(look.fit) == told(fit)
    assert look.fit.adequate == fit.adequate == followed
    assert (set(STICK) <= told(fit)) == followed


@pytest.mark.slow
def test_a_run_that_is_near_when_the_look_ends_is_open(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not first_look([made(3)], RIG).open
    monkeypatch.setattr(looking, "SAMPLES_RUN", 1.0)
    monkeypatch.setattr(looking, "HOPELESS", np.inf)
    cut_off = first_look([touched()], RIG)
    assert cut_off.open == (not cut_off.fit.imposed)
