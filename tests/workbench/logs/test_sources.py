"""The runs that a command names."""

from pathlib import Path

import pytest

from identification.errors import BadLog
from identification.remarks import left_out
from tests.workbench.log_files import CARD, signals
from workbench.logs.sources import read_sources


def files(folder: Path, *names: str) -> list[str]:
    """Logs of these names below the folder, and the card beside them."""
    (folder / "card.toml").write_text(CARD, encoding="utf-8")
    for name in names:
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        rows = zip(*(signals()[key] for key in ("t", "y", "F")), strict=True)
        lines = [",".join(f"{x:.9g}" for x in row) for row in rows]
        path.write_text("t,y,F\n" + "\n".join(lines), encoding="utf-8")
    return [str(folder / name) for name in names]


def test_files_of_one_name_in_two_folders_are_distinguished(tmp_path: Path) -> None:
    names = files(tmp_path, "monday/run.csv", "friday/run.csv", "friday/other.csv")
    found = read_sources(names, str(tmp_path / "card.toml")).runs
    assert [run.log.name for run in found] == ["monday/run.csv", "friday/run.csv", "other.csv"]
    assert [run.file for run in found] == ["run.csv", "run.csv", "other.csv"]
    with pytest.raises(BadLog, match=r"run\.csv: given twice"):
        read_sources([names[0], names[0]], str(tmp_path / "card.toml"))


def test_a_short_log_of_several_is_left_out(tmp_path: Path) -> None:
    names = files(tmp_path, "long.csv", "short.csv", "holes.csv")
    for name, kept in (("short.csv", range(95)), ("holes.csv", [*range(60), *range(160, 220)])):
        lines = (tmp_path / name).read_text("utf-8").splitlines()
        (tmp_path / name).write_text("\n".join([lines[0], *(lines[1 + k] for k in kept)]), "utf-8")
    found = read_sources(names, str(tmp_path / "card.toml"))
    assert [run.log.name for run in found.runs] == ["long.csv"]
    assert found.remarks[:2] == (
        "short.csv: 95 samples, at least 100 needed: left out",
        "holes.csv: 1 gap leaves no run of 100 samples at 0.01 s: left out",
    )
    assert left_out(found.remarks) == list(found.remarks[:2])
    with pytest.raises(BadLog, match=r"1 gap leaves no run of 100 samples at 0\.01 s; log without"):
        read_sources(names[1:], str(tmp_path / "card.toml"))
    with pytest.raises(BadLog, match="95 samples, at least 100 needed; give a longer run"):
        read_sources(names[1:2], str(tmp_path / "card.toml"))
