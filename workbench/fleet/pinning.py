"""A core a worker: identification runs a few threads of its own, which would share all cores."""

import os
from collections.abc import Sequence
from dataclasses import dataclass

from distributed import Worker, WorkerPlugin


@dataclass(frozen=True)
class OneCore(WorkerPlugin):
    """Keeps a worker's tasks, and the threads that they start, on one of the cores.

    name: by which a cluster knows the plugin. Without such a setting of the system, no effect.
    """

    cores: Sequence[int]
    name: str = "one-core"

    def setup(self, worker: Worker) -> None:
        """Called in the thread that starts those of the tasks, which inherit the setting."""
        if hasattr(os, "sched_setaffinity"):
            number = int(worker.name) if str(worker.name).isdigit() else 0
            os.sched_setaffinity(0, {self.cores[number % len(self.cores)]})


def cores() -> tuple[int, ...]:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return tuple(sorted(os.sched_getaffinity(0)))
    return tuple(range(os.cpu_count() or 1))
