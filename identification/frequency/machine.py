"""Frequency responses of a machine from its logs: of the body by its force, of its controller.

The body is linear but for friction. Where that is known it is taken off the force first, and the
force that is left and the motion are those of a linear body. The reference, where there is one, is
the instrument: what noise of the position makes of the force through the loop does not follow it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.frequency.estimate import (
    Response,
    Spectra,
    cross_spectra,
    joined,
    responses,
)
from identification.frequency.stretches import (
    Band,
    ComplexArray,
    bands,
    coefficients,
    hold,
    second_derivative,
)


@dataclass(frozen=True, eq=False)
class Recording:
    """One run every h [s], (n,) each: position y [m], applied force F [N], what is left of it
    without friction [N], reference r [m] or None.

    zoh: the forces are commands, constant over each period.
    """

    h: float
    y: Array
    F: Array
    linear: Array
    r: Array | None
    zoh: bool

    @property
    def duration(self) -> float:
        """[s]."""
        return self.h * len(self.y)


@dataclass(frozen=True, eq=False)
class MachineResponses:
    """What the logs show at f [Hz]: acceleration over force [1/kg] without friction and with it,
    and the controller from the position to the force that counters it [N/m]; stretches: lengths
    [s].

    controller is None without a reference, or where the runs identify it nowhere. instrument:
    whether the reference was one.
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
        """Position over force [m/N]."""
        return self.body.times(-1.0 / (2.0 * np.pi * self.f) ** 2 + 0j)

    @property
    def velocity(self) -> Response:
        """Velocity over force [m/(N s)]."""
        return self.body.times(1.0 / (2j * np.pi * self.f))


def machine_responses(runs: Sequence[Recording], lowest: float | None = None) -> MachineResponses:
    """The responses by the spectra of all runs together; see `stretches.bands` for the frequencies.

    lowest [Hz]: that is asked for. Raises BadSpecification, NotIdentifiable where the runs are too
    short.
    """
    every_band = cut(runs, lowest)
    instruments = instruments_of(runs)
    names = ("a", "linear", "F", "r", "F_2") if instruments else ("a", "linear", "F")
    every = [spectra_of(runs, band, names) for band in every_band]
    body, with_friction = (
        joined([responses(one, "a", [force], instruments)[0] for one in every])
        for force in ("linear", "F")
    )
    controller = None
    if instruments:
        # F = T r - R y: all have a motion's steep spectrum, so second derivatives are taken.
        found = joined([responses(one, "F_2", ["r", "a"])[1] for one in every])
        controller = found.times(-np.ones(1)) if np.any(found.seen) else None
    lengths = tuple(band.length for band in every_band)
    return MachineResponses(body, with_friction, controller, bool(instruments), lengths)


def body_by_force(runs: Sequence[Recording], lowest: float | None = None) -> Response:
    """Acceleration over force without friction alone, as `machine_responses` has it."""
    instruments = instruments_of(runs)
    names = ("a", "linear", "r") if instruments else ("a", "linear")
    each = [spectra_of(runs, band, names) for band in cut(runs, lowest)]
    return joined([responses(one, "a", ["linear"], instruments)[0] for one in each])


def cut(runs: Sequence[Recording], lowest: float | None = None) -> list[Band]:
    """The bands of frequencies and their stretches, as `stretches.bands` has them."""
    return bands([one.duration for one in runs], [one.h for one in runs], lowest)


def instruments_of(runs: Sequence[Recording]) -> tuple[str, ...]:
    """The reference, where every run has one that moves."""
    return ("r",) if all(one.r is not None and np.ptp(one.r) > 0.0 for one in runs) else ()


def spectra_of(runs: Sequence[Recording], band: Band, names: tuple[str, ...]) -> Spectra:
    """Cross spectra of the signals over the stretches of all runs."""
    each = ([coefficients_of(one, band, name) for name in names] for one in runs)
    return cross_spectra(band, names, each)


def coefficients_of(one: Recording, band: Band, name: str) -> ComplexArray:
    """Of a run's stretches, (s, k): the forces, the accelerations of position and reference, and
    the second derivative of the force."""
    zoh = hold(band.f, one.h) if one.zoh else 1.0
    if name == "a":
        return second_derivative(one.y, one.h, band)
    if name == "r":
        assert one.r is not None
        return second_derivative(one.r, one.h, band)
    if name == "F_2":
        return second_derivative(one.F, one.h, band) * zoh
    # As long as a second difference of them.
    return coefficients((one.F if name == "F" else one.linear)[1:-1], one.h, band) * zoh
