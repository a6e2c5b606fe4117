"""Choice on the equations: rows of rest, and bristles by rest."""

from dataclasses import replace

import numpy as np

from identification.effects._library import built_in
from identification.estimation.regression.effect_rows import EffectRows
from identification.estimation.regression.row_fit import first_stage
from identification.log import Log
from identification.tracing.regression.candidates import EffectCandidate
from identification.tracing.regression.stepwise import (
    absorb,
    choose,
    explained_part,
)
from tests.identification.motor_logs import K_A, NOISE, H, made, seen


def quiet(_stage: str, _share: float) -> None:
    """Progress that nobody sees."""


def at_rest(log: Log, moved: float, rng: np.random.Generator) -> EffectRows:
    """The stage of a log that stands still under a swinging force, and moves by random steps."""
    n = 6000
    F = 8.0 * np.sin(2.0 * np.pi * 0.5 * H * np.arange(n))
    steps = np.cumsum(np.where(rng.random(n) < 0.01, moved * rng.standard_normal(n), 0.0))
    t = log["t"][-1] + H * np.arange(1, n + 1)
    y = log["y"][-1] + steps + NOISE * rng.standard_normal(n)
    joined = {k: np.concatenate([log[k], v]) for k, v in (("t", t), ("y", y), ("F", F))}
    one = seen(Log(log.name, joined | {"u": joined["F"] / K_A}))
    return first_stage([one], False)[0]


def test_rows_of_rest_stay_where_an_effect_leaves_higher_levels_to_friction() -> None:
    stage = at_rest(made(4), 0.0, np.random.default_rng(3))
    warmup = EffectCandidate(built_in()["warmup"], {"a": -0.3, "b": 0.0, "tau": 5.0}, {}, 0.0)
    higher = stage.theta * (1.0, 1.4, 1.4, 1.0, 1.0)
    with_it = replace(absorb(stage, warmup), theta=higher)
    assert with_it.surely_borne == stage.surely_borne
    (before,), (after,) = stage.at_rest, with_it.at_rest
    assert np.array_equal(before.start, after.start) and len(before.start) > 10
    assert len(replace(stage, theta=higher).at_rest[0].start) > len(before.start)


def test_the_part_explained_is_that_of_the_square_beyond_the_noise() -> None:
    start, first = first_stage([seen(made(4, {"spring": {"k": 40.0}}))], False)
    library = {"spring": built_in()["spring"]}
    step = choose(start, first, library, np.random.default_rng(0), quiet).steps[0]
    assert explained_part(step.candidate, step.base) > 0.95
    assert explained_part(replace(step.candidate, outcomes=step.base), step.base) == 0.0
