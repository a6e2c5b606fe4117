"""Cards and results made to break their reader, or of numbers that no machine has."""

import json
import re
from pathlib import Path

import pytest

from identification.errors import BadCard, BadModel
from tests.workbench.log_files import CARD
from workbench.cards.card import load_card
from workbench.documents.reading import read_document
from workbench.logs.sources import card_path

DEEP = "lie deeper in each other than in any card"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a = " + "[" * 20_000, DEEP),
        ("a = " + "{ a = " * 20_000, DEEP),
        ("\n" + ".".join(["a"] * 10_000) + " = 1", f"line 2: tables or lists {DEEP}"),
        ("[" + " . ".join(["'a'"] * 10_000) + "]", DEEP),
        ("a = { " + '"a".' * 10_000 + "a = 1 }", DEEP),
        ("a = " + "9" * 5000, "holds no card's number"),
        ("# a comment\n" * 100_000, "has 1.2 MB, a card at most 1 MB"),
        (
            CARD.replace('unit = "m"', 'unit = "m", offset = 1e300'),
            "'offset' = 1e[+]300 is a number",
        ),
        (CARD.replace('"force"', f'"force"\nstroke_m = [0, {"9" * 400}]'), "'stroke_m' = 9999"),
    ],
)
def test_cards_made_to_break_the_reader(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "card.toml").write_text(text, "utf-8")
    with pytest.raises(BadCard, match=said) as caught:
        load_card(tmp_path / "card.toml")
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize("key", ["k1", "m", "F_vp", "duration_s", "seed", "k_R", "noise_F"])
@pytest.mark.parametrize("value", ["1e300", "1e308", "-1e300"])
def test_recipes_of_numbers_that_no_machine_has(tmp_path: Path, key: str, value: str) -> None:
    text = card_path("paper_table2").read_text("utf-8")
    changed = re.sub(rf"\b{key} = [-\d.e]+", f"{key} = {value}", text, count=1)
    assert changed != text
    (tmp_path / "card.toml").write_text(changed, "utf-8")
    with pytest.raises(BadCard, match=f"'{key}' = .* is a number that no machine has"):
        load_card(tmp_path / "card.toml")


@pytest.mark.parametrize("key", ["k1", "m", "duration_s", "h_s", "dwell_s"])
def test_what_would_be_divided_by_has_to_be_more_than_nothing(tmp_path: Path, key: str) -> None:
    text = card_path("paper_table2").read_text("utf-8")
    changed = re.sub(rf"\b{key} = [-\d.e]+", f"{key} = 5e-324", text, count=1)
    (tmp_path / "card.toml").write_text(changed, "utf-8")
    with pytest.raises(BadCard, match=f"{key}] 5e-324: is nothing, 1e-30 or more needed"):
        load_card(tmp_path / "card.toml")


@pytest.mark.parametrize("number", ["1e300", "-1e31", "9" * 400, "9" * 5000, "1e999", "NaN"])
def test_results_of_numbers_that_no_machine_has(tmp_path: Path, number: str) -> None:
    (tmp_path / "a.json").write_text(f'{{"a": [{number}]}}', "utf-8")
    with pytest.raises(BadModel, match="holds") as caught:
        read_document(tmp_path / "a.json")
    assert len(str(caught.value)) < 600
    (tmp_path / "a.json").write_text(json.dumps({"a": [1e29, -3, 1e-300]}), "utf-8")
    assert read_document(tmp_path / "a.json") == {"a": [1e29, -3, 1e-300]}
