"""A log and the file that it is of, as a result names it; and the logs of one machine."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from design.machine.drive import Present
from identification.errors import BadLog
from identification.log import Log, Rig
from identification.signals.bad_samples import BadSamples


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


def no_controller(_h: float) -> Present | None:
    """Of a machine whose present controller is not known."""
    return None


@dataclass(frozen=True)
class MachineLogs:
    """The runs of one machine: the name of its card, its rig, the runs, what was repaired, what
    excluded; kept: files that are kept for tests; present: the law of the controller that the
    machine has now, at a period [s], None where it is not known."""

    card: str
    rig: Rig
    runs: tuple[Source, ...]
    remarks: tuple[str, ...] = ()
    bad: tuple[BadSamples, ...] = ()
    kept: tuple[str, ...] = ()
    present: Callable[[float], Present | None] = field(default=no_controller, compare=False)

    @property
    def logs(self) -> list[Log]:
        """The log of each run."""
        return [source.log for source in self.runs]


def refuse_twins(train: Sequence[Source], test: Sequence[Source]) -> None:
    """Raises BadLog where a test file has the bytes of a training file."""
    names = {source.sha256: source.file for source in train}
    for source in test:
        if source.sha256 in names:
            raise BadLog(
                f"--test {source.file}: the same bytes as the training log"
                f" {names[source.sha256]}; test on a log that the fit has not used"
            )
