"""The search for poles: goals kept, the asked taken as asked, what is missed said."""

import numpy as np
import pytest

from design.linear import force_gains, linear_plant
from design.margins import margins
from design.tune import Asked, Goals, goals_missed, tune_pid, tune_rst, worst_modulus
from identification.arrays import Array
from identification.errors import BadSpecification
from identification.model.plant import Actuator

ACTUATOR = Actuator(19530.0, 10405.0)
H = 0.01


def plant(m: float, f: float) -> tuple[Array, Array]:
    return linear_plant(m, f, H, ACTUATOR, force_gains(ACTUATOR, H / 10), 10)


@pytest.mark.slow
@pytest.mark.parametrize(("m", "f"), [(1.0, 250.0), (3.5, 288.0), (6.5, 130.0)])
def test_defaults_keep_the_goals_on_the_paper_s_plants(m: float, f: float) -> None:
    A, B = plant(m, f)
    for tune in (tune_rst, tune_pid):
        found = tune(A, B, H, Asked(), Goals())
        assert found.missed == ()
        checked = margins(A, B, found.rst)
        assert checked.modulus >= 0.5
        assert checked.delay_s is not None and checked.delay_s >= 2 * H
        assert found.rst.stable


@pytest.mark.parametrize("h", [0.001, 0.01])
def test_defaults_keep_the_goals_on_a_motor_axis(h: float) -> None:
    A, B = linear_plant(95.0, 203.0, h)
    found = tune_rst(A, B, h, Asked(), Goals())
    assert found.missed == ()
    assert margins(A, B, found.rst).modulus >= 0.5


def test_corners_hold_too_and_slow_the_loop() -> None:
    A, B = plant(1.0, 250.0)
    corners = (plant(0.95, 200.0), plant(1.05, 300.0))
    alone = tune_rst(A, B, H, Asked(), Goals())
    robust = tune_rst(A, B, H, Asked(), Goals(), corners)
    assert robust.missed == ()
    assert robust.dominant[0] < alone.dominant[0]
    assert robust.worst is not None and robust.worst >= 0.5
    assert robust.worst == worst_modulus(((A, B), *corners), robust.rst)


def test_asked_poles_are_the_loop_s() -> None:
    A, B = plant(3.5, 288.0)
    found = tune_rst(A, B, H, Asked((15.0, 0.9), (0.5, 0.3)), Goals())
    assert found.dominant == (15.0, 0.9)
    assert found.auxiliary == (complex(0.5), complex(0.3))
    assert found.rst.P is not None
    assert abs(np.polyval(found.rst.P, 0.5)) < 1e-9


def test_effort_bounds_the_noise_in_the_force() -> None:
    A, B = plant(6.5, 130.0)
    free = tune_rst(A, B, H, Asked(), Goals())
    calm = tune_rst(A, B, H, Asked(), Goals(effort=70.0))
    assert calm.missed == ()
    assert calm.margins.S_up_max_db is not None and calm.margins.S_up_max_db <= 70.0
    assert free.margins.S_up_max_db is not None and free.margins.S_up_max_db > 70.0


def test_without_integrator_S_has_no_root_at_one() -> None:
    A, B = plant(1.0, 250.0)
    with_it = tune_rst(A, B, H, Asked(), Goals())
    without = tune_rst(A, B, H, Asked(integrator=False), Goals())
    assert with_it.rst.S.sum() == pytest.approx(0.0, abs=1e-6)
    assert abs(without.rst.S.sum()) > 1e-3


def test_what_is_missed_is_said() -> None:
    A, B = plant(1.0, 250.0)
    found = tune_rst(A, B, H, Asked((60.0, 1.0), (0.1,)), Goals(0.9, 5.0, 20.0))
    text = " ".join(found.missed)
    assert "modulus margin" in text and "delay margin" in text and "dB of force" in text
    lost = goals_missed(found.margins, Goals(0.0, 0.0), integrates=True)
    assert lost == ()


def test_poles_that_no_loop_has_are_refused() -> None:
    A, B = plant(1.0, 250.0)
    with pytest.raises(BadSpecification, match="zeta"):
        tune_rst(A, B, H, Asked((20.0, -1.0)), Goals())
    with pytest.raises(BadSpecification, match="not stable"):
        tune_rst(A, B, H, Asked((20.0, 1.0), (1.2,)), Goals())
