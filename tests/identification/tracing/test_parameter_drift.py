"""What changed between training and test logs: the fewest parameters, and none that cannot be."""

from dataclasses import replace

import numpy as np
import pytest

from identification.estimation.regression.equation_rows import FIVE, MECHANICAL
from identification.estimation.regression.row_fit import RowFit, first_stage
from identification.estimation.regression.weighted_rows import Rows
from identification.estimation.structure_fit import FittedStructure
from identification.log import Rig
from identification.tracing import parameter_drift
from identification.tracing.parameter_drift import changes, is_refined
from identification.tracing.result import Change
from tests.identification.motor_logs import NINE, made, plant, seen


def trained() -> tuple[RowFit, Rows]:
    """What a motor's log leaves, and the rows of another log of it."""
    _, first = first_stage([seen(made(3))], by_command=False)
    stage, _ = first_stage([seen(made(4))], by_command=False)
    (rows,) = stage.parts[MECHANICAL]
    return first[MECHANICAL], rows


def found(mine: RowFit, rows: Rows, more: float) -> list[tuple[str, float, float, float]]:
    """The changes, where the friction towards + is higher by so much [N]."""
    keep = rows.speed >= mine.slowest
    shifted = Rows(**{**vars(rows), "b": rows.b + more * (rows.X[:, 1] != 0)})
    return changes(mine, shifted, keep, FIVE, np.zeros(5))


def test_the_parameter_that_changed_is_named_alone() -> None:
    mine, rows = trained()
    assert found(mine, rows, 0.0) == []
    ((name, before, after, sd),) = found(mine, rows, 3.0)
    assert name == "F_cp"
    assert abs(after - before - 3.0) < 5.0 * sd < 0.5


def test_a_change_as_small_as_what_a_loop_does_between_the_samples_is_none() -> None:
    mine, rows = trained()
    keep = rows.speed >= mine.slowest
    shifted = Rows(**{**vars(rows), "b": rows.b + 0.05 * NINE.F_cp * (rows.X[:, 1] != 0)})
    assert changes(mine, shifted, keep, FIVE, np.zeros(5))
    assert not changes(mine, shifted, keep, FIVE, np.zeros(5), slight=0.1)


def test_no_parameter_becomes_negative() -> None:
    mine, rows = trained()
    changed = found(mine, rows, -40.0)
    assert all(after >= 0.0 for _, _, after, _ in changed)
    assert "F_cp" not in [name for name, *_ in changed]


def test_a_change_within_the_error_of_the_training_is_none() -> None:
    """A training log that hardly shows a parameter cannot show that it has changed."""
    mine, rows = trained()
    sliding = np.flatnonzero(mine.rows.speed >= mine.slowest)
    few = np.isin(np.arange(len(mine.rows.b)), sliding[:: len(sliding) // 12])
    vague = replace(
        mine,
        rows=mine.rows.at(few),
        fit=replace(mine.fit, residual=3.0 * np.ones(int(np.sum(few)))),
    )
    ((name, *_),) = found(mine, rows, 0.5)
    assert name == "F_cp"
    assert found(vague, rows, 0.5) == []


def test_the_largest_of_several_changes_is_none_by_chance(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two and a half deviations are significant of one parameter, not of the largest of five."""
    mine, rows = trained()
    for many, named in ((2.5, []), (4.0, ["F_cp"])):
        sd = np.full(5, 0.5 / many)
        monkeypatch.setattr(parameter_drift, "deviations", lambda _, sd=sd: sd)
        assert [name for name, *_ in found(mine, rows, 0.5)] == named


@pytest.mark.parametrize(
    ("misfit", "refined", "same"),
    [(1.0, 4.0, True), (1.0, 3.7, False), (9.0, 4.0, False)],  # the last run does not follow
)
def test_what_the_run_has_already_has_not_changed(
    misfit: float, refined: float, same: bool
) -> None:
    """The position's noise biases the equations, which differ from the test logs, not the run."""
    friction = replace(NINE, m=refined)
    stage, outcomes = first_stage([seen(made(3))], by_command=False)
    model = FittedStructure(stage, outcomes, replace(plant(), friction=friction), {}, False, misfit)
    assert is_refined(Change("m", "kg", 3.7, 4.01, 0.04), model) is same


@pytest.mark.parametrize(("between", "named"), [(0.0, ["F_cp"]), (1e-3, [])])
def test_a_slight_change_is_none_where_commands_are_unseen(
    between: float, named: list[str]
) -> None:
    """The same two logs, of a loop as slow as they and of a faster one."""
    last = seen(made(4))
    stage, outcomes = first_stage([seen(made(3))], by_command=False)
    log = last.log
    up = np.where(last.signals["d"] > 0.0, 0.05 * NINE.F_cp, 0.0)
    pushed = replace(
        last, log=log.with_signals(F=np.asarray(log["F"]) + up),
        noise=replace(last.noise, between=between),
    )  # fmt: skip
    model = FittedStructure(stage, outcomes, plant(), {}, False, 9.0)
    found = parameter_drift.parameter_drift(
        model, (), [pushed], Rig("motor", force_per_command=1.0)
    )
    assert [one.name for one in found.changes] == named
