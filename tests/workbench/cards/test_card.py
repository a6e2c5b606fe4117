"""Cards: what they say is what is read, and every mistake is one line that names its place."""

from pathlib import Path

import pytest

from identification.errors import BadCard
from identification.log import Rig
from workbench.cards.card import load_card

CONTRACT = """
[card]
name = "bench-a"
source = "here"

[rig]
kind = "electro-pneumatic"
area_p_m2 = 12.6e-4
area_n_m2 = 10.0e-4
supply_pressure_pa = 5.0e5
control_limit_v = 5.0
stroke_m = [-0.15, 0.15]

[signals]
t   = { column = "time_s", unit = "s" }
r   = { column = "reference_m", unit = "m" }
y   = { column = "position_m", unit = "m" }
p_p = { column = "pressure_p_pa", unit = "Pa" }
p_n = { column = "pressure_n_pa", unit = "Pa" }
u   = { column = "control_v", unit = "V" }
"""


def write(folder: Path, text: str) -> Path:
    path = folder / "card.toml"
    path.write_text(text, encoding="utf-8")
    return path


def refusal(folder: Path, text: str) -> str:
    with pytest.raises(BadCard) as caught:
        load_card(write(folder, text))
    message = str(caught.value)
    assert "\n" not in message
    assert "card.toml" in message
    return message


def test_the_contract_s_card_is_read(tmp_path: Path) -> None:
    card = load_card(write(tmp_path, CONTRACT))
    assert card.name == "bench-a"
    assert card.rig() == Rig(
        kind="electro-pneumatic",
        area_p=12.6e-4,
        area_n=10.0e-4,
        supply_pressure=5.0e5,
        control_limit=5.0,
        stroke=(-0.15, 0.15),
    )
    assert card.signals["p_p"].column == "pressure_p_pa"
    assert card.recipe is None


def test_a_file_overrides_the_rig(tmp_path: Path) -> None:
    entry = '[[files]]\nname = "b.csv"\nrig = { area_n_m2 = 1e-4 }\n'
    card = load_card(write(tmp_path, CONTRACT + entry))
    assert card.rig("b.csv").area_n == 1e-4
    assert card.rig("other.csv").area_n == 10e-4
    assert card.rig("b.csv").area_p == 12.6e-4


@pytest.mark.parametrize(
    ("old", "new", "found", "nearest"),
    [
        ("area_p_m2", "area_p_m", "[rig] unknown key 'area_p_m'", "did you mean 'area_p_m2'?"),
        ("stroke_m", "strok_m", "[rig] unknown key 'strok_m'", "did you mean 'stroke_m'?"),
        ('"time_s", unit', '"time_s", unti', "[signals.t] unknown key 'unti'", "'unit'?"),
        ("[signals]", "[signal]", "unknown key 'signal'", "did you mean 'signals'?"),
        ('source = "here"', 'licens = "x"', "[card] unknown key 'licens'", "'licence'?"),
        ("p_p = {", "P_p = {", "needs signals.p_p", "did you mean 'P_p'?"),
        ("p_n = {", "x = {", "needs signals.p_n", 'add p_n = { column = "<its name in the log>"'),
    ],
)
def test_unknown_key_names_the_nearest(
    tmp_path: Path, old: str, new: str, found: str, nearest: str
) -> None:
    message = refusal(tmp_path, CONTRACT.replace(old, new, 1))
    assert found in message
    assert nearest in message


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        ('kind = "electro-pneumatic"', 'kind = "hydraulic"', "[rig.kind] 'hydraulic'"),
        ('kind = "electro-pneumatic"\n', "", "[rig] has no 'kind'"),
        ("area_n_m2 = 10.0e-4\n", "", "needs 'area_n_m2'"),
        ("area_n_m2 = 10.0e-4", "area_n_m2 = -1", "[rig.area_n_m2] -1: "),
        ("area_n_m2 = 10.0e-4", "area_n_m2 = nan", "[rig.area_n_m2] nan: "),
        ("[-0.15, 0.15]", "[0.15, -0.15]", "stroke_m must be [low, high]"),
        ('column = "time_s", ', "", "[signals.t] has no 'column'"),
        ('unit = "V"', 'unit = "V", gain = 0', "gain must not be 0"),
        ('unit = "V"', 'unit = "V", signed = true', "needs bits"),
        (
            'name = "bench-a"',
            'name = "a/../b"',
            "[card.name] 'a/../b': letters, digits, '_',",
        ),
        ('name = "bench-a"', 'name = ""', "[card.name] '': letters, digits, '_', '.' and"),
        (
            "[-0.15, 0.15]",
            '[-0.15, 0.15]\nforce_per_command = "0 N/V"',
            "rig.force_per_command = 0 N/V: a command without a force drives nothing",
        ),
        ('unit = "V"', 'unit = "V", gain = true', "[signals.u] gain needs a value, not true"),
        ('unit = "V"', 'unit = "V", gain = [2]', "[signals.u.gain] [2]: a number, or a text with"),
        ('unit = "V"', 'unit = "V", gain = "0 V/V"', "gain must not be 0"),
        ('unit = "V"', 'unit = "V", gain = ""', "gain is empty"),
        ('unit = "V"', "unit = 3", "[signals.u.unit] 3: a text in quotes needed"),
        ('column = "control_v"', 'column = ["a"]', "[signals.u.column] ['a']: the column's name"),
        ('{ column = "control_v", unit = "V" }', '"v"', "a table { column = ..., unit = ... }"),
        ("[-0.15, 0.15]", "[-0.15]", "[rig.stroke_m] has too few values"),
        ("[-0.15, 0.15]", "0.15", "[rig.stroke_m] 0.15: a list [...] needed"),
        ("12.6e-4", '"large"', "[rig.area_p_m2] 'large': a number needed"),
        ('[card]\nname = "bench-a"\nsource = "here"\n', "", "has no table [card]"),
        ('"position_m", unit', '"time_s", unit', "signals.t and signals.y are both read from"),
        ("[card]", "[card", "is not TOML"),
    ],
)
def test_wrong_values_name_their_key(tmp_path: Path, old: str, new: str, found: str) -> None:
    assert found in refusal(tmp_path, CONTRACT.replace(old, new, 1))


def test_a_force_of_another_command_names_the_commands_unit(tmp_path: Path) -> None:
    text = CONTRACT.replace("supply_pressure_pa = 5.0e5", 'force_per_command = "30 N/A"')
    said = "unit 'N/A' is of another kind than 'N/V': by signals.u the command is in 'V'"
    assert said in refusal(tmp_path, text)


@pytest.mark.parametrize(
    ("motion", "other", "unit"), [("rotary", "linear", "N/A"), ("linear", "rotary", "Nm/A")]
)
def test_a_force_of_the_other_motion_names_it(
    tmp_path: Path, motion: str, other: str, unit: str
) -> None:
    text = f"""[card]
name = "a"
[rig]
kind = "motor"
motion = "{motion}"
force_per_command = "3 {unit}"
[signals]
t = {{ column = "t", unit = "s" }}
y = {{ column = "y", unit = "count", gain = 100 }}
u = {{ column = "i", unit = "A" }}
"""
    said = f'which motion = "{motion}" needs; write motion = "{other}" in [rig]'
    assert said in refusal(tmp_path, text)
    load_card(write(tmp_path, text.replace(f'"{motion}"', f'"{other}"')))


def test_split_names_known_files_once(tmp_path: Path) -> None:
    files = CONTRACT + '[[files]]\nname = "run1.csv"\n[split]\n'
    assert "'run1.csv'?" in refusal(tmp_path, files + 'train = ["run2.csv"]')
    both = 'train = ["run1.csv"]\ntest = ["run1.csv"]'
    assert "in train and in test" in refusal(tmp_path, files + both)


def test_cards_that_are_no_text_file(tmp_path: Path) -> None:
    with pytest.raises(BadCard, match="no such card"):
        load_card(tmp_path / "none.toml")
    with pytest.raises(BadCard, match="is a directory"):
        load_card(tmp_path)
    (tmp_path / "x.toml").write_bytes(b"\xff\x00\x81")
    with pytest.raises(BadCard, match="not UTF-8"):
        load_card(tmp_path / "x.toml")


def test_what_else_was_measured_stands_beside_the_signals_or_in_a_table(tmp_path: Path) -> None:
    alpha = '\n[signals.extra]\nalpha = { column = "alpha", unit = "rad" }\n'
    card = load_card(write(tmp_path, CONTRACT + alpha))
    assert card.signals["alpha"].column == "alpha"
    assert "extra" not in card.signals
    twice = '\n[signals.extra]\nu = { column = "other", unit = "V" }\n'
    assert "u is in [signals] and in [signals.extra]" in refusal(tmp_path, CONTRACT + twice)
