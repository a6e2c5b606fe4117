"""A Dask cluster: processes of this computer, each on a core of its own, or any by its address."""

import logging
import math
import os
from collections.abc import Callable, Collection, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from design.machine.versions import versions
from workbench.addresses import shown
from workbench.fleet.finding import said
from workbench.fleet.values import NEEDED, BadCluster, Item, Result
from workbench.verdicts import counted

try:
    import dask
    from distributed import Client, KilledWorker, LocalCluster, Worker, WorkerPlugin, wait
    from distributed.comm.addressing import get_address_host_port, parse_address
    from distributed.comm.registry import get_backend
except ImportError:
    raise BadCluster(NEEDED) from None

ONE_THREAD = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "MKL", "OPENBLAS", "NUMBA", "NUMEXPR")}
GATHERED = 10.0  # s that a result may take from its worker to here
Work = Callable[[Item], Result]


@dataclass(frozen=True)
class Cluster:
    """Workers behind a Dask client.

    spare: logs handed over beyond one a thread, so that none waits for the next, a thread.
    """

    client: Any
    spare: float

    def threads(self) -> int:
        """Threads of all workers that are there now."""
        try:
            return sum(self.client.nthreads().values())
        except (OSError, TimeoutError, ValueError) as error:
            raise _gone(error) from error

    def limit(self) -> int:
        """Logs that may be in the cluster's hands at a time; 0 while it has no worker."""
        threads = self.threads()
        return threads + math.ceil(self.spare * threads)

    def submit(self, work: Work, item: Item) -> Any:
        """A future of the log's result."""
        return self.client.submit(work, item, pure=False)

    def wait(self, futures: Collection[Any], seconds: float) -> Sequence[Any]:
        """Those of the futures that have ended, after the first or this time [s]."""
        try:
            with self.client.as_current():
                ended = wait(futures, timeout=seconds, return_when="FIRST_COMPLETED").done
            return tuple(ended)
        except TimeoutError:
            return ()
        except Exception as error:  # the futures of a scheduler that is gone are cancelled
            raise _gone(error) from error

    def result(self, future: Any) -> Result | str | None:
        """What an ended future has led to; a line where its workers died or it cannot be read.

        None: the worker that held the result has died, and another makes it anew.
        """
        if future.status in ("lost", "pending"):
            return None
        try:
            found: Result = future.result(timeout=GATHERED)
        except CancelledError as error:
            raise _gone(error) from error
        except KilledWorker as error:
            died = counted(error.allowed_failures + 1, "worker")
            return f"{died} died of it, one after the other; it is not tried again"
        except TimeoutError:
            return None
        except Exception as error:  # of the cluster: `work` itself raises none
            return f"the worker gave no result ({type(error).__name__}: {said(error)})"
        return found


@contextmanager
def local_cluster(workers: int, attempts: int) -> Iterator[Cluster]:
    """Processes of this computer, a core each; a log may cost `attempts` of them.

    Raises BadCluster where they do not start.
    """
    environment = dask.config.get("distributed.nanny.pre-spawn-environ", {})
    settings = {
        # One log a worker at a time: a log that waits is not blamed for the death of a worker.
        "distributed.scheduler.worker-saturation": 1.0,
        "distributed.scheduler.allowed-failures": attempts - 1,
        # A worker that dies twice within Dask's 15 s would be closed for good while its log runs.
        "distributed.deploy.lost-worker-timeout": "365 days",
        "distributed.nanny.pre-spawn-environ": {**environment, **ONE_THREAD},
    }
    with dask.config.set(settings):
        try:
            made = LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                dashboard_address="127.0.0.1:0",  # a free port: many may run here
                silence_logs=logging.CRITICAL,
            )
        except (OSError, RuntimeError, TimeoutError) as error:
            raise BadCluster(f"local workers do not start ({said(error)})") from error
        with made, Client(made, set_as_default=False) as client:
            client.register_plugin(OneCore(cores()))
            yield Cluster(client, 1.0)


@contextmanager
def cluster_at(address: str, timeout: float) -> Iterator[Cluster]:
    """The cluster whose scheduler has this address, as tcp://host:8786.

    timeout: how long [s] it, and its first worker, may take to answer. Raises BadCluster also
    where its workers do not have this version of the workbench.
    """
    _check_address(address)
    try:
        client = Client(address, timeout=timeout, set_as_default=False)
    except Exception as error:  # addresses of many kinds, each with errors of its own
        raise BadCluster(
            f"--cluster {address}: not reached ({said(error)}); start one with 'dask scheduler' and"
            f" 'dask worker', or leave --cluster out"
        ) from error
    with client:
        try:
            client.wait_for_workers(1, timeout=timeout)
        except TimeoutError:
            raise BadCluster(
                f"--cluster {address}: has no workers after {timeout:g} s; start one with 'dask"
                f" worker {address}'"
            ) from None
        _check_workers(client, address)
        yield Cluster(client, 0.1)


def _check_address(address: str) -> None:
    """Raises BadCluster where it is none; a client of Dask's would leave a traceback behind."""
    try:
        get_backend(parse_address(address)[0])
        host, port = get_address_host_port(address)
        sound = bool(host.encode("idna")) and 0 < port < 65536 and "@" not in host
    except ValueError:
        sound = False
    if not sound:
        raise BadCluster(
            f"--cluster {shown(address)}: no address of a scheduler; one as tcp://host:8786 needed"
        )


def _check_workers(client: Any, address: str) -> None:
    """Raises BadCluster where a worker lacks this version of the workbench."""
    try:
        found = client.run(versions)
    except Exception as error:
        raise BadCluster(
            f"--cluster {address}: its workers cannot run the workbench ({said(error)}); install"
            " servo-workbench there"
        ) from error
    ours = versions()["servo-workbench"]
    for worker, theirs in found.items():
        if theirs["servo-workbench"] != ours:
            raise BadCluster(
                f"--cluster {address}: worker {worker} has servo-workbench"
                f" {theirs['servo-workbench']}, {ours} here; install the same version there"
            )


def _gone(error: BaseException) -> BadCluster:
    return BadCluster(
        f"the cluster is gone ({said(error)}); results so far are kept, run again to go on"
    )


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
