"""What a control compensates by: a model's numbers for its tables, and what a table cannot hold."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np

from design.compensation_tables import (
    LOWEST_OF_TABLE,
    Harmonic,
    SlidingFriction,
    along,
    cogging_harmonics,
    is_of_place,
    is_of_speed,
)
from design.generated.exported import identifier
from design.generated.filled import Filled
from design.machine.model import Model
from design.machine.readable import Display, Unit, number
from identification.effects._base import Acting
from identification.errors import BadModel
from identification.model.estimates import Estimate

Control = Literal["twincat", "codesys", "linuxcnc", "sinumerik"]
Table = Literal["friction-table", "cogging-table", "backlash", "feed-forward"]
Encoder = Literal["motor", "load"]
IDENTIFIED_BY_SLIDING = ("F_cp", "F_cn", "F_vp", "F_vn")
MOST_OF_IT = 0.5  # of the asymmetry, from which a constant force is worth saying
PLACES_ALONG = 400  # of the travel, at which a position-dependent force is evaluated
NO_TABLE_HOLDS = "what it adds depends on what was before, so no table holds it"


@dataclass(frozen=True)
class TablesAsked:
    """What a user says that no model can: speeds, gearing, motor, encoder; SI, None for not said.

    high: highest speed of the tables; per_turn: travel of the axis in one turn of its motor [m or
    rad]; rated: rated torque [N m], or force [N] of a linear motor, of which drives count their
    torque in shares; encoder: by which the control positions, before the play or behind it.
    """

    name: str | None = None
    high: float | None = None
    per_turn: float | None = None
    rated: float | None = None
    encoder: Encoder | None = None


@dataclass(frozen=True)
class Cost:
    """What a table leaves uncompensated, in words; force [N or N m], None where not
    identifiable from the logs."""

    what: str
    force: float | None

    def in_words(self, unit: str) -> str:
        """The cost, its force in this unit."""
        return self.what if self.force is None else f"{self.what} {number(self.force)} {unit}"


@dataclass(frozen=True)
class Compensation:
    """A model, and what was asked of its tables."""

    model: Model
    asked: TablesAsked

    @cached_property
    def name(self) -> str:
        """Prefix of files and blocks."""
        return identifier(self.asked.name or self.model.card)

    @property
    def display(self) -> Display:
        """In which units numbers of the axis are shown."""
        return self.model.display

    @cached_property
    def friction(self) -> SlidingFriction:
        """Friction while sliding; raises BadModel where a number of it is not identified."""
        self.need("a friction table", IDENTIFIED_BY_SLIDING)
        for one in filter(is_of_speed, self.model.acting):
            for name, found in self.model.effects[one.key].items():
                if not found.known:
                    raise BadModel(self.refusal("a friction table", f"{one.key}.{name}", found))
        return SlidingFriction(self.model.simulated, LOWEST_OF_TABLE * self.high, self.high)

    @property
    def high(self) -> float:
        """Highest speed of the tables [m/s]: as asked, else what the logs show."""
        found = self.asked.high or self.model.speed
        if found is None:
            raise BadModel(
                f"{self.model.card}: the model does not say how fast its logs are; give the highest"
                " speed of the table by --speed, or run 'workbench identify' again"
            )
        return found

    def need(self, what: str, names: Iterable[str]) -> None:
        """Raises BadModel where one of the nine is not identified."""
        for name in names:
            found = self.model.friction[name]
            if not found.known:
                raise BadModel(self.refusal(what, name, found))

    def refusal(self, what: str, name: str, found: Estimate) -> str:
        """The refusal of what needs a number that no log identifies."""
        return (
            f"{self.model.card}: {what} needs {name}, which is not identified"
            f" ({first_of(found.reason)}); no number is assumed for it"
        )

    def small(self, names: Iterable[str]) -> Iterator[str]:
        """A line for each parameter of which the logs show only that it is small."""
        for name in names:
            found = self.model.friction[name]
            if found.value is None and found.at_most is not None:
                yield (
                    f"{name}: not significantly different from 0, at most"
                    f" {number(found.at_most)} {found.unit}; the table has"
                    f" {number(found.assumed or 0.0)}"
                )

    @property
    def missing(self) -> tuple[str, ...]:
        """A remark where the model leaves much of the force."""
        left = self.model.fit.force_relative
        if self.model.fit.adequate or left is None:
            return ()
        return (
            f"the model leaves {100 * left:.2g} % of the force while sliding, which is more than"
            " noise: 'workbench trace' finds what it lacks",
        )

    @property
    def beyond(self) -> tuple[str, ...]:
        """A remark where the tables go further than the logs."""
        seen, unit = self.model.speed, self.display.shown("velocity")
        if seen is None or self.high <= 1.001 * seen:
            return ()
        return (
            f"the logs reach {number(unit.factor * seen)} {unit.name}: above it the table is the"
            " model's law, not a measurement",
        )

    @cached_property
    def places(self) -> tuple[Acting, ...]:
        """Position-dependent forces among the effects, with the sizes that the logs identify;
        `unidentified_places` has the others, which are 0 here."""
        return tuple(one for one, _ in self._places if one is not None)

    @property
    def unidentified_places(self) -> tuple[str, ...]:
        """A line for each number of a position-dependent force that no log identifies."""
        return tuple(line for _, lines in self._places for line in lines)

    @cached_property
    def _places(self) -> list[tuple[Acting | None, list[str]]]:
        return [self._identified_part(one) for one in self.model.acting if is_of_place(one)]

    def _identified_part(self, one: Acting) -> tuple[Acting | None, list[str]]:
        """The effect without the sizes that no log identifies; None where its shape is not
        identified."""
        found, lines, values = self.model.effects[one.key], list[str](), dict(one.values)
        for p in one.effect.params:
            if found[p.name].known:
                continue
            why = f"{one.key}.{p.name} is not identified ({first_of(found[p.name].reason)})"
            if not p.linear:
                return None, [f"{why}, so {one.key} is left out"]
            values[p.name] = 0.0
            lines.append(f"{why}, so it is 0 in the table")
        return one.effect.acting(values), lines

    @cached_property
    def harmonics(self) -> tuple[Harmonic, ...]:
        """Cogging of the axis by its waves, the largest first; empty where none is identified."""
        return cogging_harmonics(self.places)

    @cached_property
    def play(self) -> Estimate | None:
        """Width of the play [m]; None where the model has none.

        Raises BadModel where it has one of unknown width.
        """
        found = self.model.effects.get("backlash", {}).get("width")
        if found is not None and found.value is None:
            raise BadModel(self.refusal("backlash", "its width", found))
        return found

    @property
    def turn(self) -> float:
        """Travel of the axis [m or rad] over which orders are counted: a turn of its motor; of a
        rotary axis whose gearing is not said its own; else the longest period of its cogging."""
        if self.asked.per_turn is not None:
            return self.asked.per_turn
        return 2.0 * np.pi if self.model.rotary else max(one.period for one in self.harmonics)

    @property
    def turn_words(self) -> str:
        """What `turn` is."""
        if self.asked.per_turn is not None:
            return "a turn of the motor"
        return "a turn of the axis" if self.model.rotary else "the longest period of the cogging"

    @property
    def at(self) -> str:
        """What the speeds and torques of a drive's files are of, in words."""
        return f"speeds and torques of a drive are {self.at_motor.words}"

    @property
    def at_motor(self) -> "AtMotor":
        """How forces and speeds of the axis are at its motor."""
        return AtMotor(self.display, self.asked.per_turn)


@dataclass(frozen=True)
class Content:
    """What a file of a control holds; units: in words; values: of its template.

    error: largest deviation from the model over the table's range, relative; None where it has no
    range. costs: what it leaves uncompensated. remarks: what to know, a line each; said: those that
    stand beside the file alone.
    """

    units: str
    points: int = 1
    error: float | None = 0.0
    values: Mapping[str, Any] = field(default_factory=dict)
    costs: tuple[Cost, ...] = ()
    remarks: tuple[str, ...] = ()
    said: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class TableFile(Content):
    """A file for a control ("" for any), as text; where: it is to go; remarks: all of them."""

    name: str
    text: str
    table: Table
    control: Control | Literal[""]
    where: str


@dataclass(frozen=True)
class Format:
    """A file of a control ("" for any): its ending, which is its template, and what makes it."""

    file: str
    table: Table
    control: Control | Literal[""]
    where: str
    content: Callable[[Compensation], Content]

    def __call__(self, what: Compensation, filled: Filled) -> TableFile:
        """The file of a model; filled: fills in its template. Raises BadModel where a number that
        it needs is wanting."""
        made = self.content(what)
        costs = [one.in_words(what.display.force) for one in made.costs]
        lead = {"card": what.model.card, "costs": costs, "remarks": made.remarks}
        whole = {**vars(made), "remarks": (*made.said, *made.remarks)}
        return TableFile(
            name=f"{what.name}_{self.file}", text=filled(self.file, **{**lead, **made.values}),
            table=self.table, control=self.control, where=self.where, **whole,
        )  # fmt: skip


@dataclass(frozen=True)
class AtMotor:
    """Forces and speeds of an axis at its motor, which turns, or is linear.

    A linear axis of which no `per_turn` is said has a linear motor, a rotary one its motor on it.
    """

    axis: Display
    per_turn: float | None

    @property
    def turns(self) -> bool:
        return self.axis.rotary or self.per_turn is not None

    @property
    def travel(self) -> float:
        """Travel of the axis [m or rad] for each radian of the motor; 1 where they are one."""
        return 1.0 if self.per_turn is None else self.per_turn / (2.0 * np.pi)

    @property
    def torque_unit(self) -> str:
        """N m, or N of a linear motor."""
        return "N m" if self.turns else "N"

    @property
    def speed(self) -> Unit:
        """rpm, or m/min of a linear motor, for each m/s or rad/s of the axis."""
        if not self.turns:
            return Unit("m/min", 60.0)
        return Unit("rpm", 60.0 / (2.0 * np.pi * self.travel))

    @property
    def words(self) -> str:
        """What was taken for it."""
        if self.per_turn is not None:
            unit, factor = self.axis.shown("position")
            return f"of the motor, {number(factor * self.per_turn, 6)} {unit} of the axis a turn"
        return "of a motor on the axis itself" if self.axis.rotary else "of a linear motor"


def first_of(reason: str | None) -> str:
    """What a reason says, without its advice."""
    return (reason or "not identifiable from the logs").partition(";")[0]


def friction_costs(what: Compensation, *, signed: bool) -> tuple[Cost, ...]:
    """What a table of friction against speed leaves, the common part; signed: it has both ways."""
    curve, out = what.friction, list[Cost]()
    if not signed:
        off, constant = curve.asymmetry, curve.constant_share
        most = ""
        if abs(constant) > MOST_OF_IT * off > 0:
            beside = f"{number(constant)} {what.display.force}"
            most = f" (a constant {beside} beside it would take most of it)"
        mean = f"asymmetry: the table is the mean of both directions{most}"
        out.append(Cost(f"{mean}, off either way by up to", off))
    lowest = np.array([curve.low])
    for name, way, level in (
        ("F_sp", "positive", curve.positive(lowest)),
        ("F_sn", "negative", curve.negative(lowest)),
    ):
        found = what.model.friction[name]
        if not found.known:
            out.append(Cost(f"breakaway in {way} direction: not identified", None))
            continue
        limit = abs(found.value if found.value is not None else found.assumed or 0.0)
        more = limit - float(level[0])
        if more > 0:
            said = f"stiction: breakaway in {way} direction needs more than the table, by"
            out.append(Cost(said, more))
    return (*out, *other_costs(what))


def other_costs(what: Compensation) -> Iterator[Cost]:
    """Effects of the model that a friction table does not hold, with their sizes where known."""
    for one in what.model.acting:
        effect = one.effect
        if is_of_speed(one) or effect.place.shows or effect.place.in_actuator:
            continue
        said = one.key.replace("_", " ")
        if effect.place.unit != "N" or effect.evolve is not None or effect.signals:
            yield Cost(f"{said}: {NO_TABLE_HOLDS}", None)
        elif set(effect.depends_on) <= {"y", "v"}:
            position = is_of_place(one)
            kind = (
                "a position-dependent force, not friction" if position else "varies with position"
            )
            yield Cost(f"{said}: {kind}, up to", largest_along(what.model, one))
        else:
            of = ", ".join(effect.depends_on)
            yield Cost(f"{said}: depends on {of}, so not compensated", None)


def largest_along(model: Model, one: Acting) -> float:
    """Largest size of an effect along the travel of the logs [N], either way."""
    y = np.linspace(*model.travel, PLACES_ALONG)
    speed = np.full(PLACES_ALONG, model.speed or 0.0)
    found = (along(one, plant=model.simulated, way=d, y=y, v=d * speed) for d in (1, -1))
    return max(float(np.max(np.abs(each))) for each in found)
