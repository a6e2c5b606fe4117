"""Rows that are no samples: messages of a logger, rows of several axes, a clock that was set."""

from pathlib import Path

import numpy as np
import pytest

from identification.arrays import Array
from identification.columns.log_columns import columns_of
from tests.workbench.log_files import card, signals, write_csv
from workbench.logs.notation import NOTATION
from workbench.logs.runs import read_runs
from workbench.logs.unknown import read_unknown


def with_line(folder: Path, line: str) -> Path:
    """A sound CSV with this line in its middle."""
    path = folder / "a.csv"
    write_csv(path, signals())
    lines = path.read_text("utf-8").splitlines()
    path.write_text("\n".join([*lines[:200], line, *lines[200:]]), "utf-8")
    return path


@pytest.mark.parametrize("line", ["ERROR 17", "ERROR 17,,", "2.0,ERROR 17,", "1.995,ERROR 17,"])
def test_a_message_of_the_logger_is_left_out(tmp_path: Path, line: str) -> None:
    path = with_line(tmp_path, line)
    found = read_runs(path, card(tmp_path))
    (run,) = found.runs
    np.testing.assert_array_equal(run["y"], signals()["y"])
    assert any("left out" in one for one in found.remarks)
    log = columns_of(read_unknown(path), NOTATION)
    assert len(log.clock.values) == 400
    assert any("left out" in one for one in (*log.log.notes, *found.remarks))


def at(t: Array, folder: Path) -> Path:
    write_csv(folder / "a.csv", {**signals(800), "t": t})
    return folder / "a.csv"


@pytest.mark.parametrize(
    ("leap", "said"),
    [
        (3600.0, "3600 s in gaps left out (whole hours: summer time, or a clock"),
        (-3600.0, "its clock goes back by 3600 s (whole hours: summer time, or a clock that was"),
        (-0.5, "its clock goes back by 0.49 s: 2 runs"),
    ],
)
def test_a_clock_that_was_set_gives_two_runs(tmp_path: Path, leap: float, said: str) -> None:
    t = signals(800)["t"]
    path = at(np.where(t >= 4.0, t + leap, t), tmp_path)
    found = read_runs(path, card(tmp_path))
    assert [len(run) for run in found.runs] == [400, 400]
    assert any(said in one for one in found.remarks), found.remarks
    log = columns_of(read_unknown(path), NOTATION)
    assert len(log.clock.values) == 400
    assert any("the clock" in one for one in log.log.notes)


def test_runs_between_gaps_are_not_called_resampled(tmp_path: Path) -> None:
    t = signals(800)["t"]
    found = read_runs(at(np.where(t >= 4.0, t + 3600.0, t), tmp_path), card(tmp_path))
    assert not any("resampled" in one for one in found.remarks)
    assert "in 2 runs" in found.remarks[-1]


@pytest.mark.parametrize("names", [("X", "Y"), ("1", "2")])
def test_rows_of_several_axes_in_turn_are_a_column_for_each(
    tmp_path: Path, names: tuple[str, str]
) -> None:
    own, lines = signals(), ["t,axis,y,F"]
    for t, y, F in zip(own["t"], own["y"], own["F"], strict=True):
        lines += [f"{t},{names[0]},{y},{F}", f"{t},{names[1]},{-y},{-F}"]
    (tmp_path / "a.csv").write_text("\n".join(lines), "utf-8")
    found = {one.header: one.values for one in read_unknown(tmp_path / "a.csv").columns}
    assert list(found) == ["t", *(f"{name} {key}" for key in "yF" for name in names)]
    np.testing.assert_allclose(found[f"{names[1]} y"], -own["y"])


def test_runs_with_a_number_are_no_axes(tmp_path: Path) -> None:
    own = {key: np.tile(x, 2) for key, x in signals().items()}
    write_csv(tmp_path / "a.csv", {**own, "trial": np.repeat([1.0, 2.0], 400)})
    assert len(read_runs(tmp_path / "a.csv", card(tmp_path)).runs) == 2
