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


@pytest.mark.slow
def test_a_motor_that_creeps_where_it_should_stop_has_the_numbers_of_its_sliding() -> None:
    """Its run loses every stop, and had left mass and friction +- 3 to 12 %."""
    motor = Rig("motor", motion="rotary", force_per_command=1.0)
    fit = fit_plant([creeping(seed=1)], np.random.default_rng(0), rig=motor)
    assert not fit.adequate
    for name, true in {"m": 0.02, "F_cp": 0.3, "F_cn": 0.3, "F_vp": 0.05, "F_vn": 0.05}.items():
        one = fit.estimates[name]
        assert one.low is not None and one.high is not None
        assert one.low < true < one.high and one.high - one.low < 0.01 * true


def creeping(seed: int) -> Log:
    """A motor in a PD loop of 1 kHz, its friction 0.3 tanh(v / 0.01 rad/s) + 0.05 v N m."""
    rng, n, h, parts = np.random.default_rng(seed), 20_000, 1e-3, 10
    t = h * np.arange(n)
    sines = ((1.0, 0.3), (0.5, 0.7), (0.3, 1.5))
    r = np.sum([a * np.sin(2 * np.pi * f * t + rng.uniform(0, 6)) for a, f in sines], axis=0)
    noise, y, u = 1e-5 * rng.standard_normal(n), np.zeros(n), np.zeros(n)
    p, v, dt = 0.0, 0.0, h / parts
    for i in range(n):
        y[i] = p + noise[i]
        u[i] = 4.0 * (r[i] - y[i]) + (0.2 * (r[i] - r[i - 1] - y[i] + y[i - 1]) / h if i else 0.0)
        for _ in range(parts):
            w = v
            for _ in range(20):  # Newton, of the step backwards in time
                steep = np.tanh(w / 0.01)
                left = w - v - dt / 0.02 * (u[i] - 0.3 * steep - 0.05 * w)
                w -= left / (1.0 + dt / 0.02 * (30.0 * (1.0 - steep**2) + 0.05))
            v, p = w, p + dt * w
    return Log("creeps", {"t": np.asarray(t, dtype=np.float64), "y": y, "u": u, "F": u.copy()})
