"""Two effects that one run cannot tell apart are called so, and the run named tells them apart."""

import numpy as np
import pytest

from design.effect_loop import simulate_effect_loop
from design.force_pi import ForcePI
from design.loop import Cascade, LoopNoise
from design.pid import pid_to_rst
from identification.arrays import Array
from identification.effects._library import built_in
from identification.log import Log, Rig
from identification.model.karnopp import Karnopp
from identification.model.plant import Actuator, Plant
from identification.tracing.result import Trace
from identification.tracing.trace import trace

H = 2e-3
SIZE = {"k": 20.0, "n": 2.0}  # of nonlinear viscous friction
PLANT = Plant(
    Karnopp(3.5, 16.97, 18.13, 289.0, 287.4, 0.009, -0.01, 20.76, -21.8),
    Actuator(19530.0, 10405.0),
    (built_in()["nonlinear_viscous"].acting(SIZE),),
)


def strokes(speeds: tuple[float, ...], seed: int, seconds: float = 40.0) -> Array:
    """References [m] that move to and fro at one of these speeds [m/s], with dwells."""
    rng = np.random.default_rng(seed)
    parts, level = [np.zeros(150)], 0.0
    while sum(len(part) for part in parts) < seconds / H:
        to = rng.uniform(0.03, 0.06) * (-1.0 if level > 0 else 1.0)
        count = max(2, int(abs(to - level) / rng.choice(speeds) / H))
        parts += [np.linspace(level, to, count), np.full(200, to)]
        level = to
    return np.asarray(np.concatenate(parts)[: int(seconds / H)], dtype=np.float64)


def logged(speeds: tuple[float, ...], seed: int) -> Log:
    """Such a run of the plant in the paper's loop, with its noise."""
    r = strokes(speeds, seed)
    noise = LoopNoise.draw(len(r), 1e-5, 1e-2, np.random.default_rng(seed))
    pid = pid_to_rst(1754.0, 0.072, 0.018, 0.2, H)
    run = simulate_effect_loop(PLANT, Cascade(pid, ForcePI(0.02, 0.05), 5.0), r, H, noise=noise)
    return Log(f"run{seed}", {"t": run.t, "y": run.y_measured, "F": run.F_measured, "u": run.u})


def traced(speeds: tuple[float, ...]) -> Trace:
    logs = logged(speeds, 1), logged(speeds, 2)
    return trace([logs[0]], [logs[1]], Rig("force"), built_in(), np.random.default_rng(0))


@pytest.mark.method
def test_the_run_that_is_named_tells_the_rivals_apart() -> None:
    found = traced((0.1,))
    assert found.verdict == "inseparable"
    keys = {found.effects[0].effect.key, found.rivals[0].key}
    assert keys == {"stribeck", "nonlinear_viscous"}
    assert "explains as much" in found.rivals[0].why_not
    assert "strokes at several constant speeds" in found.next_experiment
    several = traced((0.02, 0.05, 0.1, 0.2, 0.3))
    assert several.verdict == "effect"
    assert [e.effect.key for e in several.effects] == ["nonlinear_viscous"]
    assert abs(several.effects[0].params["k"].value or 0.0) > 0.7 * SIZE["k"]
