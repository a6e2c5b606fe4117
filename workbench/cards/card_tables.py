"""The tables of a card as it is written, every key said below its field.

`[recipe]` is in design/simulated/recipe.py, `[controller]` in design/machine/controller.py,
`[limits]` in design/measured/card_limits.py, and what a gain means in workbench/cards/units.py.
"""

import re
from collections.abc import Mapping
from contextlib import suppress
from typing import Annotated, Any, Literal

from pydantic import Field, Strict, field_validator, model_validator

from design.machine.card_table import CardTable, Positive
from design.machine.controller import ControllerSection
from design.measured.card_limits import LimitsSection
from design.simulated.recipe import RecipeSection
from identification.errors import BadCard
from identification.log import Rig, RigKind
from identification.model.plant import over
from workbench.cards.units import (
    LONGEST_UNIT,
    Scale,
    column_scale,
    command_unit,
    force_unit,
    in_unit_of,
    over_time,
    parse_gain,
)

Format = Literal[
    "csv", "parquet", "mat", "hdf5", "json", "tdms", "mdf", "mcap", "ulog", "excel", "npy",
    "rosbag",
]  # fmt: skip


class About(CardTable):
    """`[card]`: name of the set and where it comes from."""

    name: str
    """of the machine: letters, digits, `_`, `.`, `-`; also the folder of its files under
    `WORKBENCH_DATA`"""
    title: str = ""
    """in a line"""
    source: str = ""
    """who recorded the logs, and how"""
    licence: str = ""
    """of the logs"""
    citation: str = ""
    """how their authors want them cited"""
    url: str = ""
    """where they are described"""
    notes: tuple[str, ...] = ()
    """traps, one a text"""

    @field_validator("name")
    @classmethod
    def _plain(cls, name: str) -> str:
        if not re.fullmatch(r"[\w.-]+", name):
            raise ValueError(
                "letters, digits, '_', '.' and '-' make a name, one of them at least, as 'bench-a'"
            )
        return name


class FileSpec(CardTable):
    """`[file]`: how the bytes are laid out; `None` means found by looking."""

    format: Format | None = None
    """of the files; without it, by their content"""
    header: bool | None = None
    """of text: whether a row of names is there; without it, by looking"""
    skip_rows: int = Field(default=0, ge=0)
    """rows to drop before the header, or before the data where there is none"""
    delimiter: str | None = Field(default=None, min_length=1, max_length=1)
    """of text; without it, by looking"""
    decimal: Literal[".", ","] | None = None
    """of text; without it, by looking"""
    comment: str = "#"
    """of text: rows that begin so are dropped"""
    rows: str | None = None
    """what holds the signals: JSON key, HDF5 group, MAT struct (`a.b`), sheet, group of channels,
    topic or message"""
    encoding: str = "utf-8"
    """of text"""


class SignalSpec(CardTable):
    """One signal: column = gain * signal + offset (see workbench/cards/units.py)."""

    column: str | int
    """its name in the log, or its number from 0"""
    unit: str
    """of the column; of a sensor's output where `gain` is a number of that output for each SI
    unit"""
    gain: Annotated[float, Strict()] | str = 1.0
    """column = gain * signal + offset: a text with its unit (`"80 V/m"`, `"4096 count/turn"`), or a
    number"""
    offset: float = 0.0
    """what the column shows where the signal is 0, in the unit of the column"""
    bits: int | None = Field(default=None, ge=2, le=52)
    """of a counter in two's complement"""
    signed: bool = False
    """whether an unsigned column is such a counter; needs `bits`"""
    summed: bool = False
    """whether the column is what the signal goes by: of `t` the time since the row before, of a
    position its speed, in a unit of speed"""

    @model_validator(mode="after")
    def _invertible(self) -> "SignalSpec":
        parse_gain(self.gain)
        if self.signed and self.bits is None:
            raise ValueError("signed = true needs bits")
        return self

    def scale(self, signal: str, rig: Rig) -> Scale:
        """Signal in SI = factor * (column - offset) + shift; raises BadCard where it cannot be."""
        unit = over_time(self.unit, signal) if self.summed else self.unit
        return column_scale(unit, self.written_gain, signal, rig.motion, rig.command_unit)

    @property
    def written_gain(self) -> float | str | None:
        """The gain as it is written; None where it is not."""
        return self.gain if "gain" in self.model_fields_set else None


class RigSection(CardTable):
    """`[rig]` as a card writes it."""

    kind: RigKind
    """how the force on the body is known: from two pressures, logged as F, or as force_per_command
    times u; or "velocity", where none is and the velocity follows u (a valve and cylinder)"""
    area_p_m2: Positive | None = None
    """piston area of the chamber that pushes towards +y, m²; with `force` given too, the pressures
    correct F"""
    area_n_m2: Positive | None = None
    """piston area of the other chamber, m²"""
    supply_pressure_pa: float | None = None
    """P_s of eq. (7), Pa; left out (0) where areas are the same or pressures are gauge pressures"""
    force_per_command: float | str | None = None
    """of a motor: N for each unit of u, or a text (`"35.15 N/A"`)"""
    command_unit: str | None = Field(default=None, min_length=1, max_length=LONGEST_UNIT)
    """the unit of u inside; without it V, A, 1, N or N m, as the unit of its column is"""
    control_limit: Positive | str | None = None
    """of the size of u, in `command_unit`, or a text (`"8 A"`)"""
    control_limit_v: Positive | None = None
    """the older name of `control_limit`"""
    motor_inertia: Positive | str | None = None
    """of the motor alone, kg (kg m² of a rotary machine), or a text (`"0.3 kg cm^2"`); what is
    identified is given as a multiple of it"""
    stroke_m: tuple[float, float] | None = None
    """low and high end of the motion, m (rad)"""
    motion: Literal["linear", "rotary"] = "linear"
    """rotary: rad, N m and kg m² in place of m, N and kg"""

    @model_validator(mode="after")
    def _complete(self) -> "RigSection":
        if self.kind == "electro-pneumatic":
            for key in ("area_p_m2", "area_n_m2"):
                if getattr(self, key) is None:
                    raise ValueError(f'kind = "electro-pneumatic" needs {key!r} for eq. (7)')
        if self.kind == "velocity":
            for key in ("area_p_m2", "area_n_m2", "supply_pressure_pa", "force_per_command"):
                if getattr(self, key) is not None:
                    raise ValueError(f'kind = "velocity" knows no force; leave {key!r} out')
        if self.stroke_m and self.stroke_m[0] >= self.stroke_m[1]:
            raise ValueError("stroke_m must be [low, high]")
        if self.control_limit is not None and self.control_limit_v is not None:
            raise ValueError("control_limit and control_limit_v are the same; give one of them")
        return self

    def value(self, signals: Mapping[str, SignalSpec]) -> Rig:
        """The rig; signals give the unit of its command where the card does not name it.

        Raises BadCard where a number's unit is of another kind.
        """
        command = self.command_unit or self._command_unit(signals)
        limit = self.control_limit_v if self.control_limit is None else self.control_limit
        per = over(force_unit(self.motion), command)
        given = self._per_command(per, command)
        if given == 0.0:
            raise BadCard(
                f"rig.force_per_command = 0 {per}: a command without a force drives nothing; give"
                " the drive's constant (1 where it is not known: a force is then in units of the"
                " command)"
            )
        mass = "kg m^2" if self.motion == "rotary" else "kg"
        return Rig(
            kind=self.kind,
            area_p=self.area_p_m2,
            area_n=self.area_n_m2,
            supply_pressure=self.supply_pressure_pa,
            force_per_command=given,
            control_limit=_positive_in(command, limit, "rig.control_limit"),
            stroke=self.stroke_m,
            motion=self.motion,
            command_unit=command,
            motor_inertia=_positive_in(mass, self.motor_inertia, "rig.motor_inertia"),
        )

    def _per_command(self, per: str, command: str) -> float | None:
        """The force per command in `per`; raises BadCard, naming the command's unit, or the motion,
        where it is of another."""
        try:
            return in_unit_of(self.force_per_command, per, "rig.force_per_command")
        except BadCard as error:
            other: Literal["linear", "rotary"] = "linear" if self.motion == "rotary" else "rotary"
            said = f": by signals.u the command is in {command!r}; correct its unit, or this"
            with suppress(BadCard):
                in_unit_of(self.force_per_command, over(force_unit(other), command), "")
                said = f', which motion = "{self.motion}" needs; write motion = "{other}" in [rig]'
                said += f" if the machine {'slides' if other == 'linear' else 'turns'}, or"
                said += " correct this unit"
            raise BadCard(f"{error}{said}") from None

    def _command_unit(self, signals: Mapping[str, SignalSpec]) -> str:
        """The unit of the command's column; a force where none is logged but its limit is given."""
        if self.kind == "velocity" and "u" in signals and signals["u"].written_gain is None:
            return signals["u"].unit.strip() or "1"  # as it is: no force is made of it
        if "u" in signals:
            u = signals["u"]
            found = command_unit(u.unit, u.written_gain, self.motion)
            column_scale(u.unit, u.written_gain, "u", self.motion, found)  # or says what to write
            return found
        return "V" if self.control_limit is None else force_unit(self.motion)


def _positive_in(unit: str, written: float | str | None, where: str) -> float | None:
    value = in_unit_of(written, unit, where)
    if value is not None and not value > 0:
        raise BadCard(f"{where} = {value:g}, must be > 0")
    return value


class FileEntry(CardTable):
    """`[[files]]`: one file of the set, where to fetch it, and what of the rig differs for it."""

    name: str
    """of the file"""
    url: str | None = None
    """where it can be fetched"""
    sha256: str | None = Field(default=None, pattern=r"^[0-9a-f]{64}$")
    """of its bytes; another file is refused"""
    rig: dict[str, Any] = Field(default_factory=dict)
    """keys of `[rig]` that differ for this file"""


EXTRA = "extra"  # table of [signals] with what else was measured


class CardFile(CardTable):
    """A card as it is written."""

    card: About
    """what the machine is called, and where its logs come from"""
    rig: RigSection
    """the machine"""
    signals: dict[str, SignalSpec] = Field(default_factory=dict)
    """what each column is; `t`, `y`, and by kind `p_p` and `p_n`, `F`, or `u` are needed; what else
    was measured beside these or in a table `[signals.extra]`: trace tries what depends on it"""
    file: FileSpec = FileSpec()
    """how the files are laid out; all of it is found by looking where it is not given"""
    files: tuple[FileEntry, ...] = ()
    """the files of the set, one table each"""
    split: dict[str, tuple[str, ...]] = Field(default_factory=dict)
    """names of groups of files; `trace` takes `train` and `test`"""
    recipe: RecipeSection | None = None
    """in place of a log: what `simulate` makes one from"""
    controller: ControllerSection | None = None
    """the controller that the machine has now"""
    limits: LimitsSection | None = None
    """what `axis-test` holds the machine to"""

    @field_validator("signals", mode="before")
    @classmethod
    def _with_extra(cls, given: Any) -> Any:
        """`[signals.extra]` beside the other signals; raises ValueError where a name is in both."""
        extra = given.get(EXTRA) if isinstance(given, dict) else None
        if not isinstance(extra, dict) or "column" in extra:
            return given
        own = {name: one for name, one in given.items() if name != EXTRA}
        if twice := sorted(own.keys() & extra.keys()):
            raise ValueError(f"{twice[0]} is in [signals] and in [signals.extra]: leave one out")
        return {**own, **extra}
