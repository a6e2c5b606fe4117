"""The command's own unit, and the present controller under `[controller]`."""

from pathlib import Path

import numpy as np
import pytest

from design.machine.controller import present
from identification.errors import BadCard
from workbench.cards.card import Card, load_card, present_of_card

MOTOR = """
[card]
name = "stage"
[rig]
kind = "motor"
{rig}
[signals]
t = {{ column = "t", unit = "s" }}
y = {{ column = "y", unit = "mm" }}
u = {{ column = "u", unit = "{unit}" }}
{rest}
"""
PD = """
[controller]
kind = "PD"
k_d = "0.25 A/mm"
T_d = "36 ms"
eps = 2e-3
"""
AMPS = 'force_per_command = "45 N/A"\ncontrol_limit = "10 A"'


def card(folder: Path, rig: str = AMPS, unit: str = "A", rest: str = "") -> Card:
    path = folder / "card.toml"
    path.write_text(MOTOR.format(rig=rig, unit=unit, rest=rest), encoding="utf-8")
    return load_card(path)


@pytest.mark.parametrize(
    ("unit", "rig", "motion", "unit_kept"),
    [
        ("A", "force_per_command = 45", "linear", "A"),
        ("mA", "force_per_command = 45", "linear", "A"),
        ("%", "force_per_command = 45", "linear", "1"),
        ("%", 'command_unit = "%"\nforce_per_command = "4.5 N/%"', "linear", "%"),
        ("N", "force_per_command = 1", "linear", "N"),
        ("N m", 'force_per_command = 1\nmotion = "rotary"', "rotary", "N m"),
        ("V", "force_per_command = 1", "linear", "V"),
    ],
)
def test_a_command_is_held_in_its_own_unit(
    tmp_path: Path, unit: str, rig: str, motion: str, unit_kept: str
) -> None:
    if motion == "rotary":
        text = MOTOR.replace('"mm"', '"rad"')
        path = tmp_path / "card.toml"
        path.write_text(text.format(rig=rig, unit=unit, rest=""), encoding="utf-8")
        found = load_card(path)
    else:
        found = card(tmp_path, rig, unit)
    assert found.rig().command_unit == unit_kept
    factor, shift = found.signals["u"].scale("u", found.rig())
    assert shift == 0.0
    expected = {"mA": 1e-3, "%": 1e-2 if unit_kept == "1" else 1.0}
    assert factor == pytest.approx(expected.get(unit, 1.0))


def test_numbers_with_a_unit_are_brought_to_the_command_s(tmp_path: Path) -> None:
    found = card(tmp_path, 'force_per_command = "0.045 kN/A"\ncontrol_limit = "8000 mA"').rig()
    assert found.force_per_command == pytest.approx(45.0)
    assert found.control_limit == pytest.approx(8.0)
    inertia = card(tmp_path, 'force_per_command = 1\nmotor_inertia = "300 g"').rig().motor_inertia
    assert inertia == pytest.approx(0.3)
    turning = 'motion = "rotary"\nforce_per_command = 1\nmotor_inertia = "0.3 kg cm^2"'
    rotary = MOTOR.format(rig=turning, unit="A", rest="").replace('"mm"', '"rad"')
    (tmp_path / "rotary.toml").write_text(rotary, encoding="utf-8")
    assert load_card(tmp_path / "rotary.toml").rig().motor_inertia == pytest.approx(3e-5)
    older = card(tmp_path, "force_per_command = 45.0\ncontrol_limit_v = 8.0").rig()
    assert (older.force_per_command, older.control_limit) == (45.0, 8.0)


@pytest.mark.parametrize(
    ("rig", "said"),
    [
        ('force_per_command = "45 N/V"', "rig.force_per_command: unit 'N/V' is of another kind"),
        ('control_limit = "ten"', "rig.control_limit = 'ten': a number"),
        ('control_limit = "-3 A"', "rig.control_limit = -3, must be > 0"),
        ('motor_inertia = "3 kg m^2"', "rig.motor_inertia: unit 'kg m^2' is of another kind"),
        ('motor_inertia = "0 kg"', "rig.motor_inertia = 0, must be > 0"),
        ('control_limit = "3 A"\ncontrol_limit_v = 3.0', "are the same; give one"),
    ],
)
def test_what_does_not_fit_is_refused_in_one_line(tmp_path: Path, rig: str, said: str) -> None:
    with pytest.raises(BadCard) as caught:
        card(tmp_path, rig)
    assert said in str(caught.value) and "\n" not in str(caught.value)


def test_a_rig_without_supply_pressure_has_no_third_term(tmp_path: Path) -> None:
    path = tmp_path / "card.toml"
    path.write_text(
        '[card]\nname = "c"\n[rig]\nkind = "electro-pneumatic"\narea_p_m2 = 1e-3\n'
        'area_n_m2 = 8e-4\n[signals]\nt = { column = 0, unit = "s" }\n'
        'y = { column = 1, unit = "m" }\np_p = { column = 2, unit = "bar" }\n'
        'p_n = { column = 3, unit = "bar" }\n',
        encoding="utf-8",
    )
    assert load_card(path).rig().supply_pressure is None


def test_a_pd_is_the_law_of_its_gains(tmp_path: Path) -> None:
    read = card(tmp_path, rest=PD)
    assert read.controller is not None
    found = present(read.controller, read.rig(), 5e-4)
    assert found.kind == "PD" and found.law.h == 5e-4 and found.output == "command"
    assert found.gains["k_d"].value == pytest.approx(250.0)
    assert found.gains["k_d"].unit == "A/m"
    assert found.law.R[0] == pytest.approx(250.0 * (1 + 36 / 2))  # A for each m, at once
    assert sum(found.law.R) / sum(found.law.S) == pytest.approx(250.0)  # and at rest
    assert found.law.W == found.law.S
    assert present_of_card(read, read.rig(), 5e-4) == found


def test_a_force_of_a_motor_is_its_command_times_k_a(tmp_path: Path) -> None:
    newtons = PD.replace('"0.25 A/mm"', '"11.25 N/mm"') + 'output = "force"\n'
    laws = []
    for text in (PD, newtons):
        read = card(tmp_path, rest=text)
        assert read.controller is not None
        laws.append(present(read.controller, read.rig(), 5e-4).law)
    assert np.allclose(laws[0].R, laws[1].R)


def test_its_own_period_comes_before_that_of_the_log(tmp_path: Path) -> None:
    read = card(tmp_path, rest=PD + "period_s = 2.5e-4\n")
    assert read.controller is not None
    assert present(read.controller, read.rig(), 5e-4).law.h == 2.5e-4


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (('"0.25 A/mm"', '"0.25 V/mm"'), "controller.k_d: unit 'V/mm' is of another kind"),
        (("eps = 2e-3", "esp = 2e-3"), "unknown key 'esp'; did you mean 'eps'"),
        (("eps = 2e-3", "eps = 0.0"), "eps"),
        (("eps = 2e-3", 'eps = 2e-3\nforce = { k_i = "1 A/N", T_i = 1.0 }'), "a motor has none"),
    ],
)
def test_a_controller_that_is_none_is_refused(
    tmp_path: Path, change: tuple[str, str], said: str
) -> None:
    with pytest.raises(BadCard) as caught:
        card(tmp_path, rest=PD.replace(*change))
    assert said in str(caught.value) and "\n" not in str(caught.value)


def test_an_integral_forgets_in_its_own_time_by_default(tmp_path: Path) -> None:
    text = '[controller]\nkind = "P-PI"\nk_v = "40 1/s"\nk_p = "20 A s/m"\nT_i = "10 ms"\n'
    for more, pole in (("", np.exp(-5e-4 / 0.01)), ("anti_windup_s = 0.1\n", np.exp(-5e-4 / 0.1))):
        read = card(tmp_path, rest=text + more)
        assert read.controller is not None
        law = present(read.controller, read.rig(), 5e-4).law
        assert -law.W[1] == pytest.approx(pole)
    read = card(tmp_path, rest=text + 'anti_windup_s = "none"\n')
    assert read.controller is not None
    law = present(read.controller, read.rig(), 5e-4).law
    assert law.W == law.S
