"""A trace that is asked to end: at whatever ask, a whole result that says what is not in it."""

import threading
from dataclasses import asdict
from typing import Any

import numpy as np
import pytest

from identification.effects._library import built_in
from identification.log import Log
from identification.progress import KeepGoing, without_end
from identification.tracing.result import Trace
from identification.tracing.trace import MOVE_IT, trace
from tests.identification.tracing.test_trace import RIG, made

SPRING = {"spring": {"k": 80.0, "k_3": 0.0}}
SHORT = 5_000  # samples


class Asked:
    """Says yes so many times."""

    def __init__(self, times: float) -> None:
        self.left, self.count, self.lock = times, 0, threading.Lock()

    def __call__(self) -> bool:
        with self.lock:
            self.count += 1
            return self.count <= self.left


def traced(logs: tuple[Log, Log], keep_going: KeepGoing = without_end) -> Trace:
    train, test = logs
    rng = np.random.default_rng(0)
    return trace([train], [test], RIG, built_in(), rng, keep_going=keep_going)


def answer(found: Trace) -> dict[str, Any]:
    """What stands in a trace, its numbers as they are."""
    out = {k: getattr(found, k) for k in ("verdict", "rivals", "unknown", "drift", "remarks")}
    out |= {f"{k} {when}": asdict(getattr(found, when)[k]) for when in ("before", "after")
            for k in ("train", "test")}  # fmt: skip
    out |= {e.effect.key: (dict(e.params), e.explained, e.p_value) for e in found.effects}
    out["parameters"] = dict(found.parameters_before), dict(found.parameters_after)
    return out


@pytest.fixture(scope="module")
def logs() -> tuple[Log, Log]:
    return made(4, SPRING, n=SHORT), made(5, SPRING, n=SHORT)


@pytest.fixture(scope="module")
def whole(logs: tuple[Log, Log]) -> Trace:
    return traced(logs)


@pytest.fixture(scope="module")
def asks(logs: tuple[Log, Log], whole: Trace) -> int:
    """How often a trace asks that is never asked to end; it is the same to the last digit."""
    asked = Asked(np.inf)
    found = traced(logs, asked)
    assert answer(found) == answer(whole)
    assert found.not_tried == () and found.verdict == "effect"
    return asked.count


def test_how_much_too_little_a_held_out_log_slides_is_said() -> None:
    train, test = made(4, n=SHORT), made(5, n=SHORT)
    standing = test.with_signals(y=np.where(test["t"] < 0.5, test["y"], 0.0))
    found = traced((train, standing), Asked(0))
    assert found.next_experiment.startswith(MOVE_IT)
    assert "windows of 0.06 s of such sliding found in one, 30 needed" in found.next_experiment


@pytest.mark.method
@pytest.mark.parametrize("share", [0.0, 1e-3, 0.01, 0.05, 0.2, 0.5, 0.8, 0.85, 0.9, 0.95])
def test_it_ends_at_any_ask_with_a_whole_result(
    logs: tuple[Log, Log], asks: int, share: float
) -> None:
    times = int(share * asks)
    asked = Asked(times)
    found = traced(logs, asked)
    assert found.not_tried and any("ended early" in line for line in found.remarks)
    assert found.verdict not in ("none", "drift")
    assert asked.count - times < 150  # of some thousand: it ends soon
    for errors in (*found.before.values(), *found.after.values()):
        assert errors.force_rms is not None and errors.position_rms is not None
    for estimates in (found.parameters_before, found.parameters_after):
        assert len(estimates) == 11
        for estimate in estimates.values():
            assert estimate.value is not None or "ended early" in str(estimate.reason)
    assert [acting.key for acting in found.plant.effects] == [e.effect.key for e in found.effects]
    if found.verdict == "unknown" and not found.effects:
        assert "give it more time" in found.next_experiment


@pytest.mark.method
def test_what_the_equations_call_for_is_kept_though_the_run_has_not_tested_it(
    logs: tuple[Log, Log], asks: int
) -> None:
    found = traced(logs, Asked(int(0.93 * asks)))
    assert [e.effect.key for e in found.effects] == ["spring"]
    assert any("spring" in what for what in found.not_tried)


@pytest.mark.method
@pytest.mark.slow
def test_nothing_is_missing_only_where_that_is_known() -> None:
    clean = made(11, n=SHORT), made(12, n=SHORT)
    asked = Asked(np.inf)
    found = traced(clean, asked)
    assert (found.verdict, found.not_tried) == ("none", ())
    early = traced(clean, Asked(3))
    assert early.verdict == "unknown" and "the effects of the library" in early.not_tried
    near_the_end = (traced(clean, Asked(asked.count - back)) for back in range(30, 150, 30))
    late = next(one for one in near_the_end if one.not_tried)
    assert late.verdict == "none"
    assert late.not_tried == ("the last step of the plain model's fit, with its intervals",)
