"""Text logs packed by gzip or in a zip archive."""

import gzip
import zipfile
from pathlib import Path

import numpy as np
import pytest

from identification.errors import BadLog
from tests.workbench.log_files import card, signals, write_csv, write_parquet
from workbench.logs import packed
from workbench.logs.runs import read_log
from workbench.logs.unknown import read_unknown


def archive(path: Path, *files: Path) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as into:
        for one in files:
            into.write(one, one.name)
    return path


@pytest.fixture
def plain(tmp_path: Path) -> Path:
    write_csv(tmp_path / "log.csv", signals())
    return tmp_path / "log.csv"


def test_a_packed_text_log_is_read_as_the_plain_one(plain: Path, tmp_path: Path) -> None:
    (tmp_path / "log.csv.gz").write_bytes(gzip.compress(plain.read_bytes()))
    for path in (tmp_path / "log.csv.gz", archive(tmp_path / "log.zip", plain)):
        log = read_log(path, card(tmp_path))
        np.testing.assert_array_equal(log["y"], signals()["y"])
        assert [one.header for one in read_unknown(path).columns] == ["t", "y", "F"]


def test_an_archive_of_two_files_names_them(plain: Path, tmp_path: Path) -> None:
    other = tmp_path / "b.csv"
    other.write_bytes(plain.read_bytes())
    path = archive(tmp_path / "two.zip", plain, other)
    for read in (read_unknown, lambda path: read_log(path, card(tmp_path))):
        with pytest.raises(BadLog, match=r"archive of 2 files \(log.csv, b.csv\).*unpack it"):
            read(path)


def test_what_is_packed_is_text_of_a_bounded_size(
    plain: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_parquet(tmp_path / "a.parquet", signals())
    path = archive(tmp_path / "a.parquet.zip", tmp_path / "a.parquet")
    with pytest.raises(BadLog, match=r"a parquet file, packed; .*unpack it"):
        read_unknown(path)
    whole = gzip.compress(plain.read_bytes())
    (tmp_path / "cut.csv.gz").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(BadLog, match="cannot be unpacked as gzip"):
        read_unknown(tmp_path / "cut.csv.gz")
    monkeypatch.setattr(packed, "TEXT_BYTES", 1000)
    with pytest.raises(BadLog, match=r"unpacks to more than 0\.001 MB"):
        read_unknown(archive(tmp_path / "long.zip", plain))


def test_a_workbook_by_another_name_is_reported(tmp_path: Path) -> None:
    (tmp_path / "[Content_Types].xml").write_text("<x/>", "utf-8")
    path = archive(tmp_path / "log.csv", tmp_path / "[Content_Types].xml")
    with pytest.raises(BadLog, match=r"an Excel workbook by its content; name it \.xlsx"):
        read_log(path, card(tmp_path))
