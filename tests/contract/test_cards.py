"""Every shipped card is sound, and every file of its set reads to plausible values."""

from pathlib import Path

import numpy as np
import pytest

from design.simulated.record import record
from identification.signals.differentiate import differentiate
from workbench.cards.card import Card, load_card
from workbench.files import shipped_cards
from workbench.logs.runs import read_runs
from workbench.logs.sources import DATA_VARIABLE, card_path, find_data

CARDS = {name: load_card(path) for name, path in shipped_cards().items()}
DATA = [name for name, card in CARDS.items() if card.files]
RECIPES = [name for name, card in CARDS.items() if card.recipe]
FILES = [(name, entry.name) for name in DATA for entry in CARDS[name].files]

# Largest |y|, |F| that the machine can reach, from its description.
PLAUSIBLE = {
    "emps": (0.3, 400.0),
    "friction_backlash": (0.05, 3e4),
    "pneumatic_seals": (0.045, 25.0),
    "xl330_servo": (1.6, None),
}


@pytest.mark.parametrize("name", list(CARDS))
def test_card_bears_its_folder_s_name(name: str) -> None:
    assert CARDS[name].name == name
    assert CARDS[name].about.source


@pytest.mark.parametrize("name", DATA)
def test_data_card_says_source_licence_and_bytes(name: str) -> None:
    card = CARDS[name]
    assert card.about.licence
    assert card.about.citation
    assert all(entry.url and entry.sha256 for entry in card.files)
    assert len({entry.sha256 for entry in card.files}) == len(card.files)
    split = {file for group in card.split.values() for file in group}
    assert split == {entry.name for entry in card.files}
    for group, files in card.split.items():
        assert len(set(files)) == len(files)
        other = group.replace("train_for", "test_at")  # a seal is held out at either pressure
        assert other == group or not set(files) & set(card.split[other])
    assert card.split["train"]
    assert card.split["test"]


@pytest.mark.parametrize("name", RECIPES)
def test_recipe_card_reads_its_own_log(name: str) -> None:
    card = CARDS[name]
    assert card.recipe is not None
    assert {"t", "r", "y", "F", "u"} <= set(card.signals)
    assert all(spec.gain == 1.0 for spec in card.signals.values())
    assert len(card.recipe.t) == (30001 if name == "demo" else 40001)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "file"), FILES)
def test_file_reads_to_plausible_values(
    name: str, file: str, workbench_data: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not (workbench_data / name / file).exists():
        pytest.skip(f"{workbench_data} has no {name}/{file}")
    monkeypatch.setenv(DATA_VARIABLE, str(workbench_data))
    card: Card = CARDS[name]
    prepared = read_runs(find_data(file, card), card)
    y_max, F_max = PLAUSIBLE[name]
    assert sum(len(run) for run in prepared.runs) >= 1000
    for run in prepared.runs:
        h = np.diff(run["t"])
        assert np.ptp(h) < 2e-3 * run.h
        assert np.max(np.abs(run["y"])) < y_max
        if F_max is not None:
            assert np.max(np.abs(run["F"])) < F_max
        if "temperature" in run:
            assert 299.0 < run["temperature"].min() < run["temperature"].max() + 1 < 315.0
            assert np.max(np.abs(run["u"])) <= 1.0


def test_demo_has_an_effect_and_speeds_that_show_it() -> None:
    recipe = CARDS["demo"].recipe
    assert recipe is not None
    (stribeck,) = recipe.plant.effects
    assert stribeck.values == {"F_s": 3.5, "v_s": 0.05, "asymmetry": 0.0, "delta": 2.0}
    p = recipe.plant.friction
    assert stribeck.values["v_s"] > 4 * max(p.dv_p, -p.dv_n)
    v = np.abs(differentiate(record("demo", recipe)["y"], recipe.h).v)
    assert 0.25 < np.quantile(v, 0.99) < 0.4
    assert np.mean((v > p.dv_p) & (v < 0.1)) > 0.25
    assert 0.1 < np.mean(v < p.dv_p) < 0.4


def test_cards_are_found_without_any_data() -> None:
    assert card_path("paper_table3").is_file()
