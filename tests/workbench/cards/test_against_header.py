"""Units that a card and a header do not share."""

import pytest

from identification.log import Rig
from workbench.cards.card_tables import SignalSpec
from workbench.cards.headers import contradicted_units

MOTOR = Rig("motor", force_per_command=30.0, command_unit="A")


@pytest.mark.parametrize(
    ("name", "column", "unit", "times"),
    [
        ("u", "current_A", "mA", "1000"),
        ("y", "position_mm", "m", "1000"),
        ("t", "t [ms]", "s", "1000"),
        ("y", "stroke [inch]", "mm", "25.4"),
    ],
)
def test_another_unit_than_the_headers_is_reported(
    name: str, column: str, unit: str, times: str
) -> None:
    (line,) = contradicted_units({name: SignalSpec(column=column, unit=unit)}, MOTOR).values()
    assert f"signals.{name}: the header {column!r} says" in line
    assert f"the card {unit!r}, {times} times apart" in line
    assert "\n" not in line


@pytest.mark.parametrize(
    ("name", "spec"),
    [
        ("y", SignalSpec(column="position_mm", unit="mm")),
        ("y", SignalSpec(column="y_m", unit="mm")),  # measured, perhaps
        ("y", SignalSpec(column="position [mm]", unit="mm", gain=-1.0)),
        ("y", SignalSpec(column="position [mm]", unit="V", gain="10 V/m")),
        ("y", SignalSpec(column="position", unit="m")),
        ("u", SignalSpec(column="p [bar]", unit="A")),
        ("y", SignalSpec(column=3, unit="m")),
    ],
)
def test_nothing_is_reported_where_the_header_says_no_other(name: str, spec: SignalSpec) -> None:
    assert contradicted_units({name: spec}, MOTOR) == {}
