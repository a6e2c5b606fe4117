"""What is left beside effects: too much of it, or of an effect whose size no log tells."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.signal import butter, lfilter

from identification.arrays import Array
from identification.effects._library import built_in
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regression.equation_rows import BREAKAWAY, MECHANICAL, REST
from identification.estimation.regression.row_fit import first_stage
from identification.estimation.structure_fit import FittedStructure, fitted_structure
from identification.log import Rig
from identification.tracing.regression.stepwise import Choice, choose
from identification.tracing.remaining_structure import (
    in_force,
    in_run,
    remaining_structure,
    strongest,
    upward,
)
from identification.tracing.residuals import missing_force
from identification.tracing.result import Residual
from tests.identification.motor_logs import K_A, H, made, plant, seen

MOTOR = Rig("motor", force_per_command=K_A)
SPRING = {"spring": {"k": 40.0}}


@pytest.fixture(scope="module")
def found() -> tuple[Choice, FittedStructure]:
    """A motor's spring as the equations tell it, and a run that is not followed with it."""
    one = seen(made(4, SPRING))
    start, first = first_stage([one], False)
    library, rng = {"spring": built_in()["spring"]}, np.random.default_rng(0)
    plain = fitted_structure(start, first, (), RecordedLogs((one,), MOTOR, "command"), rng)
    choice = choose(start, first, library, rng, lambda _stage, _share: None)
    assert [step.candidate.effect.key for step in choice.steps] == ["spring"]
    return choice, replace(plain, plant=plant(SPRING), misfit=40.0)


@pytest.mark.parametrize(
    ("missing", "signals"),
    [
        ({"input_delay": {"tau": 0.004}}, {"du"}),
        ({"sensor_nonlinearity": {"a": 0.2}}, {"y"}),
        ({"backlash": {"width": 3e-4}}, {"reversal", "F", "v"}),
        ({}, set[str]()),
    ],
)
def test_the_run_tells_on_what_its_error_depends(
    found: tuple[Choice, FittedStructure], missing: dict[str, dict[str, float]], signals: set[str]
) -> None:
    _, after = found
    one = seen(made(4, missing))
    named = set(in_run(replace(after, plant=plant({})), [one], "command").depends_on)
    assert bool(named & signals) is bool(signals)
    assert "t" not in named  # an error lasts, and a function of time would copy it


def shaken(n: int = 10_000) -> Array:
    """A random command [V] that changes as fast as the motor follows."""
    rough = np.random.default_rng(3).standard_normal(n)
    b, a = butter(2, 6.0, fs=1.0 / H)
    smooth = np.asarray(lfilter(b, a, rough))
    return 1.2 * smooth / float(np.std(smooth))


def lacking(
    effects: dict[str, dict[str, float]], *, fast: bool = False, seeds: tuple[int, ...] = (5,)
) -> tuple[Choice, FittedStructure]:
    """A motor with effects that no library has: the plain model's choice, and its run."""
    asked = json.dumps(effects), fast, seeds
    return equations_of(*asked), run_of(*asked)


@cache
def equations_of(effects: str, fast: bool, seeds: tuple[int, ...]) -> Choice:
    """The plain model's choice; effects: as JSON."""
    command = shaken() if fast else None
    logs = [seen(made(seed, json.loads(effects), command=command)) for seed in seeds]
    start, first = first_stage(logs, False)
    return Choice(start, first, (), start, first)


@cache
def run_of(effects: str, fast: bool, seeds: tuple[int, ...]) -> FittedStructure:
    """The plain model's run."""
    choice = equations_of(effects, fast, seeds)
    recorded = RecordedLogs(choice.start.logs, MOTOR, "command")
    return fitted_structure(choice.start, choice.first, (), recorded, np.random.default_rng(0))


@pytest.mark.method
@pytest.mark.parametrize(
    ("missing", "signals"),
    [
        ({"input_delay": {"tau": 0.004}}, ("du", "u")),  # a motor's command makes the force
        ({"nonlinear_viscous": {"k": 60.0, "n": 2.5}}, ("v",)),  # and not the force, which follows
        ({"presliding": {"sigma_0": 6e4}}, ("reversal",)),  # a body at rest that moves
        ({"stribeck": {"F_s": 1.0, "v_s": 0.05}}, ("v",)),
    ],
)
def test_equations_tell_on_what_is_left_depends(
    missing: dict[str, dict[str, float]], signals: tuple[str, ...]
) -> None:
    choice, after = lacking(missing, fast="input_delay" in missing)
    named = remaining_structure(choice, after).depends_on
    assert set(signals) <= set(named), named
    assert named[0] == signals[0] or signals == ("reversal",)


@pytest.mark.slow
def test_the_plain_machine_leaves_nothing_of_any_size() -> None:
    choice, after = lacking({})
    assert remaining_structure(choice, after).depends_on == ()


@pytest.mark.method
@pytest.mark.slow
def test_breakaways_are_judged_by_their_direction_and_not_by_their_own_sign() -> None:
    choice, after = lacking({"rising_stiction": {"F_r": 6.0, "tau": 0.3}})
    o = choice.base[BREAKAWAY]
    noise = np.random.default_rng(1).standard_normal(len(o.fit.residual))
    wild = replace(o, fit=replace(o.fit, residual=3.0 * noise))
    found = remaining_structure(
        replace(choice, base={BREAKAWAY: wild}),
        after,
    )
    assert found.depends_on == ()


@pytest.mark.method
@pytest.mark.parametrize(
    ("missing", "signals"),
    [
        ({"rising_stiction": {"F_r": 6.0, "tau": 0.3}}, {"rest"}),
        ({"backlash": {"width": 3e-4}}, {"reversal", "u", "F"}),
        ({}, set[str]()),
    ],
)
def test_the_strongest_of_equations_breakaways_and_run_is_named(
    missing: dict[str, dict[str, float]], signals: set[str]
) -> None:
    choice, after = lacking(missing, seeds=(5, 6, 7))
    logs = after.stage.logs
    lacks = missing_force(after, after, logs, choice.base[MECHANICAL].slowest)
    found = strongest(choice, after, logs, "command", None if lacks is None else lacks.sliding)
    assert set(found.depends_on) == signals


def test_how_large_an_error_is_tells_where_its_sign_is_a_matter_of_chance() -> None:
    # Breakaways come a little early or late, by chance: no mean depends on anything.
    _, after = lacking({})
    one = after.stage.logs[0]
    rng, sigma = np.random.default_rng(2), one.noise.y
    slow = np.abs(one.signals["v"]) < np.quantile(np.abs(one.signals["v"]), 0.4)
    lost = np.cumsum(np.where(slow, 3.0 * sigma * rng.standard_normal(len(slow)), 0.0))
    blurred = replace(one, log=one.log.with_signals(y=one.log["y"] + lost))
    assert "v" in in_run(after, [blurred], "command").depends_on


def test_rows_that_all_go_one_way_tell_of_it_without_a_signal() -> None:
    """A force or speed that never changes is no signal, and its sign is that of all rows."""
    stage = first_stage([seen(made(1))], by_command=False)[0]
    same = upward(stage, REST, {"t": np.arange(5, dtype=np.float64)})
    assert same.shape == (5,) and np.all(same)
    pushed = upward(stage, REST, {"F": np.array([1.0, -1.0, 2.0])})
    assert pushed.tolist() == [True, False, True]


@pytest.mark.parametrize(("h", "many"), [(0.01, 300), (0.002, 1500)])
def test_the_missing_force_of_a_short_log_tells_on_what_it_depends(h: float, many: int) -> None:
    """Windows of sliding were 45 in a slow log of 6 s, fewer than any function of a signal needs:
    "it depends on no signal" was said of a force that goes with the speed."""
    t = h * np.arange(many, dtype=np.float64)
    v = 0.05 * np.sin(2.0 * np.pi * (0.4 + 0.1 * t) * t)
    rng = np.random.default_rng(4)
    left = np.sign(v) * (900.0 - 6e5 * v**2) + 60.0 * rng.standard_normal(many)
    none = np.zeros(many)
    signals = {"v": v, "t": t, "y": np.cumsum(v) * h, "F": 3e3 * np.sign(v) + left}
    one = Residual(MECHANICAL, t, none, left, left, none + 60.0, signals)
    assert in_force(one, motor=False).depends_on[0] == "v"
    noise = 60.0 * rng.standard_normal(many)
    signals = {**signals, "F": 3e3 * np.sign(v) + noise}
    assert in_force(replace(one, after=noise, signals=signals), motor=False).depends_on == ()
