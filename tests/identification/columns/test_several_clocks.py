"""Columns of several clocks brought to one."""

import numpy as np

from identification.arrays import Array
from identification.columns.column import RawColumn
from identification.columns.several_clocks import on_clock_of_most
from workbench.logs.notation import NOTATION

T: Array = np.asarray(2e-3 * np.arange(600), dtype=np.float64)
Y: Array = 0.1 * np.sin(6.0 * T)
F: Array = np.cos(6.0 * T)


def test_clocks_without_a_time_in_common_are_said_to_be() -> None:
    columns = [
        RawColumn(0, "a/t", "t", "", T, group="a"), RawColumn(1, "a/y", "y", "", Y, group="a"),
        RawColumn(2, "a/v", "v", "", F, group="a"), RawColumn(4, "b/F", "F", "", F, group="b"),
        RawColumn(3, "b/t", "t", "", T + 900.0, group="b"),
    ]  # fmt: skip
    found = {one.key: one.unusable for one in on_clock_of_most(columns, {}, NOTATION)}
    assert "hardly a time in common" in found["b/F"]
    assert found["a/y"] == ""
