"""From a regression's sizes to a plant."""

import numpy as np
import pytest

from identification.estimation.recorded_logs import recorded_logs
from identification.estimation.structure_fit import by_exact_force, plain_structure
from identification.log import Rig
from identification.thresholds import COMPLETE
from tests.identification.jumping_command import MASS, cart_log
from tests.identification.motor_logs import K_A, NINE, made, strokes


def test_a_log_with_few_rows_of_sliding_is_followed_from_what_these_give() -> None:
    """From its first estimate alone the run ends where one direction has no Coulomb friction."""
    recorded = recorded_logs([cart_log(1, 0)], Rig("motor", force_per_command=1.0), None)
    model = plain_structure(recorded, np.random.default_rng(0))
    assert model.misfit <= COMPLETE
    assert abs(model.plant.friction.m / MASS - 1.0) < 0.01


@pytest.mark.parametrize("reached", [True, False])
def test_a_noise_of_the_command_that_moved_the_motor_is_none_of_its_force(reached: bool) -> None:
    """As of a loop whose own measurement is not the logged one. By the log's signals alone either
    is as noisy."""
    u = strokes(6000, 3)
    noisy = u + 0.02 * np.random.default_rng(3).standard_normal(len(u))
    log = made(3, n=len(u), command=noisy if reached else u)
    log = log.with_signals(u=noisy, F=K_A * noisy)
    recorded = recorded_logs([log], Rig("motor", force_per_command=K_A))
    assert recorded.logs[0].noise.F > 0.3
    rng = np.random.default_rng(0)
    exact, found = by_exact_force(recorded, plain_structure(recorded, rng), rng)
    assert exact.exact == reached
    assert pytest.approx(0.0 if reached else 0.4, abs=0.03) == exact.given(log).noise.F
    if reached:
        friction = found.plant.friction
        assert friction.F_sp == pytest.approx(NINE.F_sp, rel=1e-3)
        assert friction.F_sn == pytest.approx(NINE.F_sn, rel=1e-3)
