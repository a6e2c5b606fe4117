"""A force that is logged half a period before the motion that it makes, beside a spring."""

import numpy as np
import pytest

from identification.arrays import Array
from identification.effects._library import built_in
from identification.estimation.surroundings import surroundings
from identification.log import Log, Rig
from identification.model.karnopp import Karnopp
from identification.model.plant import Plant
from identification.tracing.lag_beside import follows_with_lag, lag_beside
from identification.tracing.result import Dependence, Errors, Trace

RIG = Rig("force")
H, FINE = 2e-3, 50  # s a sample, and steps of the body in it
M, COULOMB, VISCOUS, STIFF = 3.5, 17.0, 100.0, 150.0


def pushed(spring: float) -> Log:
    """A body with a spring, pushed by a force that a drive holds for a sample; by Euler steps."""
    n, rng = 12000, np.random.default_rng(4)
    t = H * np.arange(n, dtype=np.float64)
    wanted = 0.05 * np.sin(2.5 * t) + 0.02 * np.sin(8.0 * t) + 0.004 * np.sin(31.0 * t)
    y, v, force, dt = 0.0, 0.0, np.zeros(n), H / FINE
    seen: Array = np.zeros(n)
    for k in range(n):
        seen[k] = y
        force[k] = 9000.0 * (wanted[k] - y) - 150.0 * v
        for _ in range(FINE):
            drive = force[k] - spring * y
            if v == 0.0 and abs(drive) <= COULOMB:
                continue
            way = np.sign(v) if v != 0.0 else np.sign(drive)
            after = v + dt * (drive - COULOMB * way - VISCOUS * v) / M
            v = 0.0 if after * way < 0.0 else after
            y += dt * v
    noise = rng.standard_normal((2, n))
    return Log("held", {"t": t, "y": seen + 2e-6 * noise[0], "F": force + 0.05 * noise[1]})


def plant(spring: float) -> Plant:
    nine = Karnopp(M, COULOMB, COULOMB, VISCOUS, VISCOUS, 1e-3, -1e-3, COULOMB, -COULOMB)
    return Plant(nine, effects=(built_in()["spring"].acting({"k": spring, "k_3": 0.0}),))


@pytest.mark.slow
def test_the_lag_shows_without_the_spring_and_not_beside_it() -> None:
    log = pushed(STIFF)
    assert surroundings([log], RIG).lag.value == 0.0
    lag = lag_beside(plant(STIFF), [log], RIG)
    assert lag.value == pytest.approx(0.5 * H, rel=0.1)
    assert 0.0 < lag.sd < 0.1 * H


def trace(left: float | None, off: float | None = None) -> Trace:
    errors = {name: Errors(left, None, off, None) for name in ("train", "test")}
    nothing = Dependence((), 0.0)
    return Trace(
        "unknown", errors, errors, 1e-6, 0.1, 0.1, None, (), (), nothing, (), "", {}, {},
        plant(STIFF), (),
    )  # fmt: skip


def test_a_lag_is_kept_where_clearly_less_is_left() -> None:
    assert follows_with_lag(trace(1.0), trace(0.85))
    assert not follows_with_lag(trace(1.0), trace(0.95))
    assert not follows_with_lag(trace(None), trace(0.5))


def test_a_lag_with_which_the_position_is_predicted_worse_is_noise_of_the_loop() -> None:
    assert follows_with_lag(trace(1.0, 1e-3), trace(0.5, 1e-3))
    assert not follows_with_lag(trace(1.0, 1e-3), trace(0.5, 1.1e-3))
    assert not follows_with_lag(trace(1.0, 1e-3), trace(0.5, None))
    assert follows_with_lag(trace(1.0, None), trace(0.5, 1e-3))
