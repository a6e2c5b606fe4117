"""A servo as a `Program`: the step of its kernels, with the names of the paper."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from design.feed_forward import FeedForward
from design.kernel_reader import KernelReader, NamedArray, as_expression
from design.program import (
    Assign,
    Constant,
    Element,
    Kind,
    NamedConstant,
    Program,
    Signal,
    State,
    Table,
    Variable,
    expressions,
)
from design.servo import Compensation, Servo, servo_law, servo_memory
from design.servo_kernels import PID_LAW, SCHEDULED_LAW, Law, Memory, servo_step
from identification.arrays import Array
from identification.errors import BadModel
from identification.model.karnopp import NAMES


@dataclass(frozen=True)
class ProgramUnits:
    """Units of position, force and command."""

    position: str = "m"
    force: str = "N"
    command: str = "V"

    @property
    def speed(self) -> str:
        """Unit of the velocity."""
        return f"{self.position}/s"


COMPENSATOR_SLOTS = (*NAMES, "dv_p1", "dv_n1", "e_T", "inner", "stick")
FEED_FORWARD_SLOTS = ("F_cp", "F_cn", "F_vp", "F_vn", "band", "m", "F_most")
PID_SLOTS = ("k_R", "h_per_T_i", "T_d_per_eps", "exp_h_eps", "zone", "rule")
LAW_TABLES = {
    "R": ("poly_R", "R of S F_ref = T r - R y, ascending powers of z^-1"),
    "S": ("poly_S", "S of the same"),
    "W": ("poly_W", "W u = T r - R y + (W - S) taken: forgets what was not carried out"),
    "b_r": ("poly_T", "T r, T B_m/A_m: what the position controller makes of its reference"),
    "a_r": ("den_T", "denominator of the same"),
    "b_v": ("b_v", "velocity v, eq. (5), of the position behind filter A"),
    "a_v": ("a_v", "denominator of the same"),
    "b_e": ("b_e", "position behind filter B, of which the error e_y is taken"),
    "a_e": ("a_e", "denominator of the same"),
    "b_c": ("b_c", "F_compf: filter C of the compensator's force"),
    "a_c": ("a_c", "denominator of the same"),
    "knots": ("points", "of what the schedule goes over"),
    "rows": ("schedule", "at each point F_cp, F_cn, F_vp, F_vn, R(1), T', R', S'[1..]"),
}
OF_FEED_FORWARD = {
    "b_v": ("b_v", "velocity of the reference"),
    "b_e": ("b_a", "acceleration of the reference"),
    "z_v": ("z_v", "state of the reference's velocity"),
    "z_e": ("z_a", "state of its acceleration"),
}
STATE_ARRAYS: Mapping[str, tuple[str, str]] = {
    "x": ("x", "state of S F_ref = T r - R y in observer form"),
    "z_r": ("z_r", "state of T"),
    "z_v": ("z_v", "state of filter A and the slope (5)"),
    "z_e": ("z_e", "state of filter B"),
    "z_c": ("z_c", "state of filter C"),
    "now": ("now", "active row of the schedule"),
}
STATE_SLOTS: Mapping[str, tuple[tuple[str, str], ...]] = {
    "pid": (
        ("pid_sum", "sum of the error over T_i"),
        ("pid_slope", "filtered slope of the error times T_d"),
        ("pid_error", "error of the sample before"),
    ),
    "pid of a schedule": (
        ("u_base", "what was asked for before, as far as it was carried out"),
        ("r_last", "reference of the sample before, as it was moved"),
        ("y_last", "position of the sample before"),
    ),
    "last": (
        ("F_ref", "what the position controller asks for"),
        ("F_comp", "force of the compensator, eqs. (1), (3) and (4)"),
        ("F_compf", "the same behind filter C"),
        ("v", "velocity, eq. (5)"),
    ),
    "last of a feed-forward": (
        ("F_ref", "what the position controller asks for"),
        ("a_ref", "acceleration of the reference"),
        ("F_ff", "force of the feed-forward"),
        ("v_ref", "velocity of the reference"),
    ),
    "past": (
        ("r_moved", "reference, moved at its limited speed"),
        ("integral", "sum of the force loop's error"),
        ("u_before", "command of the sample before, of which the motor's force is known"),
        ("r_step", "what the reference moved in the sample before"),
        ("r_before", "reference of the sample before, as it was given"),
        ("r_pace", "what that moved in its own sample"),
        ("r_turn", "by how much this had changed"),
        ("r_goes", "what the reference moves in a sample, where it does so smoothly"),
    ),
    "turn": (("turn", "samples since the position controller had its turn"),),
}


def controller_program(
    name: str, servo: Servo, h: float, units: ProgramUnits, k_a: float = 0.0
) -> Program:
    """The servo's step as `design.servo.simulate_servo` runs it every h [s].

    name: of the machine; k_a: of a motor [N per unit of the command], else 0. Raises BadModel
    where the servo has a dither, or another countermeasure than the compensator.
    """
    if servo.dither is not None or not isinstance(
        servo.friction, Compensation | FeedForward | None
    ):
        raise BadModel("a program has no dither, and no friction observer; take it out")
    ahead = isinstance(servo.friction, FeedForward)
    law = servo_law(servo, h, k_a)
    memory = servo_memory(servo, law, 1.0, 0.0)
    inputs = (
        Signal("r", units.position, "reference"),
        Signal("y", units.position, "measured position"),
        Signal("F_e", units.force, "measured force on the body"),
    )
    output = Signal("u", units.command, "command")
    known = _named_law(law, ahead)
    kinds = _Kinds(ahead, law.position == SCHEDULED_LAW)
    cells = _named_memory(memory, kinds)
    taken = {one.name for one in (*known, *cells) if isinstance(one, NamedArray)}
    slots = {slot for one in (*known, *cells) if isinstance(one, NamedArray) for slot in one.slots}
    named = {one.name for one in known if isinstance(one, Constant)}
    reader = KernelReader([one.name for one in inputs], taken | slots | named)
    given = [Variable(one.name) for one in inputs]
    result = as_expression(reader.read(servo_step, (Law(*known), Memory(*cells), *given, 0.0)))
    statements = tuple(reader.statements)
    if result != Variable(output.name):
        statements = (*statements, Assign(Variable(output.name), result))
    used = list(expressions(statements))
    constants = {one.name: one.value for one in used if isinstance(one, Constant)}
    names = {one.array if isinstance(one, Element) else one.name for one in used
             if isinstance(one, Element | Variable)}  # fmt: skip
    meanings = _constant_meanings(units)
    return Program(
        name=name,
        h=h,
        ratio=law.ratio,
        inputs=tuple(one for one in inputs if one.name in names or one.name != "F_e"),
        output=output,
        constants=tuple(
            NamedConstant(each, value, *meanings[each]) for each, value in constants.items()
        ),
        tables=tuple(
            Table(one.name, one.values, one.meaning)
            for one in known
            if isinstance(one, NamedArray) and one.name in names
        ),
        states=tuple(one for one in _states(memory, kinds) if one.name in names),
        locals=tuple(one for one in reader.locals.values() if one.name != output.name),
        statements=statements,
    )


def _named_law(law: Law, ahead: bool) -> list[Any]:
    """The law's values under the names of the program; what chooses between equations stays.

    ahead: whether it has a feed-forward.
    """
    tables = {**LAW_TABLES, **OF_FEED_FORWARD} if ahead else LAW_TABLES
    found: list[Any] = []
    for field, value in law._asdict().items():
        if field in tables:
            name, meaning = tables[field]
            found.append(NamedArray(name, len(value), meaning, tuple(value.tolist())))
        elif field == "law" and ahead:
            meaning = "F_ff: m a + friction of the reference's motion"
            found.append(_slotted("feed_forward", value, FEED_FORWARD_SLOTS, meaning))
        elif field == "law" and len(value) > 1:
            meaning = "F_comp: friction compensator, eqs. (1), (3) and (4)"
            found.append(_slotted("compensator", value, COMPENSATOR_SLOTS, meaning))
        elif field == "pid" and law.position == PID_LAW:
            found.append(_slotted("pid", value, PID_SLOTS, ""))
        elif isinstance(value, float):
            found.append(Constant(field, value))
        else:
            found.append(value)
    return found


def _slotted(name: str, value: Array, slots: tuple[str, ...], meaning: str) -> NamedArray:
    return NamedArray(name, len(slots), meaning, tuple(value.tolist()), slots)


class _Kinds(NamedTuple):
    """Whether a program has a feed-forward, and a schedule: its states then mean other things."""

    ahead: bool
    scheduled: bool

    @property
    def arrays(self) -> Mapping[str, tuple[str, str]]:
        """Names and meanings of the states that are arrays."""
        return {**STATE_ARRAYS, **OF_FEED_FORWARD} if self.ahead else STATE_ARRAYS

    def slots(self, field: str) -> tuple[tuple[str, str], ...]:
        """Names and meanings of the entries of another state."""
        own = {"last": "last of a feed-forward"} if self.ahead else {}
        own |= {"pid": "pid of a schedule"} if self.scheduled else {}
        return STATE_SLOTS.get(own.get(field, field), ())


def _named_memory(memory: Memory, kinds: _Kinds) -> list[Any]:
    found: list[Any] = []
    for field, value in memory._asdict().items():
        if field in kinds.arrays:
            name, meaning = kinds.arrays[field]
            found.append(NamedArray(name, len(value), meaning))
        else:
            slots = tuple(name for name, _ in kinds.slots(field))
            found.append(NamedArray(field, len(value), "", (), slots, field == "turn"))
    return found


def _states(memory: Memory, kinds: _Kinds) -> Iterator[State]:
    """The states that a program may have, at rest at position 1."""
    for field, value in memory._asdict().items():
        if field in kinds.arrays:
            name, meaning = kinds.arrays[field]
            yield State(name, "real", tuple(value.tolist()), True, meaning)
        for at, (name, meaning) in enumerate(kinds.slots(field)):
            whole = np.issubdtype(value.dtype, np.integer)
            kind: Kind = "integer" if whole else "real"
            yield State(name, kind, (float(value[at]),), False, meaning)


def _constant_meanings(units: ProgramUnits) -> Mapping[str, tuple[str, str]]:
    """Unit and meaning of every constant that a program may have."""
    force, speed = units.force, units.speed
    per_speed = f"{force} s/{units.position}"
    return {
        "F_cp": (force, "Coulomb friction, v > 0"),
        "F_cn": (force, "Coulomb friction, v < 0"),
        "F_vp": (per_speed, "viscous friction that the compensator adds, v > 0"),
        "F_vn": (per_speed, "viscous friction that the compensator adds, v < 0"),
        "dv_p": (speed, "upper limit of the band of sticking"),
        "dv_n": (speed, "lower limit of the band of sticking"),
        "F_sp": (force, "stick limit, upper"),
        "F_sn": (force, "stick limit, lower"),
        "dv_p1": (speed, "upper limit of the narrow band, dv_p/N_c"),
        "dv_n1": (speed, "lower limit of the narrow band, dv_n/N_c"),
        "e_T": (units.position, "error at which the zero-velocity term is full"),
        "k_R": (f"{force}/{units.position}", "gain of the PID"),
        "h_per_T_i": ("1", "h/T_i"),
        "T_d_per_eps": ("1", "T_d/eps"),
        "exp_h_eps": ("1", "e^(-h/eps)"),
        "zone": (units.position, "error that is not summed"),
        "k_i": (f"{units.command}/{force}", "gain of the force loop, eq. (9)"),
        "k_int": (f"{units.command}/{force}", "k_i h/T_i"),
        "k_a": (f"{force}/{units.command}", "force of the motor by its command"),
        "limit": (units.command, "largest command"),
        "force_limit": (force, "largest force reference"),
        "rate": (units.position, "what the reference moves in a sample at most"),
        "acceleration": (units.position, "by how much that changes in a sample at most"),
        "band": (
            speed,
            "speed of the reference from which Coulomb friction is fed forward in full",
        ),
        "m": (f"{force} s^2/{units.position}", "mass that is fed forward"),
        "F_most": (force, "most that is fed forward"),
        "h": ("s", "period of the position controller"),
        "decay": ("1", "of what was not carried out, a sample later"),
        "span": (units.position, "step of the reference from which its direction is known"),
    }
