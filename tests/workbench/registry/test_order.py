"""Which log is the older: by time, by the numbers in names, and where names tell nothing."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from workbench.registry.values import SeenLog, newest_of_later, older


def log(file: str, mtime: int = 100) -> SeenLog:
    return SeenLog(f"{file}, {mtime}", file, 1, mtime)


def test_an_earlier_file_is_older_whatever_its_name() -> None:
    assert older(log("run9.csv", 1), log("run2.csv", 2))
    assert older(log("run9.csv", 1), log("run2.csv", 2), "time")


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("run2.csv", "run10.csv"),
        ("2026-09-30_log7.csv", "2026-10-01_log1.csv"),
        ("20260930.csv", "20261001.csv"),
        ("log0.csv", "log5.parquet"),
    ],
)
def test_a_copy_made_late_is_older_by_its_name(one: str, other: str) -> None:
    assert older(log(one, 200), log(other, 100))
    assert not older(log(other, 200), log(one, 100))
    assert not older(log(one, 200), log(other, 100), "time")


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("day.csv", "night.csv"),
        ("a1.csv", "b2.csv"),
        ("30.11.2026.csv", "01.12.2026.csv"),
        ("12-01-2026.csv", "01-30-2027.csv"),
        ("1.csv", "1_2.csv"),
    ],
)
def test_names_that_tell_no_order(one: str, other: str) -> None:
    assert not older(log(one, 200), log(other, 100))
    assert not older(log(other, 200), log(one, 100))


@given(st.lists(st.tuples(st.integers(0, 20), st.integers(0, 20)), max_size=6), st.integers(0, 20))
def test_the_newest_of_those_that_came_later(others: list[tuple[int, int]], number: int) -> None:
    own = log(f"run{number}.csv", 10)
    found = newest_of_later(own, [log(f"run{n}.csv", t) for n, t in others])
    later = [
        (t, f"run{n}.csv")
        for n, t in others
        if t > 10 or n > number or (t == 10 and f"run{n}.csv" > own.file)
    ]
    later = [one for one in later if one != (10, own.file)]
    assert (None if found is None else (found.mtime_ns, found.file)) == max(later, default=None)
