"""What is tried in the forward run, and from which values."""

from identification.effects._library import built_in
from identification.estimation.regression.row_fit import first_stage
from identification.tracing.free_run.trial_structures import grid, rigid
from identification.tracing.regression.shape_grid import median_rest, shape_grid
from tests.identification.motor_logs import made, plant, seen


def test_values_to_begin_from_lie_within_bounds() -> None:
    one = seen(made(1))
    for key in ("backlash", "presliding", "rising_stiction", "load_dependent_friction"):
        effect = built_in()[key]
        values = grid(effect, plant(), [one])
        assert values
        for v in values:
            effect.acting(v)
    assert grid(built_in()["spring"], plant(), [one]) == []


def test_times_of_growth_are_those_of_the_rests() -> None:
    effect = built_in()["rising_stiction"]
    one = seen(made(1))
    rest = median_rest([one], 7.0)
    assert 0.1 < rest < 0.6  # the command is off for 0.1 to 0.5 s
    times = shape_grid(effect, effect.params[1], [one])
    assert times[0] < 0.3 * rest and times[-1] > 3.0 * rest
    moving = seen(made(1).with_signals(y=0.3 * made(1)["t"]))
    assert median_rest([moving], 7.0) == 7.0


def test_a_contact_is_rigid_where_nothing_moves_at_rest() -> None:
    _, first = first_stage([seen(made(2))], False)
    assert rigid(first)
    _, first = first_stage([seen(made(2, {"presliding": {"sigma_0": 5e4}}))], False)
    assert not rigid(first)
    assert not rigid({})
