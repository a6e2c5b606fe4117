"""How far a long computation has come, reported to whoever asked, and whether it is to go on."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

Progress = Callable[[str, float], None]  # the stage and the share of it that is done
KeepGoing = Callable[[], bool]  # asked again and again; once False, a result is wanted at once

Result = TypeVar("Result")


def quiet(_stage: str, _share: float) -> None:
    """No progress is shown."""


def without_end() -> bool:
    """A computation that takes as long as it takes."""
    return True


class Halted(Exception):
    """A computation is to end: caught wherever there is a best so far, which then stands."""


class Halt:
    """Whether a computation is to go on, and what was left out where it was not.

    keep_going: asked before every simulated run and every trial; this is all that is known here of
    clocks and keys; a no holds for good. not_tried: what was left out then, in words.
    """

    def __init__(self, keep_going: KeepGoing = without_end) -> None:
        self._keep_going = keep_going
        self._closing = 0
        self._over = False
        self.not_tried: tuple[str, ...] = ()

    def ask(self) -> None:
        """Raises Halted where the computation is to end, except within `closing`."""
        wanted = self._keep_going()
        if self._closing == 0:
            self._over = self._over or not wanted
            if self._over:
                raise Halted

    def reached(self) -> bool:
        """Whether it has ended."""
        return self._over

    @contextmanager
    def closing(self) -> Iterator[None]:
        """Within the block nothing is halted: the few runs without which there is no result."""
        self._closing += 1
        try:
            yield
        finally:
            self._closing -= 1

    def tried(self, what: str, search: Callable[[], Result], otherwise: Result) -> Result:
        """What a search gives; where it is halted, `otherwise`, and `what` was not tried."""
        try:
            self.ask()
            return search()
        except Halted:
            self.left_out(what)
            return otherwise

    def asking(self, report: Progress) -> Progress:
        """The report, which asks first: of a search whose runs cannot be halted one by one."""

        def asked(stage: str, share: float) -> None:
            self.ask()
            report(stage, share)

        return asked

    def left_out(self, what: str) -> None:
        """Remember what was not tried."""
        if what not in self.not_tried:
            self.not_tried = (*self.not_tried, what)
