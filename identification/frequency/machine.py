"""Frequency responses of a machine from its logs: of the body by its force, of its controller.

The body is linear but for friction. Where that is known it is taken off the force first, and the
force that is left and the motion are those of a linear body. The reference, where there is one, is
the instrument: what noise of the position makes of the force through the loop does not follow it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.frequency.estimate import Response, Spectra, joined, responses
from identification.frequency.stretches import (
    Band,
    ComplexArray,
    bands,
    coefficients,
    hold,
    second_derivative,
)


SIGNALS = ("a", "linear", "F", "r", "F_2")


@dataclass(frozen=True, eq=False)
class Recording:
    """One run every h [s], (n,) each: position y [m], applied force F [N], what is left of it
    without friction [N], reference r [m] or None.

    held: the forces are commands, held over each period.
    """

    h: float
    y: Array
    F: Array
    linear: Array
    r: Array | None
    held: bool

    @property
    def duration(self) -> float:
        """[s]."""
        return self.h * len(self.y)


@dataclass(frozen=True, eq=False)
class MachineResponses:
    """What the logs show at f [Hz]: acceleration by force [1/kg] without friction and with it, and
    the controller from the position to the force that counters it [N/m]; stretches: lengths [s].

    controller is None without a reference, or where the runs tell it nowhere. instrument: whether
    the reference was one.
    """

    body: Response
    with_friction: Response
    controller: Response | None
    instrument: bool
    stretches: tuple[float, ...]

    @property
    def f(self) -> Array:
        """Frequencies [Hz], (k,)."""
        return self.body.f

    @property
    def position(self) -> Response:
        """Position by force [m/N]."""
        return self.body.times(-1.0 / (2.0 * np.pi * self.f) ** 2 + 0j)

    @property
    def velocity(self) -> Response:
        """Velocity by force [m/(N s)]."""
        return self.body.times(1.0 / (2j * np.pi * self.f))


def machine_responses(
    runs: Sequence[Recording], lowest: float | None = None
) -> MachineResponses:
    """The responses by the spectra of all runs together; see `stretches.bands` for the frequencies.

    lowest [Hz]: that is asked for. Raises BadSpecification, NotIdentifiable where the runs are too
    short.
    """
    cut = bands([one.duration for one in runs], [one.h for one in runs], lowest)
    instrument = all(one.r is not None and np.ptp(one.r) > 0.0 for one in runs)
    each = [_in_band(runs, band, instrument) for band in cut]
    body, with_friction = (joined([found[j] for found in each]) for j in (0, 1))
    controller = joined([found[2] for found in each]) if instrument else None
    if controller is not None and not np.any(controller.seen):
        controller = None
    lengths = tuple(band.length for band in cut)
    return MachineResponses(body, with_friction, controller, instrument, lengths)


def _in_band(runs: Sequence[Recording], band: Band, instrument: bool) -> list[Response]:
    """Acceleration by force without friction, with it, and the controller, in one band."""
    names = SIGNALS if instrument else SIGNALS[:3]
    m = len(names)
    S, stretches = np.zeros((len(band.f), m, m), dtype=np.complex128), np.zeros(len(band.f))
    for one in runs:
        each = [_coefficients(one, band, name) for name in names]
        stretches += np.count_nonzero(each[0], axis=0)
        x = np.stack(each, axis=2)
        S += np.einsum("ska,skb->kab", np.conj(x), x)
    spectra = Spectra(band.f, names, S, stretches)
    Z = ["r"] if instrument else []
    out = [responses(spectra, "a", [one], Z)[0] for one in ("linear", "F")]
    if instrument:
        # F = T r - R y: all have a motion's steep spectrum, so second derivatives are taken.
        out.append(responses(spectra, "F_2", ["r", "a"])[1].times(-np.ones(1)))
    return out


def _coefficients(one: Recording, band: Band, name: str) -> ComplexArray:
    """Of a run's stretches, (s, k): the forces, the accelerations of position and reference, and
    the second derivative of the force."""
    held = hold(band.f, one.h) if one.held else 1.0
    if name == "a":
        return second_derivative(one.y, one.h, band)
    if name == "r":
        assert one.r is not None
        return second_derivative(one.r, one.h, band)
    if name == "F_2":
        return second_derivative(one.F, one.h, band) * held
    # As long as a second difference of them.
    return coefficients((one.F if name == "F" else one.linear)[1:-1], one.h, band) * held
