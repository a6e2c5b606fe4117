"""Gains of sensors: every plain way to write one reads alike; a wrong one says what to write."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identification.errors import BadCard
from identification.log import Motion
from tests.workbench.log_files import CARD, card, signals, write_csv
from workbench.cards.units import Gain, column_scale, parse_gain
from workbench.logs.runs import read_log
from workbench.steps.simulate import as_columns


@pytest.mark.parametrize(
    ("unit", "gain", "signal", "motion", "factor"),
    [
        ("V", 80, "y", "linear", 1 / 80),
        ("V", "80 V/m", "y", "linear", 1 / 80),
        ("V", "80V/m", "y", "linear", 1 / 80),
        ("V", "-8e1 V / m", "y", "linear", -1 / 80),
        ("V", "0.08 V/mm", "y", "linear", 1 / 80),
        ("mV", "80 V/m", "y", "linear", 1e-3 / 80),
        ("V", "V/m", "y", "linear", 1.0),
        ("mm", 2.0, "y", "linear", 0.5e-3),
        ("mm", "2", "y", "linear", 0.5e-3),
        ("mm", None, "y", "linear", 1e-3),
        ("mA", "1.6 mA/bar", "p_p", "linear", 1e5 / 1.6),
        ("V", "2 mV/lb", "F", "linear", 500 * 4.4482216152605),
        ("V", "2 V/(N m)", "F", "rotary", 0.5),
        ("count", "4096 count/turn", "y", "rotary", 2 * np.pi / 4096),
        ("count", 4096 / (2 * np.pi), "y", "rotary", 2 * np.pi / 4096),
        ("count", "1000 1/mm", "y", "linear", 1e-6),
        ("1", 885.0, "u", "linear", 1 / 885),
        ("A", "0.5 A/V", "u", "linear", 2.0),
        ("mV", "10 mV/K", "temperature", "linear", 0.1),
    ],
)
def test_known_gains(
    unit: str, gain: float | str | None, signal: str, motion: Motion, factor: float
) -> None:
    found = column_scale(unit, gain, signal, motion)
    assert found.factor == pytest.approx(factor, rel=1e-12)
    assert found.shift == 0.0


@pytest.mark.parametrize(
    ("unit", "gain", "signal", "motion", "needed"),
    [
        ("V", None, "y", "linear", 'gain = "<number> V/m"'),
        ("V", None, "F", "rotary", 'gain = "<number> V/(N m)"'),
        ("kg", 9.81, "F", "linear", 'gain = "9.81 kg/N"'),
        ("V", "80 mm/V", "y", "linear", 'so write gain = "0.0125 V/mm"'),
        ("mm", "80 V/m", "y", "linear", 'so write unit = "V", the unit of the column'),
        ("V", "80 V", "y", "linear", 'so write gain = "<number> V/m"'),
        ("V", "80 V/N", "y", "linear", "column = gain * signal"),
        ("V", "eighty", "y", "linear", "unit 'eighty' is unknown"),
        ("V", "80 V/m)", "y", "linear", "written as in '80 V/m'"),
        ("volts per", 80, "y", "linear", "unit 'volts per' is unknown"),
        ("m", None, "t", "linear", "unit 'm' is not a time"),
    ],
)
def test_a_mismatch_says_what_to_write(
    unit: str, gain: float | str | None, signal: str, motion: Motion, needed: str
) -> None:
    with pytest.raises(BadCard) as caught:
        column_scale(unit, gain, signal, motion)
    text = str(caught.value)
    assert text.startswith(f"signals.{signal}: ")
    assert needed in text
    assert "\n" not in text


@pytest.mark.parametrize("gain", [0, 0.0, "0", "0 V/m", "", " ", "0,5 V/bar", "1e999 V/m"])
def test_gains_that_are_none(gain: float | str) -> None:
    with pytest.raises(ValueError, match="gain"):
        parse_gain(gain)


@given(
    st.floats(1e-6, 1e6) | st.floats(-1e6, -1e-6), st.sampled_from(["V/m", "count/turn", "mV/N"])
)
def test_a_gain_is_read_as_written(number: float, unit: str) -> None:
    assert parse_gain(f"{number!r} {unit}") == Gain(number, unit)
    assert parse_gain(f"{number!r}{unit}") == Gain(number, unit)
    assert parse_gain(number) == Gain(number, None)


@pytest.mark.parametrize("gain", ["80", '"80 V/m"', '"0.08 V/mm"'])
def test_a_sensor_in_volts_is_read_and_written_back(tmp_path: Path, gain: str) -> None:
    sensor = f'column = "y", unit = "V", gain = {gain}, offset = 2.5'
    spec = card(tmp_path, CARD.replace('column = "y", unit = "m"', sensor))
    raw = signals()
    write_csv(tmp_path / "a.csv", {**raw, "y": 80.0 * raw["y"] + 2.5})
    log = read_log(tmp_path / "a.csv", spec)
    np.testing.assert_allclose(log["y"], raw["y"], atol=1e-14)
    np.testing.assert_allclose(as_columns(log, spec)["y"], 80.0 * raw["y"] + 2.5, atol=1e-12)
