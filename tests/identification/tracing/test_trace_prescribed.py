"""Trace of prescribed motion: every stroke counts, however slow it is."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from identification.arrays import Array
from identification.effects._library import built_in
from identification.errors import NotIdentifiable
from identification.estimation.regressed_plant import inertia_is_lost
from identification.estimation.regression.effect_rows import EffectRows
from identification.estimation.regression.equation_rows import MECHANICAL
from identification.estimation.regression.inertia import inertia_has_no_part
from identification.estimation.regression.motion_log import motion_log
from identification.estimation.regression.row_fit import base_fits, first_stage
from identification.log import Log, Rig
from identification.tracing.result import Trace
from identification.tracing.trace import trace
from tests.identification.tracing.test_trace import PLAIN, made

H = 0.01
RIG = Rig("force")
NOISE_Y, NOISE_F = 1e-5, 0.05
COULOMB, PER_BAR = 4.0, 0.6
SPEEDS = (1e-3, 2e-3, 3e-3, 5e-3, 8e-3, 12e-3, 20e-3, 30e-3)


def colored(n: int, rng: np.random.Generator) -> Array:
    """Noise of a laser [m]: neighbours are alike, so a quick derivative takes it for motion."""
    white = NOISE_Y * rng.standard_normal(n)
    return np.asarray(lfilter([0.6], [1.0, -0.8], white))


def white(n: int, rng: np.random.Generator) -> Array:
    """Noise of a position [m] whose speed is known: a steep law reads each error of it."""
    return NOISE_Y * rng.standard_normal(n)


def nothing(v: Array) -> Array:
    return 0.0 * v


def strokes(
    bar: float, speeds: Sequence[float], seed: int, *, stroke: float = 0.02, name: str = "",
    added: Callable[[Array], Array] = nothing, noise: Callable[..., Array] = colored,
) -> Log:  # fmt: skip
    """Strokes to and fro at these speeds [m/s], with friction that grows with the pressure and
    what is added to it [N] at a speed; noise: of the position [m]."""
    rng = np.random.default_rng(seed)
    ways = [np.full(round(2 * stroke / s / H), way * s) for s in speeds for way in (1, -1)]
    v = np.concatenate(ways)
    n = len(v)
    friction = COULOMB + PER_BAR * bar + added(np.abs(v))
    signals = {
        "t": H * np.arange(n, dtype=np.float64),
        "y": H * np.cumsum(v) + noise(n, rng),
        "F": np.sign(v) * friction + NOISE_F * rng.standard_normal(n),
        "p_n": 1e5 * bar + 2e3 * rng.standard_normal(n),
    }
    return Log(name or f"{bar:g}bar.csv", signals)


def traced(train: Sequence[Log], test: Sequence[Log]) -> Trace:
    return trace(train, test, RIG, built_in(), np.random.default_rng(0))


@pytest.mark.method
def test_slow_strokes_count_as_fast_ones_do() -> None:
    # At 7 bar the rig is so slow that a quick derivative hardly tells its direction.
    at = ((1, 13e-3), (5, 9e-3), (7, 6e-3))
    logs = [strokes(bar, [speed] * 5, bar) for bar, speed in at]
    found = traced(logs, [strokes(3, [11e-3] * 5, 3)])
    keys = [e.effect.key for e in found.effects]
    assert (found.verdict, keys) == ("effect", ["pressure_dependent_friction"])
    size = found.effects[0].params["mu_n"].value
    assert size == pytest.approx(PER_BAR * 1e-5, rel=0.02)
    level = np.concatenate([np.full(len(log), PER_BAR * np.mean(log["p_n"]) / 1e5) for log in logs])
    before, after = (error["train"].force_rms for error in (found.before, found.after))
    assert before is not None and after is not None
    assert before == pytest.approx(float(np.std(level)), rel=0.2)
    assert after < 0.1 * before
    assert any("too similar" in remark and "stribeck" in remark for remark in found.remarks)


@pytest.mark.method
def test_strokes_of_many_speeds_tell_friction_that_falls_with_speed() -> None:
    def falls(v: Array) -> Array:
        return np.asarray(2.0 * np.exp(-((v / 6e-3) ** 2)))

    one, other = (
        strokes(1, SPEEDS, seed, stroke=0.01, added=falls, noise=white) for seed in (1, 2)
    )
    found = traced([one], [other])
    assert [e.effect.key for e in found.effects] == ["stribeck"]
    assert found.effects[0].params["v_s"].value == pytest.approx(6e-3, rel=0.1)
    assert not any("too similar" in remark for remark in found.remarks)


@pytest.mark.method
@pytest.mark.slow
def test_motion_that_is_sure_only_as_a_rig_s_is_traced() -> None:
    one, other = (strokes(bar, [1.5e-3] * 4, bar, stroke=0.005) for bar in (1, 2))
    found = traced([one], [other])
    assert found.parameters_after["F_cp"].value == pytest.approx(COULOMB + PER_BAR, rel=0.05)
    # Where a command drives the body it may stop and go, and nothing is sure.
    with pytest.raises(NotIdentifiable, match="1bar"):
        trace(
            [one.with_signals(u=one["F"])], [], Rig("motor", force_per_command=1.0), built_in(),
            np.random.default_rng(0),
        )  # fmt: skip


@pytest.mark.slow
def test_test_logs_are_recorded_as_the_training_logs_are() -> None:
    one = strokes(1, [1.5e-3] * 4, 1, stroke=0.005)  # sure of its direction only as a rig's
    found = traced([one], [one])
    sizes = (found.before["train"].force_rms, found.before["test"].force_rms)
    assert sizes[0] is not None and sizes[0] == pytest.approx(sizes[1])


@pytest.mark.parametrize("prescribed", [True, False])
def test_no_prescribed_stroke_is_taken_for_rest(prescribed: bool) -> None:
    # The slower half of the strokes has another friction than the faster, as a band would have.
    logs = [strokes(bar, [speed] * 4, bar) for bar, speed in ((1, 13e-3), (5, 9e-3))]
    parts = [motion_log(log, zoh=False, by_command=False, prescribed=prescribed) for log in logs]
    zeros = np.array([1.0, 0.0, 0.0, 0.0, 0.0]), np.zeros(3)
    o = base_fits(EffectRows(tuple(parts), *zeros, by_command=False))[MECHANICAL]
    assert bool(np.all(o.rows.speed >= o.slowest)) is prescribed


def test_no_mass_is_fitted_where_a_rig_moves_the_body() -> None:
    """Mass that a wrong structure left took half of the force where the motion was less smooth."""
    log = motion_log(strokes(3.0, SPEEDS, 2), zoh=False, by_command=False, prescribed=True)
    theta = np.array([0.0, COULOMB, COULOMB, 0.0, 0.0])
    for one, given in ((log, True), (replace(log, prescribed=False), False)):
        rows = EffectRows((one,), theta, np.zeros(3), by_command=False).parts[MECHANICAL][0]
        assert np.all(rows.X[:, 0] == 0.0) == given
        assert np.all(np.any(rows.X[:, 1:] != 0.0, axis=0))


@pytest.mark.parametrize("free", [True, False])
def test_inertia_that_an_effect_hides_is_no_rig_s_motion(free: bool) -> None:
    effects = {"position_dependent_friction": {"c1": 150.0, "period": 0.1}}
    log = made(21, effects) if free else strokes(1, [9e-3] * 3, 1)
    logs = [motion_log(log, zoh=False, by_command=False)]
    _, first = first_stage(logs, False)
    assert inertia_is_lost(first[MECHANICAL])
    assert inertia_has_no_part(logs) is not free


def test_inertia_that_a_lag_of_viscous_friction_cancels_is_no_rig_s_motion() -> None:
    damped = replace(PLAIN, F_vp=200.0, F_vn=200.0)
    effects = {"frictional_lag": {"tau": damped.m / damped.F_vp}}
    logs = [motion_log(made(21, effects, damped), zoh=False, by_command=False)]
    _, first = first_stage(logs, False)
    assert inertia_is_lost(first[MECHANICAL])
    assert not inertia_has_no_part(logs)


@pytest.mark.parametrize("seed", range(4))
def test_noise_is_no_inertia(seed: int) -> None:
    logs = [strokes(bar, [9e-3] * 3, seed) for bar in (1, 5)]
    assert inertia_has_no_part([motion_log(log, zoh=False, by_command=False) for log in logs])
    short = Log("short", {k: x[:200] for k, x in logs[0].signals.items()})
    # Too little to tell
    assert inertia_has_no_part([motion_log(short, zoh=False, by_command=False)])


def bursts(rate: float, seed: int) -> Log:
    """A rig that swings the body by 1 mm at this rate [Hz] and rests as long: a second each."""
    h, rng = 2e-3, np.random.default_rng(seed)
    t = h * np.arange(15_000, dtype=np.float64)
    y = 1e-3 * np.sin(2.0 * np.pi * rate * h * np.cumsum(t % 2.0 < 1.0))
    force = COULOMB * np.sign(np.gradient(y)) + NOISE_F * rng.standard_normal(len(t))
    return Log("bursts", {"t": t, "y": y + 2e-6 * rng.standard_normal(len(t)), "F": force})


@pytest.mark.parametrize("rate", [2.0, 4.0, 6.0])
def test_rest_between_strokes_is_not_smoothed_away(rate: float) -> None:
    log = bursts(rate, 1)
    free, prescribed = (
        motion_log(log, zoh=False, by_command=False, prescribed=prescribed)
        for prescribed in (False, True)
    )
    assert len(prescribed.sliding.start) == len(free.sliding.start)
    assert prescribed.signals["v"] == pytest.approx(free.signals["v"])


@pytest.mark.method
def test_strokes_that_no_log_lets_one_judge_are_said_so() -> None:
    train = [strokes(1, [speed] * 4, 1) for speed in (4e-3, 5e-3)]
    slower = strokes(5, [3e-3] * 4, 3)  # slower than any that was learned from, at more pressure
    found = traced(train, [slower])
    size = found.before["test"].force_rms
    assert size is not None and size == pytest.approx(4.0 * PER_BAR, rel=0.1)
    n = 3000
    still = Log(
        "still",
        {
            "t": H * np.arange(n, dtype=np.float64),
            "y": colored(n, np.random.default_rng(1)),
            "F": NOISE_F * np.random.default_rng(2).standard_normal(n),
            "p_n": 1e5 + 2e3 * np.random.default_rng(3).standard_normal(n),
        },
    )
    found = traced(train, [still])
    assert found.before["test"].force_rms is None
    assert any("does not slide in the test logs" in remark for remark in found.remarks)
    dead = still.with_signals(F=np.zeros(n))
    assert any("does not slide in the test logs" in r for r in traced(train, [dead]).remarks)


def test_runs_by_steps_of_force_are_not_traced() -> None:
    t = H * np.arange(400, dtype=np.float64)
    runs = [Log(f"by {F:g}", {"t": t, "y": np.sign(F) * t * (1.0 + 0.1 * F**2), "F": 0.0 * t + F})
            for F in (3.0, -3.0, 5.0, -5.0)]  # fmt: skip
    with pytest.raises(NotIdentifiable, match="by 3: nothing is identifiable from the equation"):
        traced(runs, [])
