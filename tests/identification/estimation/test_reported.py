"""One rule of what is reported: no value without an interval, with one too wide, or at a bound."""

import ast
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from identification.effects._base import Acting, Param
from identification.effects._library import built_in
from identification.estimation import (
    converged_fit,
    prescribed_motion,
    run_or_equation,
    shown_in_sliding,
)
from identification.estimation.estimates import (
    EXCITE,
    FIXED_AT_DEFAULT,
    Events,
    effect_estimates,
    estimates,
    of_effect,
    reported_estimate,
)
from identification.log import Rig
from identification.model.karnopp import NAMES, NEGATIVE
from tests.conftest import ROOT
from tests.reported import broken

PLENTY = Events((10, 10), (10, 10), (1000, 1000), (0.5, 0.5))
RULE = "identification/estimation/estimates.py"
# A change, or a constant force, holds 0 in its interval where there is none; a sign that is turned
# turns the interval that the rule gave.
DIFFERENCES = {
    "design/measured/drift_document.py",
    "design/measured/axis_test.py",
    "workbench/jobs/axis_history.py",
}
PARAMS = [(key, p) for key, effect in sorted(built_in().items()) for p in effect.params]

REASONS = (
    f"wider than the value; {EXCITE}",
    run_or_equation.PREDICTS_WHY,
    run_or_equation.STEPS_WHY,
    converged_fit.NO_REST_WHY,
    shown_in_sliding.TURNING_WHY,
    shown_in_sliding.SPRING_WHY,
    *prescribed_motion.WHY_NOT.values(),
)
TO_DO = ("log ", "add ", "excite ")

sizes = st.one_of(st.sampled_from([0.0, 1e-9, 1e-3, 1.0]), st.floats(0.0, 1e7))
deviations = st.one_of(st.none(), st.sampled_from([0.0, np.inf, np.nan]), st.floats(0.0, 1e8))


@pytest.mark.parametrize("reason", REASONS)
def test_a_reason_says_why_and_then_what_to_log(reason: str) -> None:
    """`doctor` and `identify` print what follows the semicolon as the run to add."""
    why, _, add = reason.partition("; ")
    assert why and add.startswith(TO_DO) and ";" not in add


@given(
    sizes, deviations, st.booleans(), st.floats(0.0, 1e5), st.floats(0.1, 3.0), st.floats(0.1, 3.0)
)
@example(1e-9, 2.35, False, 0.0, 1.0, 1.0)  # as a mass came out: 1e-9, -4.6 to 4.6
@example(1e-9, 0.0, False, 0.0, 1.0, 1.0)  # as a stick limit: 1e-9 to 1e-9
@example(2.5, 9.9, False, 0.0, 1.0, 1.0)  # -17 to 22
@example(0.1, 0.1, False, 2.4, 1.0, 1.0)
def test_no_estimate_breaks_the_rule(
    size: float, sd: float | None, negative: bool, beside: float, below: float, above: float
) -> None:
    value = -size if negative else size
    bounds = (-np.inf, 0.0) if negative else (0.0, np.inf)
    one = reported_estimate(value, "N", sd, bounds=bounds, beside=beside)
    assert broken(one) is None
    if sd is not None and np.isfinite(sd):
        skewed = (value - below * 1.96 * sd, value + above * 1.96 * sd)
        one = reported_estimate(value, "N", sd, interval=skewed, bounds=bounds, beside=beside)
        assert broken(one) is None
    assert one.at_most is None or one.value is None
    assert one.known or one.reason


@pytest.mark.slow
@given(st.lists(st.tuples(sizes, st.floats(0.0, 1e4)), min_size=9, max_size=9))
def test_no_estimate_of_the_nine_breaks_it(drawn: list[tuple[float, float]]) -> None:
    sign = np.array([-1.0 if name in NEGATIVE else 1.0 for name in NAMES])
    center = sign * np.array([size for size, _ in drawn])
    values = dict(zip(NAMES, center.tolist(), strict=True))
    sd = {name: sd for name, (_, sd) in zip(NAMES, drawn, strict=True)}
    for one in estimates(values, sd, PLENTY, Rig("force"), "log").values():
        assert broken(one) is None


@pytest.mark.method
@pytest.mark.parametrize(("key", "p"), PARAMS, ids=[f"{key}.{p.name}" for key, p in PARAMS])
@given(share=st.floats(0.0, 1.0), wide=st.floats(1e-6, 10.0))
def test_no_estimate_of_an_effect_breaks_it(key: str, p: Param, share: float, wide: float) -> None:
    drawn = p.low + share * (min(p.high, 100.0 * abs(p.typical) + 1.0) - p.low)
    for value in (p.low, p.high, p.typical, float(np.clip(0.0, p.low, p.high)), drawn):
        for sd in (None, 0.0, np.inf, wide * max(abs(value), abs(p.typical))):
            one = of_effect(p, value, sd)
            assert broken(one, (p.low, p.high)) is None, key
            if one.value is not None and one.low is None:
                assert p.at_default(value) and one.reason == FIXED_AT_DEFAULT


def test_what_no_log_moves_from_its_default_is_given_with_the_law() -> None:
    stribeck = built_in()["stribeck"]
    plain = Acting(stribeck, (3.0, 0.03, 0.0, 2.0))
    found = effect_estimates([plain], {"stribeck.F_s": 0.1, "stribeck.v_s": 0.002})
    of_law = {name.removeprefix("stribeck."): one for name, one in found.items()}
    assert (of_law["F_s"].value, of_law["v_s"].value) == (3.0, 0.03)
    assert (of_law["delta"].value, of_law["delta"].reason) == (2.0, FIXED_AT_DEFAULT)
    assert (of_law["asymmetry"].value, of_law["asymmetry"].sd) == (0.0, None)


def test_a_wave_that_has_no_cosine_says_how_small_it_is() -> None:
    cogging = built_in()["cogging"]
    wave = cogging.acting({"a": 4.0, "b": 0.0, "period": 0.012})
    sd = {"cogging.a": 0.01, "cogging.b": 0.01, "cogging.period": 1e-5}
    none = effect_estimates([wave], sd)["cogging.b"]
    assert none.reason == "not significantly different from 0 (|x| < 0.02, 95 %)"
    assert none.value is None and none.at_most == pytest.approx(0.0196)
    slight = cogging.acting({"a": 4.0, "b": 0.03, "period": 0.012})
    reason = effect_estimates([slight], sd)["cogging.b"].reason
    assert reason is not None and "is wider than the value" in reason  # but surely not 0


@pytest.mark.parametrize(
    ("value", "sd", "said"),
    [
        (1e-9, 2.35, "at its bound: not significantly different from 0"),
        (50.0, 1.0, "at its bound 50: the logs only say that it lies there or beyond"),
        (2.5, 9.9, "the interval -17 to 22 is wider than the value"),
        (2.5, 0.0, "no interval: nothing that these logs show changes with it"),
        (2.5, None, "no interval: nothing that these logs show changes with it"),
        (-3.0, 0.1, "found -3, of the wrong sign"),
    ],
)
def test_the_reason_is_said_in_words(value: float, sd: float | None, said: str) -> None:
    one = reported_estimate(value, "kg", sd, bounds=(0.0, 50.0))
    assert one.value is None and one.assumed == value and not one.known
    assert one.reason is not None and said in one.reason


def test_an_interval_ends_where_the_parameter_does() -> None:
    one = reported_estimate(49.0, "1", 1.0, bounds=(0.0, 50.0))
    assert one.low == pytest.approx(47.04)
    assert one.high == 50.0


def with_intervals(path: Path) -> Iterator[int]:
    """Lines at which a file makes an estimate with an interval of its own."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "Estimate":
            named = {one.arg for one in node.keywords}
            if len(node.args) > 2 or named & {"sd", "low", "high"}:
                yield node.lineno


@pytest.mark.slow
def test_every_interval_is_made_by_the_rule() -> None:
    found = {
        str(path.relative_to(ROOT))
        for folder in ("identification", "design", "workbench")
        for path in (ROOT / folder).rglob("*.py")
        if any(with_intervals(path))
    }
    assert found == {RULE, *DIFFERENCES}
