"""A position controller as its drive runs it: one difference equation, its output what the drive
takes, with saturation and anti-windup in it.

Every h [s], with r, y the reference and the position and c the output, held within +- limit,

    W c_free = T r - R y + (W - S) c,      c = c_free, clipped

where S and W begin with 1. A controller that is not clipped has c = c_free and S c = T r - R y; one
that is forgets, as W says, what was not carried out. A friction compensator's part is added to
c_free before it is clipped and taken off c again. Above a force loop c is the force reference, and
where the loop's command is clipped the one that gives this command.
"""

import math
from dataclasses import dataclass

import numpy as np

from design.polynomial import INTEGRATOR, divide, trim
from design.rst import RST
from identification.arrays import Array
from identification.errors import BadSpecification


@dataclass(frozen=True)
class DriveLaw:
    """The difference equation: R, S, T, W in ascending powers of z^-1, run every h [s].

    R, T: output for each unit of y and r; S, W: of one length, S[0] = W[0] = 1.
    Raises BadSpecification where they are not.
    """

    R: tuple[float, ...]
    S: tuple[float, ...]
    T: tuple[float, ...]
    W: tuple[float, ...]
    h: float

    def __post_init__(self) -> None:
        if len(self.S) != len(self.W) or self.S[:1] != (1.0,) or self.W[:1] != (1.0,):
            raise BadSpecification(
                f"S of {len(self.S)} values from {self.S[:1]}, W of {len(self.W)} from"
                f" {self.W[:1]}; both need one length and begin with 1"
            )
        _ = self.rst

    @property
    def rst(self) -> RST:
        """The controller while it is not clipped."""
        return RST(np.array(self.R), np.array(self.S), np.array(self.T), self.h)


def drive_law(
    controller: RST,
    forget: float | None,
    per_output: float = 1.0,
    W: tuple[float, ...] | None = None,
) -> DriveLaw:
    """The law of a controller whose output is asked for in units of `per_output` of its own.

    forget [s]: see `forgetting`; W: in its place; per_output: a motor's k_a, of a controller that
    gives a force. Raises BadSpecification where the controller has a tracking model, or W another
    length than S (which has three values at least).
    """
    if controller.A_m.size > 1 or controller.B_m.size > 1:
        raise BadSpecification("a drive's law has no tracking model; put B_m/A_m before it")
    first = float(controller.S[0])
    size = max(controller.R.size, controller.S.size, 3)
    S = np.pad(controller.S, (0, size - controller.S.size)) / first
    R, T = (c / (first * per_output) for c in (controller.R, controller.T))
    W = W or _tuple(forgetting(S, forget, controller.h))
    return DriveLaw(_tuple(R), _tuple(S), _tuple(T), W, controller.h)


def _tuple(values: Array) -> tuple[float, ...]:
    return tuple(values.tolist())


def forgetting(S: Array, time: float | None, h: float) -> Array:
    """W (n,) for S (n,): its integrators, poles at z = 1, replaced by ones that decay.

    time [s]: in which they decay; 0: all poles of W at z = 0, so that what was not carried out is
    forgotten at once; None: W = S, it never is.
    Source: Astrom & Wittenmark, Computer-Controlled Systems, section 9.4 (observer polynomial).
    """
    if time is None:
        return S
    if time == 0.0:
        return np.where(np.arange(len(S)) == 0, 1.0, 0.0)
    left, forgetting = trim(S), np.ones(1)
    while left.size > 1 and abs(left.sum()) < 1e-9 * np.abs(left).sum():
        left = divide(left, INTEGRATOR)[0]
        forgetting = np.convolve(forgetting, [1.0, -math.exp(-h / time)])
    W = np.convolve(left, forgetting)
    W[0] = 1.0  # but for the rounding of the division
    return np.pad(W, (0, len(S) - len(W)))
