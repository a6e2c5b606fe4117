"""What the headers of one log say together."""

import pytest

from identification.columns.names import read_together
from workbench.logs.notation import NOTATION


@pytest.mark.parametrize(
    ("header", "means", "purpose"),
    [("torque_current", "command", ""), ("tau_motor", "force", ""),
     ("command_torque", "force", "reference")],
)  # fmt: skip
def test_of_torque_and_current_one_is_meant(header: str, means: str, purpose: str) -> None:
    (head,) = read_together([(header, "")], NOTATION)
    assert (set(head.means), head.purpose) == ({means}, purpose)


def test_a_torque_in_small_letters_is_in_no_nanometres() -> None:
    torque, slide, speed = read_together(
        [("torque_nm", ""), ("position_nm", ""), ("speed_rad_per_s", "")], NOTATION
    )
    assert torque.unit is not None and torque.unit.card == "N m"
    assert slide.unit is not None and slide.unit.card == "nm"
    assert speed.unit is not None and speed.unit.card == "rad/s"


def test_a_function_of_time_is_no_time() -> None:
    heads = read_together([("setpoint(t)", ""), ("input_u(t)", ""), ("output_y(t)", "")], NOTATION)
    assert all(one.unit is None and "time" not in one.means for one in heads)


def test_what_is_measured_beside_a_command_is_in_no_milliseconds() -> None:
    heads = read_together([(one, "") for one in ("Time", "Arm Ms", "Arm Cmd", "Lag ms")], NOTATION)
    _, measured, _, lag = heads
    assert measured.unit is None and measured.purpose == "measured" and measured.name == "Arm Ms"
    assert lag.unit is not None and lag.unit.card == "ms"
