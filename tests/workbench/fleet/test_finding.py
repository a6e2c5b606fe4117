"""Logs of a fleet in folders, archives and other places that fsspec reads."""

import zipfile
from pathlib import Path

import fsspec
import pytest

from workbench.fleet.finding import card_text, find_logs, local_copy
from workbench.fleet.values import BadLogs


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Logs of four machines, laid out in every way, and files that are no logs."""
    root = tmp_path / "logs"
    for name in (
        "a/2.parquet", "a/1.parquet", "b/logs/1.parquet", "machine=c/1.parquet", "d.parquet",
        "a/notes.txt", ".hidden/1.parquet", "a/_part.parquet",
    ):  # fmt: skip
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(name.encode())
    return root


def test_every_layout_names_its_machine(folder: Path) -> None:
    found = find_logs(str(folder))
    assert [log.machine for log in found] == ["a", "a", "b", "c", "d"]
    assert {log.name for log in found} == {
        "a/1.parquet", "a/2.parquet", "b/logs/1.parquet", "machine=c/1.parquet", "d.parquet",
    }  # fmt: skip
    for log in found:
        path = folder / log.name
        assert (log.size, Path(log.path)) == (len(log.name), path)
        assert log.mtime_ns == pytest.approx(path.stat().st_mtime_ns, abs=1000)


def test_one_file_a_pattern_and_what_is_left_out(folder: Path) -> None:
    (one,) = find_logs(str(folder / "a" / "1.parquet"))
    assert (one.machine, one.name) == ("1", "1.parquet")
    assert {log.name for log in find_logs(f"{folder}/*/*.parquet")} == {
        "a/1.parquet", "a/2.parquet", "machine=c/1.parquet",
    }  # fmt: skip
    found = find_logs(str(folder), leave_out=folder / "a")
    assert [log.machine for log in found] == ["b", "c", "d"]


def test_logs_in_an_archive_and_in_memory(folder: Path, tmp_path: Path) -> None:
    memory = fsspec.filesystem("memory")
    with zipfile.ZipFile(tmp_path / "logs.zip", "w") as archive:
        archive.write(folder / "a" / "1.parquet", "a/1.parquet")
        archive.writestr("a/card.toml", "of a")
    memory.pipe("/fleet/a/1.parquet", b"a/1.parquet")
    memory.pipe("/fleet/a/card.toml", b"of a")
    try:
        for url in (f"zip://::{tmp_path}/logs.zip", "memory://fleet"):
            (log,) = find_logs(url)
            assert (log.machine, log.name, log.size) == ("a", "a/1.parquet", 11)
            assert log.mtime_ns > 0
            assert card_text(url, log) == "of a"
            with local_copy(url, log) as path:
                assert path.read_bytes() == b"a/1.parquet"
            assert not path.exists()
    finally:
        memory.rm("/fleet", recursive=True)


def test_the_nearest_card_counts(folder: Path) -> None:
    logs = {log.machine: log for log in find_logs(str(folder))}
    (folder.parent / "card.toml").write_text("outside", encoding="utf-8")
    assert card_text(str(folder), logs["b"]) is None
    (folder / "card.toml").write_text("for all", encoding="utf-8")
    (folder / "b" / "card.toml").write_text("of b", encoding="utf-8")
    assert card_text(str(folder), logs["b"]) == "of b"
    assert card_text(str(folder), logs["a"]) == card_text(str(folder), logs["d"]) == "for all"


@pytest.mark.parametrize(
    ("url", "line"),
    [
        ("{0}/none", "no logs"),
        ("{0}/logs/a/notes.txt", "no logs"),
        ("nonsense://x", "cannot be opened"),
        ("zip://::{0}/logs/a/notes.txt", "cannot be opened"),
    ],
)
def test_a_place_without_logs_is_refused(folder: Path, url: str, line: str) -> None:
    with pytest.raises(BadLogs, match=line) as caught:
        find_logs(url.format(folder.parent))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "url", ["ftp://me:geheim@127.0.0.1:9/x", "nonsense://me:geheim@h/x?token=geheim", "  "]
)
def test_what_is_secret_in_a_url_is_not_shown(url: str) -> None:
    with pytest.raises(BadLogs, match=r"cannot be opened|is empty") as caught:
        find_logs(url)
    assert "geheim" not in str(caught.value)


def test_a_log_that_has_gone_is_reported(folder: Path) -> None:
    memory = fsspec.filesystem("memory")
    memory.pipe("/gone/a/1.parquet", b"x")
    (log,) = find_logs("memory://gone")
    memory.rm("/gone", recursive=True)
    with pytest.raises(BadLogs, match="cannot be fetched"), local_copy("memory://gone", log):
        pass
