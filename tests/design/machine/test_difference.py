"""Two versions side by side, as documents hold them and as people read them."""

from typing import Any

from design.machine.difference import Number, as_read, difference
from workbench.registry.views import difference_screen

NAMES = ("version 1", "version 2")


def version(dv: float, design: bool = True) -> dict[str, Any]:
    friction = {
        "dv_p": {"value": dv, "unit": "m/s", "low": 0.9 * dv, "high": 1.1 * dv},
        "F_cp": {"value": 17.0, "unit": "N", "low": 16.0, "high": 18.0},
    }
    made = {"recommended": "pid", "pid": {"K": {"value": 3.0, "unit": "N/m"}}}
    return {"model": {"friction": friction}, "design": made if design else None}


def test_people_read_millimetres_and_documents_hold_metres() -> None:
    lines = difference(version(0.040004), version(0.080008))
    shown, said = as_read(lines, NAMES)
    assert said == "" and len(shown) == len(lines)
    first, one = lines[0], shown[0]
    assert first.unit == "m/s" and isinstance(first.before, Number)
    assert first.before.value == 0.040004
    assert one.unit == "mm/s" and isinstance(one.before, Number)
    assert one.before.value == 40.004 and one.change == 1.0


def test_an_interval_has_digits_enough_to_have_a_width() -> None:
    sharp = {"value": 300.0, "unit": "N", "low": 299.997, "high": 300.004}
    lines = difference({"model": {"friction": {"F": sharp}}}, {"model": {"friction": {"F": sharp}}})
    row = difference_screen(lines, NAMES).text().strip().splitlines()[2].split("  ")
    assert [cell.strip() for cell in row if cell][1:] == [
        "300.000", "N", "299.997 to 300.004", "300.000", "299.997 to 300.004"
    ]  # fmt: skip


def test_a_version_without_a_design_is_said_once() -> None:
    lines = difference(version(0.04), version(0.04, design=False))
    shown, said = as_read(lines, NAMES)
    assert said == "version 2 has no design"
    assert [line.name for line in shown] == ["dv_p", "F_cp"]
    printed = difference_screen(lines, NAMES).text()
    assert "version 2 has no design" in printed
    assert "changed" not in printed and "+0" not in printed
