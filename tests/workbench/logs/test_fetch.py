"""Where cards and data are found, and what is said when they are not."""

import hashlib
from dataclasses import replace
from pathlib import Path

import pytest

from identification.errors import BadCard, BadLog
from workbench.cards.card import Card, load_card
from workbench.files import shipped_cards
from workbench.logs.sources import DATA_VARIABLE, card_path, find_data

BYTES = b"t,y,F\n0,0,0\n"


@pytest.fixture
def card(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Card:
    monkeypatch.delenv(DATA_VARIABLE, raising=False)
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "cards"
    folder.mkdir()
    names = "\n".join(
        f'{k} = {{ column = "{k}", unit = "{u}" }}' for k, u in zip("tyF", "smN", strict=True)
    )
    (folder / "card.toml").write_text(
        f"""
[card]
name = "set"
[rig]
kind = "force"
[signals]
{names}
[[files]]
name = "run1.csv"
url = "http://127.0.0.1:9/run1.csv"
sha256 = "{hashlib.sha256(BYTES).hexdigest()}"
[[files]]
name = "run2.csv"
""",
        encoding="utf-8",
    )
    return load_card(folder / "card.toml")


def test_a_given_path_wins(card: Card, tmp_path: Path) -> None:
    (tmp_path / "run1.csv").write_bytes(b"mine")
    assert find_data("run1.csv", card) == Path("run1.csv")


def test_the_folder_of_the_variable_comes_before_the_card_s(
    card: Card, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    beside = card.path.parent / "run1.csv"
    beside.write_bytes(BYTES)
    assert find_data("run1.csv", card) == beside
    data = tmp_path / "data" / "set" / "run1.csv"
    data.parent.mkdir(parents=True)
    data.write_bytes(BYTES)
    monkeypatch.setenv(DATA_VARIABLE, str(tmp_path / "data"))
    assert find_data("run1.csv", card) == data


def test_changed_bytes_are_refused(card: Card) -> None:
    (card.path.parent / "run1.csv").write_bytes(BYTES + b"!")
    with pytest.raises(BadLog, match=r"sha256 .* is not the card's"):
        find_data("run1.csv", card)


def test_unknown_names_and_missing_urls(card: Card) -> None:
    with pytest.raises(BadLog, match=r"did you mean 'run1.csv'"):
        find_data("run11.csv", card)
    with pytest.raises(BadLog, match="without a url"):
        find_data("run2.csv", card)


def test_a_missing_log_without_a_set_names_its_neighbours(card: Card, tmp_path: Path) -> None:
    bare = replace(card, files=())
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs" / "run7.csv").write_bytes(b"x")
    with pytest.raises(BadLog, match=r"logs/run77.csv: no such file; did you mean 'run7.csv'\?"):
        find_data("logs/run77.csv", bare)
    with pytest.raises(BadLog, match=r"no such file; there is no folder 'log' either"):
        find_data("log/run7.csv", bare)


def test_offline_says_what_to_do(
    card: Card, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    with pytest.raises(BadLog) as caught:
        find_data("run1.csv", card)
    assert "cannot be fetched" in str(caught.value)
    assert DATA_VARIABLE in str(caught.value)
    assert "\n" not in str(caught.value)


def test_cards_by_path_by_folder_and_by_name(card: Card, tmp_path: Path) -> None:
    assert card_path(card.path) == card.path
    assert card_path(card.path.parent) == card.path
    assert card_path("emps").parent.name == "emps"
    assert {"demo", "emps", "paper_table1"} <= set(shipped_cards())
    with pytest.raises(BadCard, match="did you mean 'emps'"):
        card_path("empss")
    with pytest.raises(BadCard, match=r"without a card.toml"):
        card_path(tmp_path)
