"""What a worker makes of a log: a first model, a judgement, or one line on why not."""

from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime
from io import BytesIO
from pathlib import Path

import fsspec
import numpy as np
import pandas as pd
import pytest

from design.simulated.record import record
from tests.chain import TABLES
from tests.workbench.fleet.values import card_text
from workbench.cards.card import load_card
from workbench.fleet.finding import find_logs
from workbench.fleet.values import Item, Result
from workbench.fleet.work import work
from workbench.registry.values import Version
from workbench.steps.simulate import as_columns

URL = "memory://bench"
VERSION = Version("a", 3, "m", None, None, datetime(2026, 3, 1, tzinfo=UTC))


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Logs in memory: two good runs, one without motion, with noise alone, without y, cut off."""
    folder = tmp_path_factory.mktemp("work")
    (folder / "card.toml").write_text(card_text(), encoding="utf-8")
    card = load_card(folder / "card.toml")
    assert card.recipe is not None
    memory = fsspec.filesystem("memory")
    tables = {}
    for name, seed in (("good", 1), ("again", 2)):
        tables[name] = pd.DataFrame(as_columns(record("x", card.recipe, seed, card.rig()), card))
    tables["still"] = tables["good"].assign(y=0.0)
    noise = 1e-5 * np.random.default_rng(0).standard_normal(len(tables["good"]))
    tables["shaking"] = tables["good"].assign(y=noise)
    tables["lacking"] = tables["good"].drop(columns="y")
    for name, table in tables.items():
        buffer = BytesIO()
        table.to_parquet(buffer)
        memory.pipe(f"/bench/{name}.parquet", buffer.getvalue())
    memory.pipe("/bench/cut.parquet", memory.cat_file("/bench/good.parquet")[:5000])
    yield folder
    memory.rm("/bench", recursive=True)


def done(name: str, card: str | None = None, active: Result | None = None) -> Result:
    """The result of the log of that name."""
    (log,) = (one for one in find_logs(URL) if one.machine == name)
    item = Item(URL, log, card or card_text(), 0)
    if active is not None:
        item = replace(item, version=VERSION, model=active.model)
    return work(item)


@pytest.mark.slow
def test_a_first_model_and_a_judgement_against_it(place: Path) -> None:
    first = done("good")
    assert (first.verdict, first.against) == ("identified", None)
    assert first.model is not None and first.made is not None
    assert first.made.model == first.model
    for name in ("m", "F_cp", "F_sn"):
        value = first.model["friction"][name]["value"]
        assert value == pytest.approx(getattr(TABLES["paper_table1"], name), rel=2e-2)
    assert len(first.sha256) == 64 and first.seconds > 0 and first.memory > 1e7
    assert first.versions["numpy"]
    judged = done("again", active=first)
    assert (judged.verdict, judged.against) == ("none", 3)
    assert judged.sha256 != first.sha256


@pytest.mark.parametrize(
    ("name", "verdict", "line"),
    [
        ("still", "set_aside", "still.parquet"),
        ("shaking", "not_judged", "shaking.parquet"),
        ("lacking", "set_aside", "no column 'y'"),
        ("cut", "set_aside", "damaged or cut off"),
    ],
)
def test_a_bad_log_has_its_reason(place: Path, name: str, verdict: str, line: str) -> None:
    found = done(name)
    assert found.verdict == verdict
    assert line in found.reason and f"{name}.parquet" in found.reason
    assert "\n" not in found.reason and "/tmp" not in found.reason
    assert found.model is None and len(found.sha256) == 64


def test_a_bad_card_leaves_the_log_waiting(place: Path) -> None:
    found = done("good", card="[card")
    assert found.verdict == "waits"
    assert found.reason.startswith("good.parquet: card.toml: is not TOML")


def test_a_log_that_has_gone_is_excluded(place: Path) -> None:
    (log,) = (one for one in find_logs(URL) if one.machine == "good")
    found = work(Item(URL, replace(log, path="/bench/none.parquet"), card_text(), 0))
    assert (found.verdict, found.sha256) == ("set_aside", "")
    assert "cannot be fetched" in found.reason
