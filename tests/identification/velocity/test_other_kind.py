"""A body against friction predicts its own log better than a valve does, and no valve's."""

import numpy as np
import pytest

from identification.velocity.fit import fit
from identification.velocity.other_kind import body_squares
from identification.velocity.record import recorded
from identification.velocity.rivals import clearly_better, held_out
from tests.identification.motor_logs import made as made_motor
from tests.identification.velocity.made import made


def test_a_valve_is_no_body() -> None:
    record = recorded([made(70, duration=30.0)])
    found = fit(record)
    errors = held_out(record, found.valve, found.free, None).long
    assert clearly_better(errors, body_squares(record, found.valve))[0]


@pytest.mark.slow
def test_a_body_is_no_valve() -> None:
    record = recorded([made_motor(3)])
    found = fit(record)
    errors = held_out(record, found.valve, found.free, None).long
    body = body_squares(record, found.valve)
    assert np.sqrt(np.mean(body)) < 0.7 * np.sqrt(np.mean(errors))
    assert clearly_better(body, errors)[0]
