"""Headers read: units in all their spellings, and what words mean."""

import pytest

from identification.columns.header import Quantity
from workbench.cards.headers import read_header
from workbench.cards.units import conversion
from workbench.cards.written_units import written_unit

READ = [
    ("pos [mm]", "mm", "position", ""),
    ("Position (µm)", "um", "position", ""),
    ("Position (μm)", "um", "position", ""),
    ("p1/bar", "bar", "pressure", ""),
    ("Kraft_N", "N", "force", ""),
    ("Force, N", "N", "force", ""),
    ("変位(mm)", "mm", "position", ""),
    ("圧力A[MPa]", "MPa", "pressure", ""),
    ("圧力A\uff3bMPa\uff3d", "MPa", "pressure", ""),
    ("Zeit / s", "s", "time", ""),
    ("経過時間 in s", "s", "time", ""),
    ("t_ms", "ms", "time", ""),
    ("speed_mm_s", "mm/s", "velocity", ""),
    ("f_meas_kN", "kN", "force", "measured"),
    ("Winkel [°]", "deg", "position", ""),
    ("Drehmoment in Nm", "N m", "force", ""),
    ("i_q [A]", "A", "command", ""),
    ("Sollposition [mm]", "mm", "position", "reference"),
    ("目標位置[mm]", "mm", "position", "reference"),
    ("Istposition", None, "position", "measured"),
    ("cmd_pos", None, "position", "reference"),
    ("SetPos", None, "position", "reference"),
    ("ActPos", None, "position", "measured"),
    ("goal_position", None, "position", "reference"),
    ("Soll-Spannung [V]", "V", "command", "demand"),
    ("指令電圧\uff08V\uff09", "V", "command", "demand"),
    ("Ventilspannung", None, "command", ""),
    ("PosErr", None, "position", "error"),
    ("input_volts", "V", "other", ""),
    ("temp", None, "temperature", ""),
    ("r80[0]: Actual torque value [Nm]", "N m", "force", "measured"),
    ("r479[0]: Diagnostics position actual value Gn_XIST1 [LU]", None, "position", "measured"),
    ("erpm", None, "velocity", ""),
    ("/joint_states/hip/effort", None, "force", ""),
    ("/cmd/hip/position", None, "position", "reference"),
    ("PositionRad", "rad", "position", ""),
    ("/RealOutputs/Arm/VelocityRadPerSec", "rad/s", "velocity", ""),
    ("elevatorPositionMm", "mm", "position", ""),
    ("AxisStatus.Drive.ActualTorque", None, "force", "measured"),
    ("joints.elbow.eff", None, "force", ""),
    ("observation.state[3]", None, "position", ""),
    ("PL.CMD (Counts16Bit)", "count", "position", "reference"),
    ("IL.CMD (Arms)", "A", "command", "demand"),
]


@pytest.mark.parametrize(("text", "unit", "quantity", "purpose"), READ)
def test_a_header_tells_unit_and_meaning(
    text: str, unit: str | None, quantity: Quantity, purpose: str
) -> None:
    found = read_header(text)
    assert (found.unit.card if found.unit else None) == unit
    assert quantity in found.means
    assert found.purpose == purpose


@pytest.mark.parametrize(
    ("text", "drives"),
    [("motor_angle", False), ("motorPosition", False), ("motor", True), ("motor_pos_cmd", True),
     ("motor_current", True), ("valve_position", True), ("Control Effort", True),
     ("Motor Speed (RPM)", False), ("cur_vel", False), ("fb_cur", True), ("integrator", False),
     ("joint_effort", False)],
)  # fmt: skip
def test_where_a_motor_stands_is_no_command(text: str, drives: bool) -> None:
    assert ("command" in read_header(text).means) == drives


@pytest.mark.parametrize("text", ["p_A", "p_n", "F_e", "ch1", "x", "actual_current_1", "q 1"])
def test_a_name_with_an_index_has_no_unit(text: str) -> None:
    assert read_header(text).unit is None


@pytest.mark.parametrize(
    ("text", "means", "purpose"),
    [("tau_p", {"force"}, ""), ("vel_x", {"velocity"}, ""), ("torque_z", {"force"}, ""),
     ("motor_q", {"position"}, ""), ("velocityCommanded", {"velocity"}, "reference"),
     ("pos_state", {"position"}, ""), ("tau_state", {"force", "position"}, "")],
)  # fmt: skip
def test_a_letter_beside_what_is_spoken_of_is_an_index(
    text: str, means: set[Quantity], purpose: str
) -> None:
    found = read_header(text)
    assert (set(found.means), found.purpose) == (means, purpose)


def test_a_unit_may_be_all_of_a_header() -> None:
    angle = read_header("radian").unit
    assert angle is not None and angle.card == "rad"


def test_a_letter_behind_a_name_is_a_doubtful_unit() -> None:
    found = read_header("y_m")
    assert found.unit is not None and found.unit.card == "m"
    assert found.doubtful


def test_a_row_of_units_goes_before_the_header() -> None:
    found = read_header("weg", "[mm]")
    assert found.unit is not None and found.unit.card == "mm"
    assert found.name == "weg"


def test_case_tells_newton_metres_from_nanometres() -> None:
    newton, nano = written_unit("Nm"), written_unit("nm")
    assert newton is not None and newton.card == "N m" and newton.rotary
    assert nano is not None and nano.quantity == "position"


@pytest.mark.parametrize("text", ["mm", "µm", "bar(g)", "kgf/cm²", "°/s", "U/min", "%", "℃",
                                  "パルス", "lb-in", "in", "KN", "mpa"])  # fmt: skip
def test_every_spelling_gives_a_unit_that_cards_know(text: str) -> None:
    found = written_unit(text)
    assert found is not None
    assert conversion(found.card, None) is not None


def test_case_tells_meganewtons_from_millinewtons() -> None:
    found = {text: written_unit(text) for text in ("MN", "mN", "mn")}
    assert {text: unit and unit.card for text, unit in found.items()} == {
        "MN": "MN", "mN": "mN", "mn": "mN",
    }  # fmt: skip
    scale = conversion("MN", "N")
    assert scale is not None and scale.factor == pytest.approx(1e6)


def test_what_is_no_unit_is_none() -> None:
    assert written_unit("valve") is None
    assert written_unit("") is None


@pytest.mark.parametrize(
    ("text", "means"),
    [
        ("Position actual value [0x6064]", {"position"}),
        ("Current actual value (0x6078/00)", {"command"}),
        ("0x606C:00 velocity actual value", {"velocity"}),
    ],
)
def test_an_address_of_an_object_is_no_word(text: str, means: set[str]) -> None:
    assert set(read_header(text).means) == means
