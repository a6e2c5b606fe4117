"""A claim kept alive while a worker is busy, and patience with a database that is away."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from typing import ParamSpec, TypeVar

from tenacity import Retrying, retry_if_exception_type, stop_after_delay, wait_random_exponential

from workbench.registry.database import Database
from workbench.registry.values import LostClaim, RegistryAway

P = ParamSpec("P")
T = TypeVar("T")
Clock = Callable[[], datetime]
SHARE = 3.0  # renewals in one lease
LONGEST_PAUSE = 5.0  # s between two tries


@dataclass(frozen=True)
class Patience:
    """Tries again for `seconds` what fails because the database is away; then raises it."""

    seconds: float = 60.0

    def __call__(self, call: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """What the call gives; raises RegistryAway once patience has ended."""
        again = Retrying(
            retry=retry_if_exception_type(RegistryAway),
            stop=stop_after_delay(self.seconds),
            wait=wait_random_exponential(multiplier=0.1, max=LONGEST_PAUSE),
            reraise=True,
        )
        return again(call, *args, **kwargs)


def shared_clock(database: Database, here: Clock) -> Clock:
    """The database's clock, which all its workers share, read once and carried on by `here`.

    Raises RegistryAway.
    """
    ahead = database.now(here()) - here()
    return lambda: here() + ahead


@contextmanager
def renewed(
    renew: Callable[[], None], every: float, lost: Callable[[threading.Event], None] | None = None
) -> Iterator[None]:
    """Renews a claim from a thread, every so many seconds, until the block ends.

    What goes wrong there is not raised here: a result is recorded only where the claim holds.
    lost: called in the thread where the claim is lost, with the event of the block's end.
    """
    over = threading.Event()

    def beat() -> None:
        while not over.wait(every):
            try:
                renew()
            except RegistryAway:
                continue  # the next renewal comes before the lease ends, or the claim is lost
            except LostClaim:
                if lost is not None:
                    lost(over)
                return

    thread = threading.Thread(target=beat, name="lease", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
