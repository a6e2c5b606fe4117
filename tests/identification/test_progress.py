"""A computation that may be halted: once is for good, and what was left out is remembered."""

import pytest

from identification.progress import Halt, Halted, without_end


def test_a_no_holds_for_good_but_not_while_closing() -> None:
    answers = iter([True, False, True, True, True])
    halt = Halt(lambda: next(answers))
    halt.ask()
    assert not halt.reached()
    for _ in range(2):
        with pytest.raises(Halted):
            halt.ask()
    assert halt.reached()
    with halt.closing():
        halt.ask()
    with pytest.raises(Halted):
        halt.ask()


def test_a_no_while_closing_is_none_until_asked_again() -> None:
    halt = Halt(lambda: False)
    with halt.closing():
        halt.ask()
    assert not halt.reached()


def test_what_is_halted_gives_the_best_so_far() -> None:
    left = 2
    halt = Halt(lambda: left > 0)

    def search() -> str:
        nonlocal left
        left -= 1
        halt.ask()
        return "found"

    assert halt.tried("the first", search, "before") == "found"
    assert halt.tried("the second", search, "before") == "before"
    assert halt.tried("the third", search, "before") == "before"
    assert halt.tried("the third", search, "before") == "before"
    assert left == 0  # the third was not even begun
    assert halt.not_tried == ("the second", "the third")


def test_a_report_may_ask_first() -> None:
    reported: list[tuple[str, float]] = []
    Halt(without_end).asking(lambda stage, share: reported.append((stage, share)))("searching", 0.5)
    assert reported == [("searching", 0.5)]
    with pytest.raises(Halted):
        Halt(lambda: False).asking(lambda stage, share: reported.append((stage, share)))("s", 1.0)
    assert len(reported) == 1
