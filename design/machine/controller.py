"""The controller that a machine has now, as its card names it under `[controller]`, and the law
that its drive runs.

A gain is a number in SI (with the unit of the command in place of V), or a text with a unit.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from design.drive_law import drive_law
from design.machine.card_table import CardTable, InUnit, NotNegative, Positive
from design.machine.drive import ForceLoop, Present
from design.machine.readable import Display
from design.pid import pd_to_rst, pid_to_rst
from design.present import cascade_to_rst
from design.rst import RST
from identification.errors import BadCard
from identification.log import Rig
from identification.model.estimates import Estimate
from identification.model.plant import over

Kind = Literal["PD", "PID", "P-PI", "RST"]
LAWS: Mapping[Kind, Callable[..., RST]] = {
    "PD": pd_to_rst,
    "PID": pid_to_rst,
    "P-PI": cascade_to_rst,
}


@dataclass(frozen=True)
class CardForceLoop:
    """A force loop: k_i [command per N], T_i, period [s] (None: that of the position loop)."""

    k_i: float
    T_i: float
    period: float | None


@dataclass(frozen=True)
class CardController:
    """What `[controller]` says: gains by name in SI, polynomials of an RST, and what is around it.

    period [s]: None for that of the logs; output: "command" or "force"; rate: of the reference
    [m/s]; forget [s]: of the anti-windup, None for none.
    """

    kind: Kind
    gains: Mapping[str, Estimate]
    polynomials: Mapping[str, tuple[float, ...]]
    period: float | None
    output: Literal["command", "force"]
    force: CardForceLoop | None
    rate: float | None
    forget: float | None


def present(given: CardController, rig: Rig, h: float) -> Present:
    """The controller as the law that the drive runs every h [s], or at its own period.

    One that gives a motor's force is the law of its command. Raises BadSpecification where it is no
    controller, BadCard where it gives a force that the card does not make of a command.
    """
    h = given.period or h
    output, per = given.output, 1.0
    if output == "force" and rig.kind == "motor":
        if not rig.force_per_command:
            raise BadCard('output = "force" needs the force_per_command of the motor')
        output, per = "command", rig.force_per_command
    gains = {name: one.value or 0.0 for name, one in given.gains.items()}
    law = drive_law(rst_of(given.kind, {**gains, **given.polynomials}, h), given.forget, per)
    force = None
    if given.force is not None:
        fast = given.force.period or h
        if abs(round(h / fast) * fast - h) > 1e-6 * h or fast > h:
            raise BadCard(f"force.period_s = {fast:g} s must divide the period of {h:g} s")
        force = ForceLoop(given.force.k_i, given.force.T_i, h / round(h / fast))
    return Present(given.kind, given.gains, output, law, force, given.rate)


def rst_of(kind: Kind, numbers: Mapping[str, Any], h: float) -> RST:
    """The law of a kind every h [s], by its gains in SI, or by an RST's coefficients."""
    if kind == "RST":
        R, S, T = (np.array(numbers[key]) for key in "RST")
        return RST(R, S, T, h)
    return LAWS[kind](**numbers, h=h)


Quantity = Positive | str
QuantityOrNone = NotNegative | str
# Units of the gains; "stiffness" and "damping" are those of what the law gives.
GAIN_UNITS: Mapping[Kind, Mapping[str, str]] = {
    "PD": {"k_d": "stiffness", "T_d": "s", "eps": "s"},
    "PID": {"k_R": "stiffness", "T_i": "s", "T_d": "s", "eps": "s", "b": "1", "c": "1"},
    "P-PI": {"k_v": "1/s", "k_p": "damping", "T_i": "s", "eps": "s", "v_ff": "1"},
    "RST": {},
}


class _ForceSection(CardTable):
    k_i: Quantity
    """command for each N"""
    T_i: Quantity
    """s"""
    period_s: Positive | None = None
    """of the force loop; without it that of the position loop"""


class _Common(CardTable):
    kind: Kind
    """the law"""
    period_s: Positive | None = None
    """sampling period of the position loop, s; without it that of the logs"""
    output: Literal["command", "force"] | None = None
    """what the law gives: the command, or a force (a motor's, or the reference of `force`)"""
    force: _ForceSection | None = None
    """the force loop below"""
    reference_rate: Quantity | None = None
    """largest speed of the reference, m/s or a text"""
    anti_windup_s: NotNegative | Literal["none"] | None = None
    """time in which its sum forgets what a limit cut off; without it T_i"""

    def value(self, rig: Rig, in_unit: InUnit) -> CardController:
        """The controller; in_unit: what reads a text with its unit. Raises BadCard where a
        gain's unit is of another kind."""
        units = Display.of(rig)
        output = self.output or ("command" if self.force is None else "force")
        if self.force is not None and (rig.kind == "motor" or output == "command"):
            raise BadCard(
                "controller.force: a force loop takes the force that the position controller asks"
                ' for, output = "force"; a motor has none'
            )
        given = units.force if output == "force" else units.command
        stiffness = over(given, units.position)
        of_law = {"stiffness": stiffness, "damping": _times_second(stiffness)}
        gains = dict[str, Estimate]()
        for name, of in GAIN_UNITS[self.kind].items():
            unit = of_law.get(of, of)
            gains[name] = Estimate(_quantity(in_unit, getattr(self, name), unit, name), unit)
        loop = None
        if self.force is not None:
            k_i = _quantity(in_unit, self.force.k_i, units.force_gain, "force.k_i")
            T_i = _quantity(in_unit, self.force.T_i, "s", "force.T_i")
            loop = CardForceLoop(k_i, T_i, self.force.period_s)
        forget = self.anti_windup_s
        if forget is None and "T_i" in gains:
            forget = gains["T_i"].value
        rate: float | None = None
        if self.reference_rate is not None:
            rate = _quantity(in_unit, self.reference_rate, units.velocity, "reference_rate")
        return CardController(
            kind=self.kind,
            gains=gains,
            polynomials={key: getattr(self, key) for key in "RST" if hasattr(self, key)},
            period=self.period_s,
            output=output,
            force=loop,
            rate=rate,
            forget=None if isinstance(forget, str) else forget,
        )


class PresentPD(_Common):
    """A PD as a card writes it."""

    kind: Literal["PD"]
    """k_d (1 + T_d s/(eps s + 1)) (r - y)"""
    k_d: Quantity
    """number in SI with the command's unit for V, or a text (`"8 A/mm"`)"""
    T_d: QuantityOrNone
    """s, or a text"""
    eps: Quantity
    """s, or a text"""


class PresentPID(_Common):
    """A PID as a card writes it."""

    kind: Literal["PID"]
    """k_R (b r - y + (r - y)/(T_i s) + T_d s/(eps s + 1) (c r - y))"""
    k_R: Quantity
    """as `k_d`"""
    T_i: Quantity
    """s, or a text"""
    T_d: QuantityOrNone
    """s, or a text"""
    eps: Quantity
    """s, or a text"""
    b: NotNegative = 1.0
    """share of the reference in the proportional term"""
    c: NotNegative = 1.0
    """share of the reference in the derivative"""


class PresentPPI(_Common):
    """A position P above a speed PI as a card writes it."""

    kind: Literal["P-PI"]
    """k_p (1 + 1/(T_i s)) (v_ref - v), v_ref = k_v (r - y) + v_ff dr/dt"""
    k_v: Quantity
    """1/s, or a text"""
    k_p: Quantity
    """command for each m/s, or a text (`"120 A s/m"`)"""
    T_i: Quantity
    """s, or a text"""
    eps: QuantityOrNone = 0.0
    """v is the difference of y behind 1/(eps s + 1)"""
    v_ff: NotNegative = 0.0
    """share of the reference's speed that is fed forward"""


class Polynomials(CardTable):
    """Those of an RST."""

    R: tuple[float, ...] = Field(min_length=1)
    """coefficients in z^-1"""
    S: tuple[float, ...] = Field(min_length=1)
    """coefficients in z^-1"""
    T: tuple[float, ...] = Field(min_length=1)
    """coefficients in z^-1"""


class PresentRST(Polynomials, _Common):
    """An RST as a card writes it."""

    kind: Literal["RST"]
    """S u = T r - R y"""


ControllerSection = Annotated[
    PresentPD | PresentPID | PresentPPI | PresentRST, Field(discriminator="kind")
]


def _times_second(stiffness: str) -> str:
    """The unit over a speed, of one over a length."""
    above, _, length = stiffness.rpartition("/")
    return f"s/{length}" if above in ("", "1") else f"{above} s/{length}"


def _quantity(in_unit: InUnit, written: float | str, unit: str, name: str) -> float:
    """The number in `unit`; raises BadCard where it is none, or below 0."""
    value = in_unit(written, unit, f"controller.{name}")
    assert value is not None
    if value < 0.0:
        raise BadCard(f"controller.{name} = {written!r}: must be >= 0")
    return value
