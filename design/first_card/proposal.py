"""A card proposed for a log that none describes, with the reason of each of its lines."""

import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from design.first_card import remarks
from design.first_card.rig_guess import DRIVEN_BY, RigGuess, area_of, kind_guess, rig_of
from design.identified.hardly_identifiable import ALL_FOLLOWED
from identification.columns.column import Column
from identification.columns.log_columns import Columns, UnknownLog, columns_of
from identification.columns.motion_guess import UnitGuess, known_motion
from identification.columns.notation import Notation
from identification.columns.roles import Roles, known_roles, sign_shown_by
from identification.columns.speed_sum import with_position, without_names
from identification.columns.unit_guess import guessed_units
from identification.columns.weights import SURE, said
from identification.log import Motion, RigKind
from identification.signals.delays import are_exchanged
from identification.signals.relations import derivative, force_law

CARD_ORDER = ("t", "r", "y", "F", "p_p", "p_n", "u", "temperature")
VALVES = ("valve", "ventil", "valvola", "válvula", "vanne", "バルブ", "弁")
MOST_EXTRA = 6  # columns that are offered as what the rest may depend on
COLUMN_OPEN = 1.0  # log-odds of a column, below which another one is likelier than another unit


@dataclass(frozen=True)
class SignalGuess:
    """One signal of the card: its column (as the card names it and as the file shows it), unit and
    gain, whether column and unit are sure, and why; rival: what it would be otherwise, as an answer
    says it; summed: whether the column is what the signal goes by."""

    name: str
    column: str | int
    shown: str
    unit: str
    gain: float | str | None
    bits: int | None
    sure: bool
    why: str
    rival: str = ""
    summed: bool = False

    def as_json(self) -> dict[str, Any]:
        """The signal as --json prints it."""
        own = asdict(self)
        del own["name"], own["shown"]
        return {**own, "else": own.pop("rival")}


@dataclass(frozen=True)
class Proposal:
    """What a card should say of a log: signals and rig, columns that are left out (shown: why),
    every column of the file, what else was noticed, the axes that the file holds and the one of the
    card, what else was measured (name: column), and what it should say of a rig of the next likely
    kind.

    log: what the file is called by; layout: how it is read, as a card's [file] says it; hardly:
    what is hardly identifiable from the log; refused: why it cannot be read by the card; both empty
    until it was tried."""

    log: str
    name: str
    kind: RigKind
    motion: Motion
    layout: Mapping[str, object]
    signals: tuple[SignalGuess, ...]
    rig: tuple[RigGuess, ...]
    unused: Mapping[str, str]
    columns: tuple[Column, ...]
    remarks: tuple[str, ...] = ()
    axes: tuple[str, ...] = ()
    axis: str = ""
    extra: Mapping[str, str | int] = field(default_factory=dict)
    other: "Proposal | None" = None
    hardly: tuple[str, ...] = ()
    refused: str = ""

    def signal(self, name: str) -> SignalGuess | None:
        """The signal of that name; None where the card has none."""
        return next((one for one in self.signals if one.name == name), None)

    def as_json(self) -> dict[str, Any]:
        """The proposal as --json prints it."""
        return {
            "card": self.name,
            "log": self.log,
            "rig": {"kind": self.kind, "motion": self.motion,
                    **{one.key: one.value for one in self.rig}},
            "sure": {one.key: one.sure for one in self.rig},
            "else": {one.key: one.rival for one in self.rig if one.rival},
            "signals": {one.name: one.as_json() for one in self.signals},
            "file": dict(self.layout),
            "unused": dict(self.unused),
            "hardly_told": self.hardly,
            "remarks": self.remarks,
            "refused": self.refused or None,
            "axes": self.axes,
            "axis": self.axis,
        }  # fmt: skip


def proposal_for(
    log: UnknownLog, name: str, notation: Notation, axis: str | None = None
) -> Proposal:
    """The card of that name that fits the log best.

    axis: the one of several in the file, or the header of a position. Raises BadLog, one line,
    where no clock is found, no such axis, or no column that moves as a driven body.
    """
    columns = columns_of(log, notation)
    signals, only = remarks.of_axis(columns, axis)
    roles = known_roles(signals, only)
    if roles is None and (own := with_position(columns, signals, only)):
        columns, only = own
        roles = known_roles(columns.signals, only)
    if only is None and (of_sum := without_names(columns, signals, roles)):
        columns, roles = of_sum
    if roles is None:
        raise remarks.no_body(columns)
    remarks.refuse_error(columns, roles)
    remarks.refuse_resting(columns, roles)
    remarks.refuse_sign_bits(columns, roles)
    remarks.refuse_unsigned(columns, roles)
    named = re.sub(r"[^\w.-]+", "-", name).strip("-.") or "machine"
    found = _of_roles(columns, roles, named)
    y = roles.columns["y"].motion
    assert y is not None
    if roles.kind == "motor" and said(roles.columns["u"], "u") >= remarks.SAID_SO:
        share = derivative(y, roles.columns["u"].x).share  # of the command, that is the velocity
        if share > ALL_FOLLOWED:
            remarks.refuse_undriven(columns, roles, share)
        if share > ALL_FOLLOWED and not roles.columns["u"].current:
            return _or_velocity(found, roles, share)
    other = None if roles.other is None else _of_roles(columns, roles.other, named)
    return replace(found, other=other)


def _or_velocity(motor: Proposal, roles: Roles, share: float) -> Proposal:
    """The proposal for a motor whose command is mostly the velocity, or for a valve and cylinder;
    the other of the two is what it would be otherwise."""
    u = roles.columns["u"]
    why = f"{share:.0%} of {u.shown} is the velocity: a valve, or a motor by voltage"

    def of_kind(kind: RigKind, rival: RigKind) -> Proposal:
        first, *rest = motor.rig  # the kind, and what it needs
        first = replace(first, value=kind, sure=False, why=f"{DRIVEN_BY[kind]}; {why}", rival=rival)
        rest = [x for x in rest if kind == "motor" or x.key != "force_per_command"]
        return replace(motor, kind=kind, rig=(first, *rest))

    valve = any(word in u.header.name.casefold() for word in VALVES)
    both = of_kind("motor", "velocity"), of_kind("velocity", "motor")
    return replace(both[valve], other=both[not valve])


def _of_roles(columns: Columns, roles: Roles, name: str) -> Proposal:
    """The card by these roles."""
    other = roles.other
    roles, area = _pressure_beside_force(columns, roles)
    motion = known_motion(roles, columns.read)
    units = guessed_units(columns, roles, motion)
    turns = "" if motion.sure else "linear" if motion.motion == "rotary" else "rotary"
    rig = [
        kind_guess(roles, other),
        RigGuess("motion", motion.motion, "", motion.sure, motion.why, turns),
        *rig_of(columns, roles, motion.motion, units),
    ]
    if area is not None:
        rig.append(area_of(area, roles, units, columns.notation.factor))
    return Proposal(
        log=columns.log.where,
        name=name,
        kind=roles.kind,
        motion=motion.motion,
        layout=columns.log.layout,
        signals=tuple(_signals(columns, roles, units)),
        rig=tuple(rig),
        unused=_unused(columns, roles),
        columns=columns.read,
        remarks=(*columns.log.notes, *remarks.remarks_on(columns, roles, units)),
        axes=columns.axes,
        axis=roles.columns["y"].axis,
        extra=_extra(columns, roles),
    )


def _pressure_beside_force(columns: Columns, roles: Roles) -> tuple[Roles, str | None]:
    """The roles with the pressures that are logged beside a measured force, and the name of the
    one that the force bears, where it is off zero by more than friction."""
    if roles.kind != "force":
        return roles, None
    taken = {one.raw.number for one in roles.columns.values()}
    found = [one for one in columns.signals if one.raw.number not in taken and said(one, "p") > 2.0]
    y = roles.columns["y"]
    assert y.motion is not None
    if len(found) == 2:
        law = force_law(y.motion, y.x, found[0].x - found[1].x)
        ahead = law is None or law.way > 0.0
        pair = dict(zip(("p_p", "p_n"), found if ahead else found[::-1], strict=True))
    elif len(found) == 1:
        balance = roles.law.way * roles.law.balance
        pair = {"p_n" if balance > 0.0 else "p_p": found[0]}
    else:
        return roles, None
    why = dict.fromkeys(pair, "the header says pressure; the chamber by the force's sign")
    added = replace(
        roles,
        columns={**roles.columns, **pair},
        signs={**roles.signs, **dict.fromkeys(pair, 1.0)},
        odds={**roles.odds, **dict.fromkeys(pair, SURE)},
        why={**roles.why, **why},
    )
    bears = abs(roles.law.balance) > remarks.BALANCED * abs(roles.law.coulomb)
    return added, next(iter(pair)) if len(pair) == 1 and bears else None


def _signals(columns: Columns, roles: Roles, units: Mapping[str, UnitGuess]) -> list[SignalGuess]:
    """The card's signals in the usual order."""
    out = []
    found = {"t": columns.clock, **roles.columns}
    behind = remarks.behind_reference(roles)
    exchanged = {"r": "y", "y": "r"} if behind is not None and are_exchanged(behind) else {}
    for name in (name for name in CARD_ORDER if name in found):
        one, unit = found[name], units[name]
        sign = roles.signs.get(name, 1.0)
        gain: float | str | None = unit.gain
        if sign < 0.0:
            gain = -1.0 if gain is None else f"-{gain}"
        odds = SURE if name == "t" else roles.odds[name]
        why = roles.why.get(name, "the header says so")
        if name == "t":
            why = "the time from row to row, summed" if one.summed else "it goes up evenly"
        elif one.summed:
            why = f"the speed, summed over time, {why}"
            own = columns.notation.header(one.raw.header, one.raw.unit_below).unit
            of_speed = own.card if own and own.quantity == "velocity" else f"{unit.unit}/s"
            rival = f"{unit.rival}/s" if unit.rival and not unit.gain else ""
            unit = replace(unit, unit=of_speed, rival=rival)
        if sign < 0.0:
            why += "" if name == "r" else f"; with this sign {sign_shown_by(roles.law)}"
        why += f"; unit {unit.why}"
        sure = bool(odds >= SURE and unit.sure) and name not in exchanged
        rival = "" if sure else _rival(name, odds, unit, roles)
        if name in exchanged:
            rival = found[exchanged[name]].answer
        out.append(
            SignalGuess(name, one.raw.key, one.shown, unit.unit, gain, one.bits, sure, why, rival,
                        one.summed)
        )  # fmt: skip
    return out


def _rival(name: str, odds: float, unit: UnitGuess, roles: Roles) -> str:
    """What a signal would be otherwise: the next column where that is likely, else a unit."""
    other = roles.rivals.get(name)
    if other is not None and (odds < COLUMN_OPEN or not unit.rival):
        return other.answer
    return unit.rival


def _extra(columns: Columns, roles: Roles) -> dict[str, str | int]:
    """Columns that are no signal of this rig, those of other axes first, by a name for each."""
    known = {one.raw.number for one in roles.columns.values()}
    out: dict[str, str | int] = {}
    own = ("", roles.columns["y"].axis)
    others = [one for one in columns.signals if one.raw.number not in known]
    for one in sorted(others, key=lambda one: one.axis in own)[:MOST_EXTRA]:
        name = re.sub(r"\W+", "_", one.raw.header.strip().casefold()).strip("_")
        name = name if name and name not in (*CARD_ORDER, *out) else f"column_{one.raw.number}"
        out[name] = one.raw.key
    return out


def _unused(columns: Columns, roles: Roles) -> dict[str, str]:
    """Columns that the card leaves out, and why."""
    names = {one.raw.number: name for name, one in roles.columns.items()}
    out = {}
    for one in columns.signals:
        name = names.get(one.raw.number, "")
        if name not in CARD_ORDER:
            of_another = one.axis not in ("", roles.columns["y"].axis)
            other = f"of the axis {one.axis}" if of_another else "no signal that a card needs"
            if one.noisy and said(one, "u") >= remarks.SAID_SO:
                other = "noise, which nothing follows: no command"
            out[one.shown] = roles.why.get(name, other)
    shown = {one.raw.number: one.shown for one in columns.read}
    for number, why in columns.left_out.items():
        out[shown[number]] = why
    return out
