"""What an identification gives: estimates with intervals, and the reason where there is none."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from identification.arrays import Array
from identification.effects._base import Acting
from identification.model.karnopp import Karnopp
from identification.model.plant import Actuator, Motor
from identification.model.surroundings import NO_SURROUNDINGS, Surroundings

Drive = Literal["command", "force"]
NORMAL_95 = 1.96  # deviations to either side that hold 95 % of a normal spread


@dataclass(frozen=True)
class Estimate:
    """One parameter: value, unit, standard deviation, 95 % interval [low, high].

    `value` is None where the log does not identify it: `reason` then says why, and `assumed` is
    the value that simulations use in its place. at_most: where all that the log identifies is that
    the parameter is small, the size that it leaves to it. A value without an interval is no
    estimate but given, as `reason` says.
    """

    value: float | None
    unit: str
    sd: float | None = None
    low: float | None = None
    high: float | None = None
    reason: str | None = None
    assumed: float | None = None
    at_most: float | None = None

    def withheld(self, reason: str, assumed: float) -> "Estimate":
        """The same parameter without a value, and why."""
        return Estimate(None, self.unit, reason=reason, assumed=assumed)

    @property
    def known(self) -> bool:
        """Whether it is identified: its value, or that it is too small to matter."""
        return self.value is not None or self.at_most is not None


@dataclass(frozen=True)
class LogFit:
    """How the fitted model follows one log, free run over the whole of it or in `windows`.

    start: first position [m], velocity [m/s] and force [N] of the free run; position_rms [m] and,
    where the run is driven by the command, force_rms [N]; chi_square per compared value.
    """

    log: str
    start: tuple[float, float, float]
    position_rms: float
    force_rms: float | None
    chi_square: float


@dataclass(frozen=True)
class KarnoppFit:
    """The nine parameters and the actuator, identified from one or more logs.

    friction: all nine, those that the logs do not identify at the value assumed for simulation.
    effects: that the plant has beside them. estimates: the nine ("k1", "k2" where the command is
    logged, effects' parameters as key.name) by name.
    free: names in the order of `covariance` (d, d), of their errors.
    noise_y [m], noise_F [N]: of the sensors, one sigma.
    chi_square: mean squared residual over noise; near 1 the model leaves nothing but noise.
    adequate: whether the search found such a fit. remarks: one line each on what was noticed.
    whole: whether its run follows the logs as long as a run by the command may be, and not from one
    window of 2 s to the next.
    command_period: time [s] after which the drive gives its next command, None where no log shows
    that it is sooner than the next sample. surroundings: what acts beside the applied force, which
    was taken out of the logs; what of it is an effect is among `effects` and `estimates` too.
    left: share and root mean square [N] of the force that the equation of motion leaves, where it
    was fitted alone; falling: slopes below 0 [N s/m] with which friction falls with speed there, as
    F_vp and F_vn, and its levels at rest beside them [N], as F_cp and F_cn, which predict a motion
    and are not simulated.
    """

    friction: Karnopp
    actuator: Actuator | Motor | None
    estimates: Mapping[str, Estimate]
    free: tuple[str, ...]
    covariance: Array
    drive: Drive
    noise_y: float
    noise_F: float
    chi_square: float
    adequate: bool
    logs: tuple[LogFit, ...]
    breakaways: tuple[int, int]
    remarks: tuple[str, ...]
    effects: tuple[Acting, ...] = ()
    command_period: float | None = None
    surroundings: Surroundings = NO_SURROUNDINGS
    left: tuple[float, float] | None = None
    whole: bool = False
    falling: Mapping[str, Estimate] = field(default_factory=dict)

    @property
    def prescribed(self) -> bool:
        """Whether no run was followed, only the force equation of a prescribed motion."""
        return all(np.isnan(one.position_rms) for one in self.logs)
