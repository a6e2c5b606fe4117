"""A long computation as whoever waits for it sees it: a bar that keeps moving, and a way to end it.

The numeric floors know neither clock nor keys: they report stages and ask whether to go on. Here is
where a budget of seconds and Ctrl-C become an answer.
"""

import math
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from types import FrameType

import click

from workbench.output import progress
from workbench.threads import one_thread

Clock = Callable[[], float]  # s
Stages = Mapping[str, tuple[float, float]]

BEAT = 1.0  # s between two readings of the clock, whatever the computation does
FIRST_GUESS = 30.0  # s, of a computation of which nothing is known yet
AT_LEAST = 0.3  # of what is left of the bar, for a stage that begins late
ALL_BUT = 0.99  # of the bar, that only the end itself fills
COMPILING = "compiling (once after an installation)"
ENDS_SOON = "Ctrl-C: ending with the best so far (once more aborts)"


@dataclass
class Course:
    """How far a computation has come, by its stages and by the clock, and whether it is to go on.

    advance: takes steps of the bar, which add up to 1; stages: the part of the bar of each; budget
    [s]: after which it is to end; describe: shows what goes on, in words; stopped: whether it was
    asked to end, before its budget. A stage begins where the last one has come to, if that is
    further on: some are left out, and others take their place.
    """

    advance: Callable[[float], None]
    stages: Stages
    clock: Clock
    budget: float = math.inf
    describe: Callable[[str], None] = lambda _words: None
    shown: float = 0.0
    stopped: bool = False
    _begun: float = field(init=False)
    _stage: str = field(init=False, default="")
    _low: float = field(init=False, default=0.0)
    _here: float = field(init=False, default=0.0)
    _from: float = field(init=False, default=0.0)
    _since: float = field(init=False)
    _compiled: float = field(init=False, default=0.0)
    _compiles: float | None = field(init=False, default=None)
    _moving: threading.Lock = field(init=False, default_factory=threading.Lock)

    def __post_init__(self) -> None:
        self._begun = self._since = self.clock()

    def report(self, stage: str, share: float) -> None:
        """A share of a stage is done; a stage that is not known counts as the last known one."""
        if stage in self.stages and stage != self._stage:
            self._stage, self._low = stage, max(self.stages[stage][0], self.shown)
            self.describe(stage)
        place = self._low + (self._high - self._low) * min(max(share, 0.0), 1.0)
        if place > self._here:
            self._here, self._since = place, self.clock()
            self._from = max(place, self.shown)
        self.beat()

    def keep_going(self) -> bool:
        """Whether the computation is to go on: within its budget, and not asked to end.

        What kernels take to be compiled, once after an installation, does not count.
        """
        return not self.stopped and self.clock() - self._begun - self._compiled < self.budget

    def beat(self) -> None:
        """Move the bar to where the computation should be by now."""
        with self._moving:
            place = min(self.expected(), ALL_BUT)
            if place > self.shown:
                self.advance(place - self.shown)
                self.shown = place

    def compiling(self, begins: bool) -> None:
        """Kernels are being compiled, or no longer: nothing else goes on meanwhile."""
        now = self.clock()
        if begins:
            self._compiles = now
        elif self._compiles is not None:
            self._compiled += now - self._compiles
            self._compiles = None
        self.describe(COMPILING if begins else self._stage)

    def done(self) -> None:
        """Fill the bar."""
        with self._moving:
            self.advance(1.0 - self.shown)
            self.shown = 1.0

    def expected(self) -> float:
        """Share of the whole that should be done by now.

        From the last place that was reported (or shown by then), at the pace so far, ever more
        slowly towards the end of the stage, which is not passed unseen; or the share of the budget,
        where that is more.
        """
        now = self.clock()
        passed = self._since - self._begun
        pace = self._here / passed if self._here > 0.0 and passed > 0.0 else 1.0 / FIRST_GUESS
        room = self._high - self._from
        due = (now - self._since) * pace
        more = room * due / (room + due) if room > 0.0 else 0.0
        return max(self._from + more, (now - self._begun) / self.budget)

    @property
    def _high(self) -> float:
        low, high = self.stages.get(self._stage, (0.0, 1.0))
        late = self._low + AT_LEAST * (1.0 - self._low)
        return max(high, late) if self._low > low else high


@contextmanager
def working(label: str) -> Iterator[None]:
    """Within the block a bar of that label, and one thread for linear algebra."""
    with one_thread(), progress(label):
        yield


@contextmanager
def running(label: str, stages: Stages, budget: float | None = None) -> Iterator[Course]:
    """The same of a course, whose bar moves by itself.

    budget [s]: after which it is to end; with one, also without end, the first Ctrl-C ends it with
    the best so far. A second one aborts, as does one where somebody else handles it.
    """
    with one_thread(), progress(label, 1.0) as bar:
        seconds = math.inf if budget is None else budget
        course = Course(bar, stages, time.monotonic, seconds, bar.describe)
        with moving(course), nullcontext() if budget is None else _first_ctrl_c(course):
            yield course


@contextmanager
def moving(course: Course) -> Iterator[None]:
    """Within the block the bar moves by itself, also while kernels compile; then it is full."""
    from identification.compiled import while_compiling

    over = threading.Event()

    def beats() -> None:
        said = False
        while not over.wait(BEAT):
            course.beat()
            if course.stopped and not said:  # a signal's handler is no place to write from
                said = True
                click.echo(ENDS_SOON, err=True)

    beating = threading.Thread(target=beats, daemon=True)
    beating.start()
    try:
        with while_compiling(course.compiling):
            yield
    finally:
        over.set()
        beating.join()
    course.done()


@contextmanager
def _first_ctrl_c(course: Course) -> Iterator[None]:
    usual = signal.getsignal(signal.SIGINT)
    mine = threading.current_thread() is threading.main_thread()
    if not mine or usual is not signal.default_int_handler:
        yield
        return

    def end(_number: int, _frame: FrameType | None) -> None:
        signal.signal(signal.SIGINT, usual)
        course.stopped = True

    signal.signal(signal.SIGINT, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, usual)
