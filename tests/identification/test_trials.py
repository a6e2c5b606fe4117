"""What is tried in the forward run, and from which values."""

from identification.choice import first_stage
from identification.library import built_in
from identification.trials import grid, rigid
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


def test_a_contact_is_rigid_where_nothing_moves_at_rest() -> None:
    _, first = first_stage([seen(made(2))], False)
    assert rigid(first)
    _, first = first_stage([seen(made(2, {"presliding": {"sigma_0": 5e4}}))], False)
    assert not rigid(first)
    assert not rigid({})
