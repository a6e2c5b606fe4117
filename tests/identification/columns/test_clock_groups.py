"""Columns on clocks of their own in one table: pairs, two instruments, and what is none."""

from collections.abc import Mapping

import numpy as np
import pytest

from identification.arrays import Array
from identification.columns.clock_groups import clocks_before
from workbench.logs.notation import NOTATION

T: Array = np.asarray(2e-3 * np.arange(600), dtype=np.float64)
Y: Array = 0.1 * np.sin(6.0 * T)
F: Array = np.cos(6.0 * T)


def told(names: list[str], *columns: Array) -> tuple[tuple[str, ...], Mapping[str, int]] | None:
    return clocks_before(names, [one[:40] for one in columns], columns.__getitem__, NOTATION)


def test_each_column_may_have_its_clock() -> None:
    found = told(["a", "pos", "b", "cur"], T, Y, T + 4e-4, F)
    assert found is not None
    groups, clocks = found
    assert groups == ("pos", "pos", "cur", "cur")
    assert clocks == {"pos": 0, "cur": 2}


def test_two_instruments_each_have_a_clock() -> None:
    found = told(["time_a", "pos", "vel", "time_b", "load"], T, Y, F, T + 4e-4, F)
    assert found is not None
    groups, _ = found
    assert groups == ("time_a", "time_a", "time_a", "load", "load")


@pytest.mark.parametrize(
    ("names", "columns"),
    [
        (["t", "pos", "time", "cur"], (T, Y, T, F)),  # the same clock twice
        (["time_s", "pos", "time_ms", "cur"], (T, Y, 1e3 * T, F)),  # in another unit
        (["t", "pos", "n", "cur", "on"], (T, Y, 3.0 + np.arange(600.0), F, F)),  # counts rows
        (["t", "pos", "turns", "cur", "on"], (T, Y, 0.5 + 2.0 * T, F, F)),  # an even position
        (["pos", "t", "cur", "time"], (Y, T, F, T + 4e-4)),  # behind their columns
    ],
)
def test_what_is_no_clock_of_its_own(names: list[str], columns: tuple[Array, ...]) -> None:
    assert told(names, *columns) is None
