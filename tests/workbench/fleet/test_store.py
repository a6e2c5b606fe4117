"""Parts of Parquet, the journal of what is in none, and what a kill leaves."""

from pathlib import Path

import pyarrow.parquet as pq
import pytest

from tests.workbench.fleet.values import NOW, log_of, result_of
from workbench.fleet.store import JOURNAL_FILE, PART_AGE, RESULTS_FOLDER, ResultStore
from workbench.output import BadOutput

LOGS = [log_of(name) for name in "abcd"]


def rows(folder: Path) -> list[str]:
    """Machines of all rows."""
    parts = sorted((folder / RESULTS_FOLDER).glob("*.parquet"))
    return [name for part in parts for name in pq.read_table(part)["machine"].to_pylist()]


def test_parts_are_read_while_the_run_goes_on(tmp_path: Path) -> None:
    with ResultStore(tmp_path) as store:
        for log in LOGS[:2]:
            store.note(result_of(log, m=3.0))
            store.add(result_of(log, m=3.0), now=NOW)
        store.tick(now=NOW + 0.9 * PART_AGE)
        assert rows(tmp_path) == []
        store.tick(now=NOW + PART_AGE)
        assert rows(tmp_path) == ["a", "b"]
        store.add(result_of(LOGS[2]), now=NOW)
        store.flush()
        table = pq.read_table(tmp_path / RESULTS_FOLDER)
        assert table["m"].to_pylist() == [3.0, 3.0, 1.0]
        assert table["m_sd"].to_pylist() == [0.1] * 3
        assert table["F_cp"].null_count == 3
        assert (tmp_path / JOURNAL_FILE).stat().st_size == 0
    with ResultStore(tmp_path) as store:
        assert store.done == {log.key for log in LOGS[:3]}


def test_what_was_noted_outlives_a_kill(tmp_path: Path) -> None:
    with ResultStore(tmp_path) as store:
        store.note(result_of(LOGS[0]))
        store.add(result_of(LOGS[0]), now=NOW)
        store.flush()
        for log in LOGS[1:3]:
            store.note(result_of(log))
    with (tmp_path / JOURNAL_FILE).open("a", encoding="utf-8") as file:
        file.write('{"log": {"machine": "d", "na')  # the line that was being written
    (tmp_path / RESULTS_FOLDER / ".part-000002.parquet.tmp").write_bytes(b"half")
    with ResultStore(tmp_path) as store:
        assert store.journalled() == tuple(result_of(log) for log in LOGS[1:3])
        assert store.journalled() == tuple(result_of(log) for log in LOGS[1:3])
    assert rows(tmp_path) == ["a"]
    assert not list((tmp_path / RESULTS_FOLDER).glob(".*"))


def test_a_journal_whose_part_was_written_is_not_counted_twice(tmp_path: Path) -> None:
    with ResultStore(tmp_path) as store:
        store.note(result_of(LOGS[0]))
        kept = (tmp_path / JOURNAL_FILE).read_bytes()
        store.add(result_of(LOGS[0]), now=NOW)
        store.flush()
    (tmp_path / JOURNAL_FILE).write_bytes(kept)
    with ResultStore(tmp_path) as store:
        assert store.journalled() == ()


def test_one_process_at_a_time(tmp_path: Path) -> None:
    with ResultStore(tmp_path), pytest.raises(BadOutput, match="another run"):
        ResultStore(tmp_path).__enter__()
    with ResultStore(tmp_path):
        pass


def test_a_folder_that_is_none_and_a_part_that_is_none(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(BadOutput, match="is a file"):
        ResultStore(tmp_path / "file").__enter__()
    (tmp_path / "x" / RESULTS_FOLDER).mkdir(parents=True)
    (tmp_path / "x" / RESULTS_FOLDER / "part-000001.parquet").write_bytes(b"text")
    with pytest.raises(BadOutput, match="no part of a fleet's results"):
        ResultStore(tmp_path / "x").__enter__()
