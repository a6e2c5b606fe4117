"""The controller that a machine has now, as its card says it, and the law that its drive runs."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from design.drive_law import drive_law
from design.machine.drive import ForceLoop, Present
from design.pid import pd_to_rst, pid_to_rst
from design.present import cascade_to_rst
from design.rst import RST
from identification.errors import BadCard
from identification.log import Rig
from identification.model.estimates import Estimate

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
