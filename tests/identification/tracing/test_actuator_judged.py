"""Whether the actuator is judged: where it is linear, or where an effect makes it so."""

import numpy as np
import pytest

from identification.arrays import Array
from identification.effects._library import built_in
from identification.log import Log, Rig
from identification.model.karnopp import Karnopp
from identification.model.plant import Actuator, Plant
from identification.simulation.free_run import free_run
from identification.tracing import recorded_rows

NINE = Karnopp(3.5, 16.97, 18.13, 289.0, 287.4, 0.009, -0.01, 20.76, -21.8)
H = 2e-3
RIG = Rig("force")


def command(n: int) -> Array:
    """For a tenth of a second beyond a dead zone of 0.25 V, then long within it the other way."""
    part = round(0.1 / H)
    k = np.arange(n // part)
    way = np.where(k // 8 % 2 == 0, 1.0, -1.0)
    return np.where(k % 8 == 0, 0.27 * way, -0.24 * way).repeat(part)


def logged(u_d: float) -> Log:
    n = 10_000
    u = command(n)
    dead = (built_in()["valve_dead_zone"].acting({"u_d": u_d}),) if u_d else ()
    blank = Log(
        "a", {"t": H * np.arange(n, dtype=np.float64), "u": u, "y": np.zeros(n), "F": np.zeros(n)}
    )
    run = free_run(Plant(NINE, Actuator(19530.0, 10405.0), dead), blank, (0.0, 0.0, 0.0), "command")
    rng = np.random.default_rng(5)
    return blank.with_signals(
        y=run.y + 1e-5 * rng.standard_normal(n), F=run.F + 1e-2 * rng.standard_normal(n)
    )


def test_an_actuator_that_an_effect_makes_linear_is_judged(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(recorded_rows, "WORSE", 1.0 / 0.9)  # of this log a line leaves 0.92
    log, dead = logged(0.25), {"valve_dead_zone": built_in()["valve_dead_zone"]}
    remarks: list[str] = []
    assert recorded_rows._by_command([log], RIG, dead, remarks)
    assert not remarks
    assert not recorded_rows._by_command([log], RIG, {}, remarks)
    assert "a linear actuator leaves 92 %" in remarks[0]
