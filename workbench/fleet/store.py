"""Results as Parquet parts, each written whole, and a journal of those that are in no part yet.

DIR/results/part-<number>.parquet are read as one table while the run goes on. A result is first a
line of DIR/.journal.jsonl; where a run is killed, the next one takes it from there.
"""

import fcntl
import json
import os
from collections.abc import Mapping
from dataclasses import asdict
from datetime import datetime, timedelta
from pathlib import Path
from typing import IO, Any, Self

import pyarrow as pa
import pyarrow.parquet as pq
from pydantic import TypeAdapter, ValidationError

from identification.model.karnopp import NAMES
from workbench.fleet.values import Result
from workbench.output import BadOutput, strict

RESULTS_FOLDER, JOURNAL_FILE, LOCK_FILE = "results", ".journal.jsonl", ".lock"
PART_ROWS = 500  # of a part
PART_AGE = timedelta(seconds=10)  # a result that waits for its part for longer makes one
STORED_PARAMETERS = (*NAMES, "k1", "k2", "k_a")
FIT = ("chi_square", "adequate", "force_rms")
PART_SCHEMA = pa.schema(
    [
        *((name, pa.string()) for name in ("machine", "log", "sha256")),
        *((name, pa.int64()) for name in ("size", "mtime_ns")),
        *((name, pa.string()) for name in ("verdict", "reason")),
        ("against_version", pa.int64()),
        *((name + end, pa.float64()) for name in STORED_PARAMETERS for end in ("", "_sd")),
        ("chi_square", pa.float64()),
        ("adequate", pa.bool_()),
        *((name, pa.float64()) for name in ("force_rms", "duration", "seconds")),
        ("worker_memory", pa.int64()),
        *((name, pa.string()) for name in ("versions", "model")),
        ("at", pa.timestamp("us", tz="UTC")),
    ]
)


class ResultStore:
    """The results of a fleet in one folder, for one process at a time.

    Raises BadOutput where the folder cannot be used, or another process writes there.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._parts = folder / RESULTS_FOLDER
        self._rows: list[dict[str, Any]] = []
        self._oldest: datetime | None = None
        self._noted: dict[tuple[str, int, int], str] = {}  # lines of results that are no rows yet
        self.done: set[tuple[str, int, int]] = set()

    def __enter__(self) -> Self:
        if self.folder.exists() and not self.folder.is_dir():
            raise BadOutput(f"--out {self.folder} is a file; name a folder, new or existing")
        self._parts.mkdir(parents=True, exist_ok=True)
        self._lock: IO[str] = (self.folder / LOCK_FILE).open("w")
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._lock.close()
            raise BadOutput(
                f"--out {self.folder}: another run writes there; wait for it, or name another"
            ) from None
        try:
            for path in self._parts.glob(".*.tmp"):
                path.unlink()
            self.done = {
                key for path in sorted(self._parts.glob("*.parquet")) for key in _keys(path)
            }
            self._journal: IO[str] = (self.folder / JOURNAL_FILE).open("a+", encoding="utf-8")
        except BaseException:
            self._lock.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._journal.close()
        self._lock.close()

    def journalled(self) -> tuple[Result, ...]:
        """Results that an earlier run has noted and not brought into a part."""
        self._journal.seek(0)
        adapter = TypeAdapter(Result)
        found = []
        for line in self._journal:
            try:
                result = adapter.validate_json(line)
            except ValidationError:
                continue  # the line that was being written as the run was killed
            if result.log.key not in self.done:
                self._noted[result.log.key] = line
                found.append(result)
        return tuple(found)

    def note(self, result: Result) -> None:
        """Keep the result against a kill; it lasts once this returns."""
        line = json.dumps(strict(asdict(result)), allow_nan=False) + "\n"
        self._noted[result.log.key] = line
        self._journal.write(line)
        self._journal.flush()
        os.fsync(self._journal.fileno())

    def add(self, result: Result, *, now: datetime) -> None:
        """The result as a row of the next part."""
        self._rows.append(row_of(result, now))
        self._noted.pop(result.log.key, None)
        self.done.add(result.log.key)
        self._oldest = self._oldest or now

    def tick(self, *, now: datetime) -> None:
        """Write a part where enough rows wait, or one of them for long."""
        if self._oldest and (len(self._rows) >= PART_ROWS or now - self._oldest >= PART_AGE):
            self.flush()

    def flush(self) -> None:
        """Write the rows that wait as a part; the journal keeps what is no row yet."""
        if self._rows:
            last = max((int(p.stem[5:]) for p in self._parts.glob("part-*.parquet")), default=0)
            buffer = pa.BufferOutputStream()
            pq.write_table(pa.Table.from_pylist(self._rows, PART_SCHEMA), buffer)
            _write_whole(self._parts / f"part-{last + 1:06d}.parquet", buffer.getvalue())
            self._rows, self._oldest = [], None
        self._journal.close()
        journal = self.folder / JOURNAL_FILE
        _write_whole(journal, "".join(self._noted.values()).encode())
        self._journal = journal.open("a+", encoding="utf-8")


def row_of(result: Result, now: datetime) -> dict[str, Any]:
    """The row of a result, by the columns of `PART_SCHEMA`."""
    log, model = result.log, result.model or {}
    runs = model.get("log") or ()
    numbers = {**model.get("friction", {}), **(model.get("actuator") or {})}
    row: dict[str, Any] = {
        "machine": log.machine, "log": log.name, "sha256": result.sha256, "size": log.size,
        "mtime_ns": log.mtime_ns, "verdict": result.verdict, "reason": result.reason,
        "against_version": result.against, "seconds": result.seconds,
        "worker_memory": result.memory, "versions": json.dumps(dict(result.versions)),
        "duration": sum(run["duration"] for run in runs) if runs else None,
        "model": json.dumps(strict(model), allow_nan=False) if model else None, "at": now,
        **{key: (model.get("fit") or {}).get(key) for key in FIT},
    }  # fmt: skip
    for name in STORED_PARAMETERS:
        found: Mapping[str, Any] = numbers.get(name) or {}
        row[name], row[f"{name}_sd"] = found.get("value"), found.get("sd")
    return row


def _keys(path: Path) -> list[tuple[str, int, int]]:
    """The logs of a part by their key."""
    try:
        table = pq.read_table(path, columns=["log", "size", "mtime_ns"])
    except (pa.ArrowException, OSError, KeyError) as error:
        text = " ".join(str(error).split())[:120]
        raise BadOutput(f"{path}: is no part of a fleet's results ({text}); move it away") from None
    return [(row["log"], row["size"], row["mtime_ns"]) for row in table.to_pylist()]


def _write_whole(path: Path, content: Any) -> None:
    """The bytes under the file's name once all of them are on the disk."""
    part = path.with_name(f".{path.name}.tmp")
    with part.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    part.replace(path)
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)
