"""What tells effects apart in a run."""

import numpy as np
import pytest

from identification.effects._library import built_in
from identification.experiment.information import information, rests_of, run_errors
from identification.experiment.structures import discriminated, sought
from tests.identification.experiment.test_information import MOTOR, H, pulses

STROKE = (-0.2, 0.1)


def test_what_others_make_up_for_tells_nothing() -> None:
    rng = np.random.default_rng(2)
    columns = rng.standard_normal((50, 3))
    mixed = np.column_stack([columns, columns @ [0.3, -2.0, 0.0]])
    G = mixed.T @ mixed
    assert discriminated(G, 3, (0, 1)) == pytest.approx(0.0, abs=1e-6 * G[3, 3])
    q, _ = np.linalg.qr(columns)
    alone = np.eye(3) * 4.0
    assert discriminated(alone, 2, (0, 1)) == pytest.approx(4.0)
    assert discriminated((5.0 * q).T @ (5.0 * q), 0, (1, 2)) == pytest.approx(25.0)


def test_a_law_is_distinguished_better_from_another_place_than_from_its_like() -> None:
    log, v = pulses((1.0, -1.0, 1.0, -1.0), 1.3)
    errors = run_errors(log, log["y"], rests_of(v, H, 0.5), 1e-5, 0.0)
    keys = ("stribeck", "nonlinear_viscous", "spring")
    rivals = [sought(built_in()[key], MOTOR, STROKE) for key in keys]
    of_run = information(MOTOR, errors, "command", rivals)
    assert of_run.names[-3:] == keys
    own = tuple(range(len(of_run.names) - 3))
    place = {key: of_run.names.index(key) for key in keys}
    none = discriminated(of_run.matrix, place["stribeck"], own)
    like = discriminated(of_run.matrix, place["stribeck"], (*own, place["nonlinear_viscous"]))
    other = discriminated(of_run.matrix, place["stribeck"], (*own, place["spring"]))
    assert 0.0 < like <= none
    assert 0.0 < other <= none
    assert none > 9.0


@pytest.mark.parametrize("key", sorted(built_in()))
def test_every_effect_is_looked_for_within_its_bounds_and_the_stroke(key: str) -> None:
    one = sought(built_in()[key], MOTOR, STROKE)
    places = [one.values[p.name] for p in one.effect.params if p.role == "place"]
    assert all(STROKE[0] < y < STROKE[1] for y in places)
    assert any(value != 0.0 for value in one.p)
