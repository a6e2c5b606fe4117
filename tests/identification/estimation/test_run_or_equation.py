"""Whose mass and sliding friction a fit has, where a noisy force drives its run."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from identification.estimation import run_or_equation
from identification.estimation.fit import fit_plant
from identification.estimation.recorded_logs import RecordedLogs, recorded_logs
from identification.estimation.run_or_equation import LIKELIEST, likeliest
from identification.log import Log, Rig
from identification.model.estimates import KarnoppFit
from identification.model.plant import Plant
from identification.progress import Halt
from tests.identification.plants import made_log, table

RIG = Rig("force")


@cache
def by_force() -> tuple[KarnoppFit, RecordedLogs]:
    """A fit whose run by the measured force has bent F_vp by 5 %, and its log."""
    log = made_log(table(1), seed=3, seconds=8.0)
    log = Log("by force", {name: log[name] for name in ("t", "y", "F")})
    fit = fit_plant([log], np.random.default_rng(0), rig=RIG)
    bent = replace(fit.friction, F_vp=1.05 * fit.friction.F_vp)
    return replace(fit, friction=bent), recorded_logs([log], RIG)


def test_bent_sliding_friction_gives_way_and_stops_stay() -> None:
    fit, recorded = by_force()
    found = likeliest(fit, recorded)
    one = found.estimates["F_vp"]
    assert one.low is not None and one.high is not None
    assert one.low < table(1).F_vp < one.high < fit.friction.F_vp
    assert found.friction.F_sp == fit.friction.F_sp
    assert found.estimates["F_sp"] == fit.estimates["F_sp"]
    assert set(found.free) == set(fit.free) and found.covariance.shape == fit.covariance.shape
    at = found.free.index("F_vp")
    assert np.sqrt(found.covariance[at, at]) == pytest.approx(one.sd)


def test_likelier_numbers_that_leave_more_of_the_equation_are_not_taken(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A cylinder whose pressures swing with it: the mass of largest likelihood was 10 % too small,
    since what swings was taken for noise of the force."""
    bent, recorded = by_force()
    fit = replace(bent, friction=table(1))
    swings = replace(table(1), m=0.7 * table(1).m)
    found = SimpleNamespace(is_likelier=True, plant=Plant(swings))
    monkeypatch.setattr(run_or_equation, "prediction_error_fit", lambda *_: found)
    assert likeliest(fit, recorded) is fit


def test_a_fit_that_is_not_adequate_or_was_halted_stays_as_it_is() -> None:
    fit, recorded = by_force()
    lost = replace(fit, adequate=False)
    assert likeliest(lost, recorded) is lost
    halt = Halt(lambda: False)
    assert likeliest(fit, replace(recorded, halt=halt)) is fit
    assert halt.not_tried == (LIKELIEST,)
