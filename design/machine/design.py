"""The design of one machine: controllers, margins, compensator.

Values are plain SI numbers; in design.json every parameter has the unit that its field is annotated
with.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    Field,
    PlainSerializer,
    SerializationInfo,
    SerializerFunctionWrapHandler,
    model_serializer,
)

from design.cascade import CascadeGains
from design.drive_law import DriveLaw, drive_law
from design.feed_forward import FeedForward
from design.loop_frequencies import LoopFrequencies
from design.machine.codec import (
    NOT_WRITTEN,
    PLACEHOLDER,
    Around,
    Command,
    InUnit,
    Output,
    Parameter,
    Through,
    entry,
    numbers,
    numbers_of,
    written,
)
from design.machine.compensator import CompensatorValues
from design.machine.drive import (
    FORCE_LOOP_UNITS,
    PRESENT_LOOP,
    ForceLoop,
    LawFile,
    Present,
    law_file,
    law_of,
)
from design.machine.readable import Display
from design.margins import Margins
from design.pid import PIDGains
from design.rst import RST
from design.schedule import Over, Schedule
from design.series_filters import FilterKind, SeriesFilter
from identification.errors import BadModel
from identification.log import Motion
from identification.model.estimates import Estimate

From = Literal["physical", "arx"]
Structure = Literal["rst", "pid", "p-pi"]
DESIGNED_STRUCTURES: tuple[Structure, ...] = ("rst", "pid", "p-pi")
Recommended = Literal["rst", "pid", "p-pi", "none"]
LEAST_SPAN = 1e-3  # m/s, from which a direction counts in full where no feed-forward says
# Units of what is written as numbers by name.
FRICTION_AHEAD = {"F_cp": "force", "F_cn": "force", "F_vp": "viscous", "F_vn": "viscous"}
PID_UNITS = {"k_R": "stiffness", "T_i": "s", "T_d": "s", "eps": "s", "b": "1", "c": "1"}
CASCADE_UNITS = {"k_v": "1/s", "k_p": "damping", "T_n": "s", "eps": "s", "v_ff": "1"}
AHEAD_UNITS = {**FRICTION_AHEAD, "band": "velocity", "m": "mass", "most": "force"}
MARGINS_TAKEN = (
    "modulus", "gain_up", "gain_down", "phase_deg", "delay_s", "S_yp_max_db", "S_up_max_db",
)  # fmt: skip
POLES = numbers(lambda w_n, zeta: (w_n, zeta), {"w_n": "rad/s", "zeta": "1"}, above_0=True)


@dataclass(frozen=True)
class Linear:
    """The sampled plant a design rests on, force reference [N] to position [m], and why this one.

    m [kg], F_v [N s/m] are None for an ARX plant. resonance: that of two masses, as a model has it.
    """

    source: From
    why: str
    A: tuple[float, ...]
    B: tuple[float, ...]
    h: Annotated[float, InUnit("s", above_0=True)]
    m: Annotated[Estimate | None, InUnit("mass")]
    F_v: Annotated[Estimate | None, InUnit("viscous")]
    resonance: Mapping[str, Parameter] | None = None


@dataclass(frozen=True)
class MarginValues:
    """Margins of a loop as results carry them; worst_modulus over the parameters' intervals.

    None: no limit of that kind; worst_modulus None: unstable for some parameters inside them.
    crossover_hz, bandwidth_hz, rejection_hz: as `design.loop_frequencies` has them, None also in
    older files.
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
    rejection_hz: float | None = None

    @property
    def gain_db(self) -> float | None:
        """By how much the gain may grow [dB]; None: by any."""
        return None if self.gain_up is None else 20.0 * math.log10(self.gain_up)


@dataclass(frozen=True)
class SeriesFile:
    """`SeriesFilter` as a result has it, its width at -3 dB and depth, and b/a in z^-1."""

    kind: FilterKind
    frequency: Annotated[float, InUnit("Hz", above_0=True)]
    numerator: Annotated[float, InUnit("1")]
    denominator: Annotated[float, InUnit("1", above_0=True)]
    width: Annotated[float | None, InUnit("Hz", for_readers=True)]
    depth_db: float | None
    b: tuple[float, ...]
    a: tuple[float, ...]


def _series(found: SeriesFile, info: Any) -> SeriesFilter:
    """The filter; raises BadModel where its coefficients are not those of its numbers."""
    h = info.data.get("h", math.nan)  # of its controller; where that is refused, so is this
    one = SeriesFilter(found.kind, found.frequency, found.numerator, found.denominator, h)
    made = one.filter
    for key, ours, theirs in (("b", made.b, found.b), ("a", made.a, found.a)):
        if len(ours) != len(theirs) or not np.allclose(ours, theirs, rtol=1e-9, atol=1e-12):
            raise BadModel(
                f"[{PLACEHOLDER}] {key} is not the {found.kind} of its numbers;"
                " run 'workbench design' again"
            )
    return one


SERIES = Through(SeriesFile, _series, lambda one, _around: SeriesFile(
    one.kind, one.frequency, one.numerator, one.denominator, one.width, one.depth_db,
    one.filter.b, one.filter.a,
))  # fmt: skip


def _anti_windup(found: LawFile, info: Any) -> tuple[float, ...]:
    """The part of a law that is not the controller beside it, in the unit of the command."""
    if info.context.command is not None:
        law_of(found, info.context.units, PLACEHOLDER)
    return found.W


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
    h: Annotated[float, InUnit("s", above_0=True)]
    dominant: Annotated[tuple[float, float], POLES]
    auxiliary: tuple[tuple[float, float], ...]
    rate: Annotated[
        float | None,
        InUnit("velocity", above_0=True, why_none="no limit of force or command to keep"),
        Field(alias="reference_rate"),
    ]
    lag: Annotated[float, InUnit("s"), Field(alias="reference_lag")]
    margins: MarginValues
    overshoot: float
    missed: tuple[str, ...]
    gains: Annotated[PIDGains | None, numbers(PIDGains, PID_UNITS)] = None
    note: str | None = None
    # Written by `_with_law`, as the whole law.
    W: Annotated[
        tuple[float, ...] | None,
        Through(LawFile, _anti_windup, lambda _value, _around: None),
        Field(alias="law"),
    ] = None
    cascade: Annotated[
        CascadeGains | None, numbers(CascadeGains, CASCADE_UNITS, derived=("k_p_command",))
    ] = None
    series: Annotated[SeriesFilter | None, SERIES, Field(alias="filter")] = None
    feed_forward: Annotated[FeedForward | None, numbers(FeedForward, AHEAD_UNITS)] = None
    acceleration: Annotated[
        float | None, InUnit("acceleration", above_0=True), Field(alias="reference_acceleration")
    ] = None

    @model_serializer(mode="wrap")
    def _with_law(
        self, plain: SerializerFunctionWrapHandler, info: SerializationInfo[Around]
    ) -> dict[str, Any]:
        """The controller with the law that its drive runs, and k_p in the command's unit."""
        found: dict[str, Any] = plain(self)
        around = info.context
        command = around.command
        if command is not None:
            found["law"] = written(law_file(self.law(command), around), around)
        if self.cascade is not None:
            per, units = command and command.force_per_command, around.units
            own = None
            if command and per and command.unit != units.force:
                unit = f"{command.unit} s/{units.position}"
                own = Estimate(self.cascade.k_p / per, unit)
            found["cascade"]["k_p_command"] = own and entry(own, around)
        return found

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
class Recommendation:
    """Which controller, with or without the compensator, and why, in one line with numbers.

    keep_present: whether the controller that the machine has now is as good, and may stay.
    """

    controller: Recommended
    compensator: bool
    why: str
    keep_present: bool = False


def _in_full(value: Any, info: SerializationInfo[Around]) -> Any:
    """Values of a schedule, whose parameters have always been written with all keys."""
    return [written(one, info.context._replace(in_full=True)) for one in value]


@dataclass(frozen=True)
class ScheduledController:
    """A controller at each point of a schedule; recommended: whether it clearly wins over the fixed
    one, and why, in one line with numbers."""

    points: Annotated[tuple[Controller, ...], PlainSerializer(_in_full)]
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
class ScheduleFile:
    """`GainSchedule` as a result has it."""

    over: Over
    points: tuple[Mapping[str, Estimate | None], ...]
    pid: ScheduledController | None = None
    p_pi: ScheduledController | None = None


def _schedule_units(over: Over, around: Around) -> dict[str, str]:
    """Units of a schedule's row by name."""
    at = {"place": "position", "load": "force", "direction": "1"}[over]
    return around.units.by_name({"at": at, **FRICTION_AHEAD})


def _schedule_file(one: GainSchedule, around: Around) -> ScheduleFile:
    units = _schedule_units(one.over, around)
    rows = ((at, *friction) for at, friction in zip(one.at, one.friction, strict=True))
    points = tuple(
        {name: Estimate(x, unit) for x, (name, unit) in zip(row, units.items(), strict=True)}
        for row in rows
    )
    return ScheduleFile(one.over, points, one.controllers.get("pid"), one.controllers.get("p-pi"))


def _schedule(found: ScheduleFile, info: Any) -> GainSchedule:
    """The schedule; raises BadModel where a controller has not one at every point."""
    units = _schedule_units(found.over, info.context)
    rows = [
        tuple(numbers_of(one, units, f"{PLACEHOLDER}.points[{k}]", info.context).values())
        for k, one in enumerate(found.points)
    ]
    every: dict[Structure, ScheduledController | None] = {"pid": found.pid, "p-pi": found.p_pi}
    controllers = {name: one for name, one in every.items() if one is not None}
    for name, one in controllers.items():
        if len(one.points) != len(rows):
            raise BadModel(
                f"[{PLACEHOLDER}.{name}] {len(one.points)} controllers at {len(rows)} points; run"
                " 'workbench design' again"
            )
    friction = tuple((row[1], row[2], row[3], row[4]) for row in rows)
    return GainSchedule(found.over, tuple(row[0] for row in rows), friction, controllers)


@dataclass(frozen=True)
class Design:
    """Controllers of one machine; one may be None with its reason in `refused`.

    recommended: the controller that keeps every goal, "none" where none does. command: what the
    drive takes, present: the controller that it has now, recommendation: the same with its reason;
    None in older files. read: what to say of its file, a line for each value in another unit than
    ours. schedule: the controllers over place, load or direction, where that was asked for.
    lacks: what its model lacks, in words, "" where nothing.
    """

    card: str
    motion: Motion
    plant: Linear
    force: Annotated[ForceLoop | None, FORCE_LOOP_UNITS]
    rst: Controller | None
    pid: Controller | None
    refused: Mapping[str, str]
    recommended: Recommended
    compensator: CompensatorValues
    remarks: tuple[str, ...]
    versions: Mapping[str, str]
    command: Command | None = None
    present: Annotated[Present | None, PRESENT_LOOP] = None
    recommendation: Recommendation | None = None
    p_pi: Controller | None = None
    schedule: Annotated[GainSchedule | None, Through(ScheduleFile, _schedule, _schedule_file)] = (
        None
    )
    lacks: str = ""
    read: Annotated[tuple[str, ...], *NOT_WRITTEN] = field(default=(), compare=False)
    schema: Literal["design/2"] = "design/2"

    @property
    def controllers(self) -> dict[str, Controller]:
        """The controllers that exist, by name."""
        every = (self.rst, self.pid, self.p_pi)
        return {k: c for k, c in zip(DESIGNED_STRUCTURES, every, strict=True) if c is not None}

    def scheduled(self, name: str) -> ScheduledController | None:
        """A controller as the gain schedule has it; None where it does not."""
        own = self.schedule.controllers.items() if self.schedule else ()
        return next((one for key, one in own if key == name), None)

    @property
    def display(self) -> Display:
        """In which units its numbers are held and shown."""
        return Display(self.motion, self.command.unit if self.command else "V")

    @property
    def output(self) -> Output:
        """What its laws give: the command, or the reference of the force loop."""
        return "command" if self.force is None else "force"


def margin_values(
    found: Margins, worst: float | None, at: LoopFrequencies | None = None
) -> MarginValues:
    """The margins as results carry them."""
    samples = None if found.delay_s is None else found.delay_s / found.h
    own = {name: getattr(found, name) for name in MARGINS_TAKEN}
    hertz = {f"{name}_hz": value for name, value in vars(at).items()} if at else {}
    return MarginValues(**own, **hertz, delay_samples=samples, worst_modulus=worst)
