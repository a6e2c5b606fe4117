"""The library sought at the scale of what is left: an effect of slow motion beside much noise."""

from dataclasses import replace

import numpy as np
import pytest

from identification.effects._library import built_in
from identification.estimation.regression.equation_rows import MECHANICAL
from identification.estimation.regression.row_fit import first_stage, mean_square
from identification.thresholds import ASTRAY
from identification.tracing.regression.stepwise import choose
from tests.identification.motor_logs import made, seen, strokes


@pytest.mark.parametrize("quieter", [1.0, 3.0])
def test_an_effect_of_slow_motion_is_found_whatever_is_left_at_any_speed(quieter: float) -> None:
    """As of a command that changes between the samples: the rows leave nine times their noise."""
    n = 20_000
    one = seen(made(4, {"stribeck": {"F_s": 6.0, "v_s": 0.02}}, n, command=strokes(n, 4)))
    noise = replace(one.noise, y=one.noise.y / quieter, F=one.noise.F / quieter)
    start, first = first_stage([replace(one, noise=noise)], False)
    assert (mean_square(first[MECHANICAL]) > ASTRAY) == (quieter > 1.0)
    library = {"stribeck": built_in()["stribeck"]}
    rng = np.random.default_rng(0)
    (step,) = choose(start, first, library, rng, lambda _stage, _share: None).steps
    assert step.candidate.values["F_s"] == pytest.approx(6.0, rel=0.05)
    assert step.candidate.values["v_s"] == pytest.approx(0.02, rel=0.05)


def test_the_rows_that_an_effect_is_in_stay_in_the_fit_with_it() -> None:
    n = 20_000
    one = seen(made(4, {"stribeck": {"F_s": 6.0, "v_s": 0.02}}, n, command=strokes(n, 4)))
    noise = replace(one.noise, y=one.noise.y / 3.0, F=one.noise.F / 3.0)
    start, first = first_stage([replace(one, noise=noise)], False)
    library = {"stribeck": built_in()["stribeck"]}
    found = choose(start, first, library, np.random.default_rng(0), lambda _stage, _share: None)
    assert found.base[MECHANICAL].slowest < 0.02 < first[MECHANICAL].slowest
