"""What the drift test says of one log: its verdict, what moved, and the statistics."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from scipy.stats import norm

from identification.drift.mewma import DriftState

DriftVerdict = Literal["none", "drift", "structure", "not_judged"]
FoundBy = Literal["log", "mean"]
Z_95 = float(norm.isf(0.025))


@dataclass(frozen=True)
class Shift:
    """A parameter before (active model) and after (this log, or the mean of the last logs).

    low, high: 95 % interval of `after`. change: relative to the model's value, with its standard
    deviation, in which the model's error, the log's and the machine's variation from log to log
    are. p_value: chance of such a change, to either side, without one.
    """

    name: str
    unit: str
    before: float
    before_sd: float
    after: float
    after_sd: float
    low: float
    high: float
    change: float
    sd: float
    p_value: float

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval of the change."""
        return self.change - Z_95 * self.sd, self.change + Z_95 * self.sd


@dataclass(frozen=True)
class Statistic:
    """A test's value and threshold; p_value: chance of as much without drift, at most."""

    value: float
    threshold: float
    p_value: float
    parameters: int

    @property
    def alarm(self) -> bool:
        """Whether the value lies above the threshold."""
        return self.value > self.threshold


@dataclass(frozen=True)
class DriftTest:
    """The verdict on one log.

    verdict: "none", "drift", "structure" (no parameters of the model's structure follow the log),
    "not_judged" (`reason` says why: nothing is identifiable, or the minimum detectable
    change of the Coulomb levels is too large). state: to be given with the next log. chi_square:
    what the log's own refit leaves; allowed: up to which the structure fits. moved: of the fewest
    parameters that explain a drift, those that surely have a part in it; unsure: names of the
    others, and of those that explain it as well. shifts: every tested parameter on this log;
    inconclusive: the others, with the reason; could_have_seen: minimum detectable relative change
    of each tested one on this log or, if it lasts, by the mean.
    single, alone, mean: the statistic of all parameters of this log, of the largest one, and of the
    mean over logs, None where nothing is tested; found_by: which of them alarmed ("log": the first
    two).
    """

    verdict: DriftVerdict
    state: DriftState
    reason: str = ""
    chi_square: float | None = None
    allowed: float | None = None
    moved: tuple[Shift, ...] = ()
    unsure: tuple[str, ...] = ()
    shifts: Mapping[str, Shift] = field(default_factory=dict)
    inconclusive: Mapping[str, str] = field(default_factory=dict)
    could_have_seen: Mapping[str, float] = field(default_factory=dict)
    single: Statistic | None = None
    alone: Statistic | None = None
    mean: Statistic | None = None
    found_by: FoundBy | None = None

    @property
    def tested(self) -> bool:
        """Whether the log was tested at all, whatever it could have shown."""
        return self.single is not None
