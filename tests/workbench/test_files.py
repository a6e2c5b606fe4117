"""What is no file, or too large for one, is refused before it is opened."""

import os
import socket
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from identification.errors import UserError
from tests.workbench.log_files import WRITERS, card, signals
from workbench.cards.card import load_card
from workbench.cards.own_effects import load_effect
from workbench.documents.result_files import read_model
from workbench.logs import table, tables, text
from workbench.logs.runs import read_log
from workbench.logs.sources import card_path
from workbench.steps.drift import read_stream


def plug(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as here:
        here.bind(str(path))


THINGS: dict[str, Callable[[Path], None]] = {
    "a pipe": lambda path: os.mkfifo(path),
    "a device": lambda path: path.symlink_to("/dev/zero"),
    "a socket": plug,
}


@pytest.mark.parametrize("what", THINGS)
def test_what_never_ends_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    monkeypatch.chdir(tmp_path)
    path = Path("thing")
    THINGS[what](path)
    sound = card(tmp_path)
    readers: tuple[Callable[[], object], ...] = (
        lambda: read_log(path, sound),
        lambda: load_card(path),
        lambda: card_path(path),
        lambda: read_model(path),
        lambda: read_stream(path),
        lambda: load_effect(path),
    )
    for read in readers:
        with pytest.raises(UserError, match=f"thing: is {what}, not a file; write its data"):
            read()


def test_files_larger_than_any_of_their_kind_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"x")
    os.truncate(path, 10**12)
    for read in (load_card, read_model, read_stream):
        with pytest.raises(UserError, match=r"has 1e\+06 MB, a (card|result) at most"):
            read(path)
    sound = card(tmp_path)
    monkeypatch.setattr(text, "TEXT_BYTES", 1000)
    monkeypatch.setattr(tables, "JSON_BYTES", 1000)
    monkeypatch.setattr(tables, "BINARY_BYTES", 1000)
    for name in ("a.csv", "a.json", "a.mat"):
        WRITERS[name](tmp_path / name, signals())
        with pytest.raises(UserError, match=r"MB, a .* at most 0\.001 MB"):
            read_log(tmp_path / name, sound)


@pytest.mark.parametrize("name", ["a.parquet", "a.mat", "a73.mat", "a.h5"])
def test_more_rows_than_memory_bears_are_refused_before_they_are_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    WRITERS[name](tmp_path / name, signals())
    sound = card(tmp_path)
    assert len(read_log(tmp_path / name, sound)) == 400
    monkeypatch.setattr(table, "MOST_ROWS", 399)
    with pytest.raises(UserError, match="has 400 rows, at most 399 are read"):
        read_log(tmp_path / name, sound)


def test_of_a_small_file_of_endless_zeros_nothing_is_read(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name, values in signals().items():
            file[name] = values
        file.create_dataset("z", (10**13,), np.float64, chunks=(10**6,), compression="gzip")
    with pytest.raises(UserError, match="has 10000000000000 rows"):
        read_log(tmp_path / "a.h5", card(tmp_path))
