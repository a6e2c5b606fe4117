"""A bar that only moves forward and is full at the end; a budget and a stop that end it."""

import math

import pytest

from workbench.course import ALL_BUT, AT_LEAST, COMPILING, FIRST_GUESS, Course, moving

STAGES = {"first": (0.0, 0.2), "second": (0.2, 0.6), "other": (0.3, 0.8), "last": (0.8, 1.0)}


class Watch:
    """A clock that is put forward by hand."""

    now = 100.0

    def __call__(self) -> float:
        return self.now


def course(budget: float = math.inf) -> tuple[Course, Watch, list[float], list[str]]:
    clock, steps, words = Watch(), list[float](), list[str]()
    return Course(steps.append, STAGES, clock, budget, words.append), clock, steps, words


def test_the_bar_moves_by_the_clock_between_stages_and_never_back() -> None:
    one, clock, steps, words = course()
    shown = []
    for stage, share, seconds in (
        ("first", 0.0, 4.0), ("second", 0.0, 8.0), ("second", 0.5, 40.0), ("second", 0.1, 5.0),
        ("unheard of", 0.9, 5.0), ("last", 0.0, 20.0), ("last", 0.5, 5.0),
    ):  # fmt: skip
        one.report(stage, share)
        for _ in range(int(seconds)):
            clock.now += 1.0
            before = one.shown
            one.beat()
            assert one.shown > before  # in every second, whatever is reported
            shown.append(one.shown)
        assert sum(steps) == pytest.approx(one.shown)
    assert shown == sorted(shown) and shown[-1] <= ALL_BUT
    assert shown[3] <= 0.2 and shown[-6] > 0.8
    assert words == ["first", "second", "last"]
    one.done()
    assert sum(steps) == pytest.approx(1.0)


def test_a_stage_that_begins_late_has_a_part_of_what_is_left() -> None:
    one, clock, _, _ = course()
    one.report("other", 1.0)
    assert one.shown == pytest.approx(0.8)
    one.report("second", 0.5)
    assert one.shown == pytest.approx(0.8 + 0.5 * AT_LEAST * 0.2)
    clock.now += 1000.0
    one.beat()
    assert one.shown < 0.8 + AT_LEAST * 0.2 + 1e-9


def test_of_what_nothing_is_known_a_first_guess_is_made() -> None:
    one, clock, _, _ = course()
    one.report("first", 0.0)
    clock.now += 0.1 * FIRST_GUESS
    assert one.expected() == pytest.approx(0.2 * 0.1 / (0.2 + 0.1))


def test_a_budget_is_kept_and_shown() -> None:
    one, clock, _, _ = course(10.0)
    one.report("first", 0.0)
    clock.now += 6.0
    one.beat()
    assert one.keep_going() and one.shown == pytest.approx(0.6)
    clock.now += 4.0
    one.beat()
    assert not one.keep_going() and one.shown == ALL_BUT


def test_a_stop_ends_it_and_compiling_is_said() -> None:
    one, _, steps, words = course()
    assert (one.keep_going(), one.stopped) == (True, False)
    one.report("first", 0.0)
    one.compiling(True)
    one.compiling(False)
    assert words == ["first", COMPILING, "first"]
    with moving(one):
        one.stopped = True
    assert (one.keep_going(), one.stopped) == (False, True)
    assert sum(steps) == pytest.approx(1.0)
