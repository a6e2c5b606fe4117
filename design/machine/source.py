"""A log and the file that it is of, as a result names it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from identification.log import Log


@dataclass(frozen=True)
class Source:
    """One run of a file: its log on an even clock, the file's name, hash and rows.

    period: of the samples in the file [s]; None where it is that of the log.
    """

    log: Log
    file: str
    sha256: str
    rows: int
    period: float | None = None


def fingerprints(sources: Sequence[Source]) -> list[dict[str, Any]]:
    """Name, digest and rows of each file, as a result names the logs that it is of."""
    found = {s.sha256: {"file": s.file, "sha256": s.sha256, "rows": s.rows} for s in sources}
    return list(found.values())
