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
from identification.estimation.regression.row_fit import RowFit, first_stage
from identification.estimation.structure_fit import FittedStructure, fitted_structure
from identification.log import Rig
from identification.tracing.regression.stepwise import Choice, Step, choose
from identification.tracing.remaining_structure import (
    at_breakaway,
    before_pieces,
    in_run,
    places,
    remaining_structure,
    strongest,
    too_much,
    unsized,
    upward,
)
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


def leaving(o: RowFit, share: float, noise: float = 1.0) -> RowFit:
    """The outcome with this share of its residual [N], in rows of so much noise."""
    rows = replace(o.rows, sd=noise * o.rows.sd)
    return replace(o, rows=rows, fit=replace(o.fit, residual=share / noise * o.fit.residual))


@pytest.mark.parametrize(("share", "much"), [(0.7, True), (0.4, False)])
def test_beside_effects_an_imposed_motion_may_leave_less_than_a_third(
    found: tuple[Choice, FittedStructure], share: float, much: bool
) -> None:
    choice, after = found
    logs = tuple(replace(one, imposed=True) for one in after.stage.logs)
    hidden = replace(after, imposed=True, misfit=np.inf)  # by what is missing: its body is free
    imposed = replace(hidden, stage=replace(after.stage, logs=logs))
    for noise in (1.0, 3.0):  # what is left in newtons counts, whatever noise its rows have
        base = {MECHANICAL: leaving(choice.first[MECHANICAL], share, noise)}
        assert too_much(replace(choice, base=base), imposed) is much
        assert too_much(replace(choice, base=base), hidden)
    base = {MECHANICAL: leaving(choice.first[MECHANICAL], 0.4)}
    assert too_much(replace(choice, base=base), after)  # a free run has to leave less
    assert not too_much(replace(choice, base=base), replace(after, misfit=1.0))


def test_structure_counts_by_its_share_of_the_force_that_was_missing(
    found: tuple[Choice, FittedStructure],
) -> None:
    choice, after = found
    spring = choice.first[MECHANICAL]
    for noise in (1.0, 3.0):
        some = replace(choice, base={MECHANICAL: leaving(spring, 0.4, noise)})
        assert remaining_structure(some, after).depends_on
        least = replace(choice, base={MECHANICAL: leaving(spring, 0.05, noise)})
        assert not remaining_structure(least, after).depends_on


def test_an_effect_of_no_certain_size_explains_no_run(
    found: tuple[Choice, FittedStructure],
) -> None:
    choice, after = found
    base = {MECHANICAL: leaving(choice.first[MECHANICAL], 0.2)}
    rough = replace(choice, base=base)  # more than noise, but little of what was missing
    for sd, no_size in (({"spring.k": 50.0, "spring.k_3": 9e4}, True), ({"spring.k": 1.0}, False)):
        told = replace(after, sd=sd)
        assert unsized(choice, told) is no_size
        assert too_much(rough, told) is no_size
        assert not too_much(rough, replace(told, misfit=2.0))


def test_three_effects_of_place_are_pieces_of_another(
    found: tuple[Choice, FittedStructure],
) -> None:
    choice, _ = found
    (spring,) = choice.steps

    def step_of(key: str) -> Step:
        effect = built_in()[key]
        values = {p.name: p.typical for p in effect.params}
        return replace(spring, candidate=replace(spring.candidate, effect=effect, values=values))

    def of(*keys: str) -> Choice:
        return replace(choice, steps=tuple(step_of(key) for key in keys))

    two = of("spring", "stribeck", "cogging", "warmup")
    assert places(two) == 2
    assert before_pieces(two) is two
    three = of("spring", "cogging", "warmup", "tight_spot", "stribeck")
    assert places(three) == 3
    assert before_pieces(three).steps == three.steps[:3]


def test_a_run_that_is_not_followed_lacks_more_than_equations_that_leave_noise(
    found: tuple[Choice, FittedStructure],
) -> None:
    choice, after = found
    assert too_much(choice, replace(after, sd={"spring.k": 1.0}))
    assert not too_much(choice, replace(after, sd={"spring.k": 1.0}, misfit=2.0))


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
    named = remaining_structure(choice, after, any_size=True).depends_on
    assert set(signals) <= set(named), named
    assert named[0] == signals[0] or signals == ("reversal",)


@pytest.mark.slow
def test_the_plain_machine_leaves_nothing_of_any_size() -> None:
    choice, after = lacking({})
    assert remaining_structure(choice, after, any_size=True).depends_on == ()


@pytest.mark.method
@pytest.mark.slow
def test_breakaways_are_judged_by_their_direction_and_not_by_their_own_sign() -> None:
    choice, after = lacking({"rising_stiction": {"F_r": 6.0, "tau": 0.3}})
    o = choice.base[BREAKAWAY]
    noise = np.random.default_rng(1).standard_normal(len(o.fit.residual))
    wild = replace(o, fit=replace(o.fit, residual=3.0 * noise))
    found = remaining_structure(replace(choice, base={BREAKAWAY: wild}), after, any_size=True)
    assert found.depends_on == ()


def test_breakaways_tell_that_they_depend_on_the_time_at_rest() -> None:
    seeds = (5, 6, 7)  # few breakaways tell nothing
    grows = json.dumps({"rising_stiction": {"F_r": 6.0, "tau": 0.3}})
    choice, plain = (equations_of(one, False, seeds) for one in (grows, "{}"))
    assert at_breakaway(choice).depends_on == ("rest",)
    assert at_breakaway(plain).depends_on == ()
    assert at_breakaway(replace(choice, base={})).depends_on == ()


@pytest.mark.method
@pytest.mark.parametrize(
    ("missing", "signals"),
    [
        ({"rising_stiction": {"F_r": 6.0, "tau": 0.3}}, {"rest"}),
        ({"backlash": {"width": 3e-4}}, {"u", "F", "v"}),
        ({}, set[str]()),
    ],
)
def test_the_strongest_of_equations_breakaways_and_run_is_named(
    missing: dict[str, dict[str, float]], signals: set[str]
) -> None:
    choice, after = lacking(missing, seeds=(5, 6, 7))
    found = strongest(choice, after, after.stage.logs, "command")
    assert set(found.depends_on) == signals


def test_how_large_an_error_is_tells_where_its_sign_is_a_matter_of_luck() -> None:
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
