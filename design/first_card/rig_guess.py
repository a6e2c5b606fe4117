"""What a first card says of its rig: its kind, and numbers in the log or beside it."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from design.machine.readable import Display
from identification.columns.column import Column
from identification.columns.log_columns import Columns
from identification.columns.motion_guess import UnitGuess
from identification.columns.notation import Factor
from identification.columns.roles import Roles
from identification.columns.weights import SURE
from identification.log import Motion

MOTOR_CONSTANT = re.compile(
    r"(g|k)_?(tau|t|a|f|m)$|(force|torque|motor|thrust)[ _]?(const|gain)|kraftkonst", re.I
)
AMBIENT = 1e5  # Pa
MOST_OF_AIR = 1.5e6  # Pa, of compressed air; above, pressures are those of oil
AT_LIMIT = 3  # samples in a row at its largest value, of a command that is limited
LEVELS_OF_COMMAND = 10  # values that a command takes at least where its limit is looked for
DRIVEN_THROUGH = {
    "electro-pneumatic": ("p_p", "p_n"),
    "force": ("F",),
    "motor": ("u",),
    "velocity": ("u",),
}
DRIVEN_BY = {
    "electro-pneumatic": "F_e from two pressures",
    "force": "F_e is logged",
    "motor": "F_e = force_per_command * u",
    "velocity": "the velocity follows u",
}


@dataclass(frozen=True)
class RigGuess:
    """A value of the rig; None where only who knows the machine can give it; rival: the other."""

    key: str
    value: float | str | None
    unit: str
    sure: bool
    why: str
    rival: str = ""


def area_of(name: str, roles: Roles, units: Mapping[str, UnitGuess], factor: Factor) -> RigGuess:
    """The area on which a pressure beside the force acts: it makes friction alike both ways."""
    mean = float(np.mean(roles.columns[name].x)) * factor(units[name].unit)
    area = abs(roles.law.balance) * factor(units["F"].unit) / mean
    key = "area_p_m2" if name == "p_p" else "area_n_m2"
    why = "with it friction is equal in both directions; better: measure the bore"
    return RigGuess(key, float(f"{area:.3g}"), "m^2", False, why)


def kind_guess(roles: Roles, other: Roles | None) -> RigGuess:
    """The kind of rig, by what drives the body; the next one with the column that would."""
    sure = bool(roles.ahead >= SURE and roles.odds[DRIVEN_THROUGH[roles.kind][0]] >= SURE)
    why = DRIVEN_BY[roles.kind]
    if not sure and other is not None:
        why += f", by {_drive_columns(roles)}; a rig of kind {other.kind} would be driven"
        why += f" by {_drive_columns(other)}"
    return RigGuess("kind", roles.kind, "", sure, why, "" if sure or other is None else other.kind)


def _drive_columns(roles: Roles) -> str:
    """The columns that drive the body, in words."""
    return " and ".join(roles.columns[name].shown for name in DRIVEN_THROUGH[roles.kind])


def rig_of(
    columns: Columns, roles: Roles, motion: Motion, units: Mapping[str, UnitGuess]
) -> list[RigGuess]:
    """The numbers of the rig that a log can identify, and those that it needs beside the log."""
    out = []
    if roles.kind == "electro-pneumatic":
        even = abs(roles.area_ratio - 1.0) < 1e-9
        why = "not in any log: measure bore and rod; the motion fits best with "
        why += "equal areas" if even else f"an area_n {roles.area_ratio:.2g} times area_p"
        out.append(RigGuess("area_p_m2", 1e-3, "m^2", False, why))
        out.append(RigGuess("area_n_m2", float(f"{1e-3 * roles.area_ratio:.3g}"), "m^2", False,
                            "as area_p_m2: measure bore and rod"))  # fmt: skip
        out.append(_around_the_rod(roles, units, columns.notation.factor))
    if roles.kind == "motor":
        force = Display(motion).force
        out.append(_motor_constant(columns, force, asked=units["u"].unit == force))
    if "u" in roles.columns and (limit := _limit(roles.columns["u"])) is not None:
        out.append(RigGuess("control_limit_v", limit, "unit of u", False,
                            "the command stops there again and again"))  # fmt: skip
    return out


def _around_the_rod(roles: Roles, units: Mapping[str, UnitGuess], factor: Factor) -> RigGuess:
    """The pressure on the rod's area: the ambient one of absolute pressures of air, else none."""
    chambers = [roles.columns[name].values * factor(units[name].unit) for name in ("p_p", "p_n")]
    low, high = min(map(np.nanmin, chambers)), max(map(np.nanmax, chambers))
    air = low > 0.5 * AMBIENT and high < MOST_OF_AIR
    why = "not in any log: the pressure around the rod, mostly the ambient one; it matters where"
    why += " the areas differ; leave it out where pressures are measured against that"
    return RigGuess("supply_pressure_pa", AMBIENT if air else None, "Pa", False, why)


def _motor_constant(columns: Columns, force: str, *, asked: bool) -> RigGuess:
    """Force per command: 1 of a force, else a single value in the file whose name says so."""
    if asked:
        why = "the command is a force already, as the drive makes it"
        return RigGuess("force_per_command", 1.0, f"{force}/u", False, why)
    for one in columns.log.scalars:
        if MOTOR_CONSTANT.search(one.header.strip()) and np.isfinite(one.values[0]):
            why = f"the file's {one.header!r}; check that it is {force} for one unit of u"
            return RigGuess("force_per_command", float(one.values[0]), f"{force}/u", False, why)
    why = (
        "not in any log: the motor's constant times the amplifier's gain; identify needs it"
        " (1: forces in units of the command)"
    )
    return RigGuess("force_per_command", None, f"{force}/u", False, why)


def _limit(u: Column) -> float | None:
    """Size of the command at which it stops in both directions, else None."""
    finite = u.values[np.isfinite(u.values)]
    low, high = float(finite.min()), float(finite.max())
    if not low < 0.0 < high or abs(low + high) > 1e-3 * high:
        return None
    if len(np.unique(finite)) < LEVELS_OF_COMMAND:
        return None
    at = (finite == low) | (finite == high)
    return high if np.count_nonzero(at[1:] & at[:-1]) >= AT_LIMIT else None
