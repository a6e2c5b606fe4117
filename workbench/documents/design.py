"""The design of one machine: controllers, margins, compensator.

Here values are plain SI numbers; in design.json (workbench/documents/design_file.py) every
parameter has its unit.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from design.cascade import CascadeGains
from design.compensator import Compensator
from design.drive_law import DriveLaw, drive_law
from design.feed_forward import FeedForward
from design.filters import CompensatorFilters
from design.loop_frequencies import LoopFrequencies
from design.margins import Margins
from design.pid import PIDGains
from design.rst import RST
from design.schedule import Over, Schedule
from design.series_filters import SeriesFilter
from identification.errors import BadModel
from identification.model.estimates import Estimate
from identification.model.karnopp import NAMES, Karnopp
from workbench.cards.units import Motion
from workbench.documents.drive import Command, ForceLoop, Output, Present
from workbench.documents.model import used

From = Literal["physical", "arx"]
Structure = Literal["rst", "pid", "p-pi"]
DESIGNED_STRUCTURES: tuple[Structure, ...] = ("rst", "pid", "p-pi")
Recommended = Literal["rst", "pid", "p-pi", "none"]
LEAST_SPAN = 1e-3  # m/s, from which a direction counts in full where no feed-forward says


@dataclass(frozen=True)
class Linear:
    """The sampled plant a design rests on, force reference [N] to position [m], and why this one.

    m [kg], F_v [N s/m] are None for an ARX plant. resonance: that of two masses, as a model has it.
    """

    source: From
    why: str
    A: tuple[float, ...]
    B: tuple[float, ...]
    h: float
    m: Estimate | None
    F_v: Estimate | None
    resonance: Mapping[str, Estimate] | None = None


@dataclass(frozen=True)
class MarginValues:
    """Margins of a loop as results carry them; worst_modulus over the parameters' intervals.

    None: no limit of that kind; worst_modulus None: unstable for some parameters inside them.
    crossover_hz, bandwidth_hz: as `design.loop_frequencies` has them, None also in older files.
    """

    modulus: float
    gain_up: float | None
    gain_down: float | None
    phase_deg: float | None
    delay_s: float | None
    delay_samples: float | None
    S_yp_max_db: float
    S_up_max_db: float | None
    worst_modulus: float | None
    crossover_hz: float | None = None
    bandwidth_hz: float | None = None

    @property
    def gain_db(self) -> float | None:
        """By how much the gain may grow [dB]; None: by any."""
        return None if self.gain_up is None else 20.0 * math.log10(self.gain_up)


@dataclass(frozen=True)
class Controller:
    """S F_ref = T r - R y, polynomials in z^-1, run every h [s].

    dominant: (w_n [rad/s], zeta); auxiliary: poles z as (re, im). rate: the reference is moved at
    most at this speed [m/s], None for any; lag [s] and overshoot [-] as `design.tracking` has
    them. missed: goals not kept. gains: of a PID in parallel form. W: its anti-windup as
    `design.drive_law` has it, None in older files. Of a P-PI cascade: its gains, the notch or
    low-pass that R, S and T hold too, what is fed forward beside it, and the acceleration [m/s^2]
    with which the reference is moved at most.
    """

    R: tuple[float, ...]
    S: tuple[float, ...]
    T: tuple[float, ...]
    h: float
    dominant: tuple[float, float]
    auxiliary: tuple[tuple[float, float], ...]
    margins: MarginValues
    rate: float | None
    lag: float
    overshoot: float
    missed: tuple[str, ...]
    gains: PIDGains | None = None
    note: str | None = None
    W: tuple[float, ...] | None = None
    cascade: CascadeGains | None = None
    series: SeriesFilter | None = None
    feed_forward: FeedForward | None = None
    acceleration: float | None = None

    @property
    def rst(self) -> RST:
        """The controller for the loop."""
        return RST(np.array(self.R), np.array(self.S), np.array(self.T), self.h)

    def law(self, command: Command) -> DriveLaw:
        """The controller in the drive's own terms.

        Without a W, as in older files: above a force loop an integrator forgets in 1/w_n what was
        not carried out, else the whole controller forgets it at once.
        """
        per = command.force_per_command
        forget = 1.0 / self.dominant[0] if per is None else 0.0
        return drive_law(self.rst, forget, 1.0 if per is None else per, self.W)


@dataclass(frozen=True)
class CompensatorValues:
    """Parameters of the compensator (4): N_c [-], e_T [m], the nine as the model has them.

    filters: around it, and their period [s]; None in older files. excess: see `Compensator`.
    """

    N_c: float
    e_T: float
    friction: Mapping[str, Estimate]
    filters: CompensatorFilters | None = None
    h: float | None = None
    excess: bool = False

    def __post_init__(self) -> None:
        for name in NAMES:
            if name not in self.friction:
                raise BadModel(f"[compensator.friction] has no {name!r}; all nine are needed")
        _ = self.value

    @property
    def assumed(self) -> tuple[str, ...]:
        """Names of the nine that no log identifies."""
        return tuple(name for name in NAMES if self.friction[name].value is None)

    @property
    def value(self) -> Compensator:
        """The compensator for the loop."""
        friction = Karnopp(**{name: used(self.friction[name]) for name in NAMES})
        return Compensator(friction, self.N_c, self.e_T, excess=self.excess)


@dataclass(frozen=True)
class Recommendation:
    """Which controller, with or without the compensator, and why, in one line with numbers.

    keep_present: whether the controller that the machine has now is as good, and may stay.
    """

    controller: Recommended
    compensator: bool
    why: str
    keep_present: bool = False


@dataclass(frozen=True)
class ScheduledController:
    """A controller at each point of a schedule; recommended: whether it clearly wins over the fixed
    one, and why, in one line with numbers."""

    points: tuple[Controller, ...]
    recommended: bool
    why: str


@dataclass(frozen=True)
class GainSchedule:
    """Controllers over the place [m], the load [N] or the direction: at (k,), and the friction
    there, F_cp, F_cn [N], F_vp, F_vn [N s/m], (k, 4), that a P-PI feeds forward."""

    over: Over
    at: tuple[float, ...]
    friction: tuple[tuple[float, float, float, float], ...]
    controllers: Mapping[Structure, ScheduledController]

    def of(self, name: Structure, fixed: Controller, command: Command) -> Schedule:
        """The schedule of a controller as its drive runs it; fixed: the one without."""
        laws = tuple(one.law(command) for one in self.controllers[name].points)
        forget = fixed.cascade.T_n if fixed.cascade else 1.0 / fixed.dominant[0]
        ahead = fixed.feed_forward
        span = ahead.band if ahead else LEAST_SPAN
        return Schedule(self.over, self.at, laws, self.friction, forget, span)


@dataclass(frozen=True)
class Design:
    """Controllers of one machine; one may be None with its reason in `refused`.

    recommended: the controller that keeps every goal, "none" where none does. command: what the
    drive takes, present: the controller that it has now, recommendation: the same with its reason;
    None in older files. read: what to say of its file, a line for each value in another unit than
    ours. schedule: the controllers over place, load or direction, where that was asked for.
    """

    card: str
    motion: Motion
    plant: Linear
    force: ForceLoop | None
    rst: Controller | None
    pid: Controller | None
    refused: Mapping[str, str]
    recommended: Recommended
    compensator: CompensatorValues
    remarks: tuple[str, ...]
    versions: Mapping[str, str]
    command: Command | None = None
    present: Present | None = None
    recommendation: Recommendation | None = None
    read: tuple[str, ...] = field(default=(), compare=False)
    p_pi: Controller | None = None
    schedule: GainSchedule | None = None

    @property
    def controllers(self) -> dict[str, Controller]:
        """The controllers that exist, by name."""
        every = (self.rst, self.pid, self.p_pi)
        return {k: c for k, c in zip(DESIGNED_STRUCTURES, every, strict=True) if c is not None}

    @property
    def output(self) -> Output:
        """What its laws give: the command, or the reference of the force loop."""
        return "command" if self.force is None else "force"


def margin_values(
    found: Margins, worst: float | None, at: LoopFrequencies | None = None
) -> MarginValues:
    """The margins as results carry them."""
    return MarginValues(
        modulus=found.modulus,
        gain_up=found.gain_up,
        gain_down=found.gain_down,
        phase_deg=found.phase_deg,
        delay_s=found.delay_s,
        delay_samples=None if found.delay_s is None else found.delay_s / found.h,
        S_yp_max_db=found.S_yp_max_db,
        S_up_max_db=found.S_up_max_db,
        worst_modulus=worst,
        crossover_hz=at.crossover if at else None,
        bandwidth_hz=at.bandwidth if at else None,
    )
