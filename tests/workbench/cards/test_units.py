"""Units: known conversions, wrong dimensions, and that a round trip is exact."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from identification.errors import BadCard
from identification.log import Motion
from workbench.cards.units import column_scale, conversion, in_unit_of


@pytest.mark.parametrize(
    ("unit", "signal", "motion", "factor"),
    [
        ("mm", "y", "linear", 1e-3),
        ("inch", "y", "linear", 0.0254),
        ("bar", "p_p", "linear", 1e5),
        ("psi", "p_n", "linear", 6894.757293168),
        ("min", "t", "linear", 60.0),
        ("ms", "t", "linear", 1e-3),
        ("kip", "F", "linear", 4448.2216152605),
        ("lb", "F", "linear", 4.4482216152605),
        ("lbf", "F", "linear", 4.4482216152605),
        ("lb ft", "F", "rotary", 1.3558179483314),
        ("deg", "y", "rotary", 0.017453292519943),
        ("mV", "u", "linear", 1e-3),
        ("mA", "u", "linear", 1e-3),
        ("%", "u", "linear", 1e-2),
        ("1", "u", "linear", 1.0),
        ("inch/s", "velocity", "linear", 0.0254),
        ("0.001 mm", "y", "linear", 1e-6),
        ("0.1 %", "u", "linear", 1e-3),
    ],
)
def test_known_conversions(unit: str, signal: str, motion: Motion, factor: float) -> None:
    found = column_scale(unit, None, signal, motion)
    assert found.factor == pytest.approx(factor, rel=1e-10)
    assert found.shift == 0.0


@pytest.mark.parametrize(
    ("sheet", "factor", "unit"),
    [("Nm", 1.0, "N m"), ("mNm", 1e-3, "N m"), ("Ncm", 1e-2, "N m"), ("Nm/A", 1.0, "N m/A"),
     ("mNm/A", 1e-3, "N m/A"), ("kgm2", 1.0, "kg m^2"), ("kg*m^2", 1.0, "kg m^2"),
     ("gcm²", 1e-7, "kg m^2"), ("kgcm^2", 1e-4, "kg m^2"), ("kg m2", 1.0, "kg m^2"),
     ("Nms/rad", 1.0, "N m s/rad"), ("Nm/(rad/s)", 1.0, "N m s/rad"), ("Ns/m", 1.0, "N s/m")],
)  # fmt: skip
def test_units_of_data_sheets_are_read(sheet: str, factor: float, unit: str) -> None:
    found = conversion(sheet, unit)
    assert found is not None and found.factor == pytest.approx(factor)
    assert in_unit_of(f"2 {sheet}", unit, "rig.number") == pytest.approx(2.0 * factor)


def test_temperature_has_an_offset() -> None:
    found = column_scale("degC", None, "temperature", "linear")
    assert found.factor == pytest.approx(1.0)
    assert found.shift == pytest.approx(273.15)
    assert column_scale("degF", None, "temperature", "linear").factor == pytest.approx(5 / 9)


@pytest.mark.parametrize(
    ("unit", "signal", "message"),
    [
        ("bar", "y", "signals.y: unit 'bar' is not a length such as m, mm or inch"),
        ("mm", "F", "is not a force"),
        ("kg", "F", "is not a force"),
        ("m", "t", "is not a time"),
        ("N", "p_p", "is not a pressure"),
        ("m", "u", "is not a command"),
        ("deg", "y", "is not a length"),
        ("furlung", "y", "unit 'furlung' is unknown"),
        ("m m)", "y", "is unknown"),
        ("3 furlung", "y", "is unknown"),
        ("dBm", "power", "not linear"),
    ],
)
def test_wrong_units_are_refused(unit: str, signal: str, message: str) -> None:
    with pytest.raises(BadCard) as caught:
        column_scale(unit, None, signal, "linear")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@given(
    st.sampled_from(["mm", "cm", "km", "inch", "um"]), st.floats(-1e6, 1e6, allow_subnormal=False)
)
def test_lengths_scale_by_their_prefix(unit: str, value: float) -> None:
    sizes = {"mm": 1e-3, "cm": 1e-2, "km": 1e3, "inch": 0.0254, "um": 1e-6}
    assert value * column_scale(unit, None, "y", "linear").factor == pytest.approx(
        value * sizes[unit], rel=1e-12
    )


@pytest.mark.parametrize(
    "unit",
    [
        *("m**9**9**9**9", "10 cubed cubed cubed", "m**(9**9)", "m**99999999", "10^(9)^(9)^(9) m"),
        *(
            "((((((((10**9)**9)**9)**9)**9)**9)**9)**9) m",
            "1e9999 m",
            "(" * 5000 + "m",
            "m" * 100_000,
        ),
    ],
)
def test_units_that_would_be_worked_out_for_ever_are_unknown(unit: str) -> None:
    with pytest.raises(BadCard, match="is unknown; write it as in") as caught:
        column_scale(unit, None, "y", "linear")
    assert len(str(caught.value)) < 200


@pytest.mark.parametrize("unit", ["kg m^2/s^2", "kg*m**2*s**-2", "kg m² s^(-2)", "(m/s)^2 kg"])
def test_powers_of_sound_units_are_read(unit: str) -> None:
    assert column_scale(unit, None, "F", "rotary").factor == pytest.approx(1.0)
