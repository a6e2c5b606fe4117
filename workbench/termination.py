"""A process that is asked to end clears up what it has begun, as on Ctrl-C."""

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

ENDING = tuple(one for one in signal.Signals if one.name in ("SIGTERM", "SIGHUP"))
RAISED_AGAIN_AFTER = 0.1  # s


class Terminated(KeyboardInterrupt):
    """The process was asked to end, which it does as on Ctrl-C: what is half written is cleared."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self.number = number


@contextmanager
def raised_on_a_signal() -> Iterator[None]:
    """Within the block, SIGTERM and SIGHUP raise Terminated, where nobody else handles them.

    Python drops an exception that is raised within a finalizer, and compiled code may do so too:
    a timer raises it again until the block ends, but not while it is handled.
    """
    mine = threading.current_thread() is threading.main_thread()
    taken = [one for one in ENDING if mine and signal.getsignal(one) is signal.SIG_DFL]
    asked: list[int] = []

    def end(number: int, _frame: FrameType | None) -> None:
        if not asked and hasattr(signal, "setitimer"):
            signal.signal(signal.SIGALRM, end)
            signal.setitimer(signal.ITIMER_REAL, RAISED_AGAIN_AFTER, RAISED_AGAIN_AFTER)
        asked.append(number)
        if not _handled(sys.exception()):
            raise Terminated(asked[0])

    for one in taken:
        signal.signal(one, end)
    try:
        yield
    finally:
        if asked and hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, signal.SIG_DFL)
        for one in taken:
            signal.signal(one, signal.SIG_DFL)


def _handled(error: BaseException | None) -> bool:
    """Whether the error, or one of those in whose handling it was raised, is a Terminated."""
    while error is not None and not isinstance(error, Terminated):
        error = error.__context__
    return error is not None
