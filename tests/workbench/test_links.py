"""Links that lead nowhere, or in a circle, are reported as such wherever a file is named."""

from collections.abc import Callable
from pathlib import Path

import pytest

from identification.errors import UserError
from tests.workbench.log_files import CARD, card, signals, write_csv
from workbench.cards.own_effects import library
from workbench.documents.reading import read_document
from workbench.files import broken_link
from workbench.logs.sources import card_path, find_data, read_sources
from workbench.logs.tables import read_table
from workbench.registry.store import Registry

MISSING = "is a link to 'gone', which is missing"
CIRCLE = "its links lead in a circle"


def read_log(path: Path) -> object:
    """By the command's way: the card, then the log."""
    card(path.parents[1], CARD)
    return read_sources([str(path)], str(path.parents[1] / "card.toml"))


READERS: list[Callable[[Path], object]] = [
    read_log,
    lambda path: find_data(str(path), card(path.parents[1], CARD)),
    lambda path: read_table(path, card(path.parents[1], CARD).file),
    lambda path: card_path(str(path)),
    read_document,
    lambda path: library([path.parent]),
    lambda path: Registry(str(path), create=False),
]


@pytest.mark.parametrize("read", READERS)
@pytest.mark.parametrize(("target", "said"), [("gone", MISSING), ("link.py", CIRCLE)])
def test_a_link_is_reported_as_such(
    tmp_path: Path, read: Callable[[Path], object], target: str, said: str
) -> None:
    link = tmp_path / "in" / "link.py"
    link.parent.mkdir()
    link.symlink_to(target)
    with pytest.raises(UserError, match=said) as caught:
        read(link)
    assert "did you mean" not in str(caught.value) and "\n" not in str(caught.value)


def test_sound_links_and_missing_files_are_none(tmp_path: Path) -> None:
    write_csv(tmp_path / "a.csv", signals())
    (tmp_path / "b.csv").symlink_to("a.csv")
    assert broken_link(tmp_path / "b.csv") is None
    assert broken_link(tmp_path / "c.csv") is None
