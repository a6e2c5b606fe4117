"""What goes to a worker and what comes back."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from design.judgement import Candidate, Judgement
from design.judgement import LogVerdict as Judged
from identification.errors import UserError
from workbench.registry.values import Version

FleetVerdict = Literal[
    "identified", "inadequate",  # without an active model
    "none", "structure", "promoted", "refused",  # tested against the active one
    "not_judged", "set_aside", "failed",
    "waits",  # not recorded: the machine has to be looked after, and the next run tries again
]  # fmt: skip
# As the registry has them where it has another word.
JUDGED: Mapping[FleetVerdict, Judged] = {
    "identified": "promoted", "inadequate": "refused", "failed": "set_aside", "waits": "set_aside",
}  # fmt: skip
GOOD: tuple[FleetVerdict, ...] = ("identified", "none")
NEEDED = "workbench fleet needs Dask, which is not installed; install 'servo-workbench[fleet]'"


class BadLogs(UserError):
    """A place that holds no logs, or cannot be read."""


class BadCluster(UserError):
    """A Dask cluster that cannot be reached or used."""


@dataclass(frozen=True)
class LogFile:
    """One machine's log as the listing has it; path within the file system of its URL.

    name: path below the folder that was listed; mtime_ns 0 where the file system does not say.
    """

    machine: str
    name: str
    path: str
    size: int
    mtime_ns: int

    @property
    def key(self) -> tuple[str, int, int]:
        """What distinguishes a log that is done from one that is not, without reading it."""
        return self.name, self.size, self.mtime_ns


@dataclass(frozen=True)
class Item:
    """One log for a worker: where it is, its card as text, and the active version on its machine.

    url: of the folder that was listed; document and evidence as `workbench.jobs.passes.Task` has.
    """

    url: str
    log: LogFile
    card: str
    seed: int
    version: Version | None = None
    model: Mapping[str, Any] | None = None
    design: Mapping[str, Any] | None = None
    previous: Mapping[str, Any] | None = None


@dataclass(frozen=True)
class Result:
    """What a log has led to; everything in it is plain JSON, so that it can be kept before it is
    recorded.

    sha256: of the log's bytes, empty where they were not read. model: model.json of this log.
    made: model, design, validation that the registry gets; rival: those that are refused, and
    why. seconds: of the processor, all threads of the worker; memory: the worker's largest
    resident size so far [bytes].
    """

    log: LogFile
    verdict: FleetVerdict
    reason: str
    sha256: str = ""
    model: Mapping[str, Any] | None = None
    made: Candidate | None = None
    rival: tuple[Candidate, str] | None = None
    evidence: Mapping[str, Any] = field(default_factory=dict)
    against: int | None = None
    seconds: float = 0.0
    memory: int = 0
    versions: Mapping[str, str] = field(default_factory=dict)

    def judgement(self) -> Judgement:
        """The result as the registry takes it."""
        verdict: Any = JUDGED.get(self.verdict, self.verdict)
        return Judgement(verdict, self.reason, self.made, self.evidence, self.rival)
