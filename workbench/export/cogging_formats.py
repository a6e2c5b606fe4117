"""Cogging by its orders and over one turn, and in the format of a drive."""

import numpy as np

from design.compensation_tables import TURN_POINTS, Harmonic, is_cogging, summed
from identification.errors import BadModel
from workbench.cards.readable import number, shown_unit
from workbench.export.compensation import Compensation, Content, Cost, Format

AX8000_HARMONICS = 9
AX8000_HIGHEST = 200  # order n of an object 32CB
WHOLE_ORDER = 0.02  # by which an order may miss a whole number: 2 % of a period over one turn
FIRST_OBJECT = 7  # subindex of the first n; phi and r follow it
UNSAID = (
    "AX8000: the manual does not say whether phi is of a cosine, nor the sign of r; the file has r"
    " cos(n angle - phi) as the torque that the motor adds. Compare 3241:0C with the table on a"
    " slow turn before you rely on it"
)
NO_COGGING_TABLE = {
    "sinumerik": "sinumerik: no cogging table is written, as no public page says its format;"
    " take the CSV",
    "linuxcnc": "linuxcnc: it has no cogging table; take the CSV",
    "codesys": "codesys: SoftMotion has no cogging table; --to st writes cogging into the"
    " feed-forward",
}


def cogging_csv(what: Compensation) -> Content:
    """Order, period, amplitude and phase of each wave."""
    unit, factor = shown_unit("rad" if what.rotary else "m")
    waves = known_harmonics(what)
    rows = [
        [f"{value:.9g}" for value in (what.turn / one.period, factor * one.period, one.amplitude,
                                      np.degrees(one.phase))]
        for one in waves
    ]  # fmt: skip
    turn = f"{number(factor * what.turn, 6)} {unit}, {what.turn_words}"
    values = {"rows": rows, "unit": unit, "force": what.force_unit, "turn": turn}
    units = f"{what.force_unit}, deg, {unit} of the axis"
    return Content(units, len(rows), values=values, remarks=_unidentified(what))


def turn_csv(what: Compensation) -> Content:
    """The force of cogging over one turn, and the one that compensates it."""
    unit, factor = shown_unit("rad" if what.rotary else "m")
    y = what.turn * np.arange(TURN_POINTS) / TURN_POINTS
    force = summed(known_harmonics(what), y)
    rows = [[f"{v:.9g}" for v in row] for row in zip(factor * y, force, -force, strict=True)]
    values = {"rows": rows, "unit": unit, "force": what.force_unit, "turn": what.turn_words}
    units = f"{unit}, {what.force_unit} of the axis"
    return Content(units, TURN_POINTS, values=values, remarks=_unidentified(what))


def ax8000_cogging(what: Compensation) -> Content:
    """Objects 32CB of a drive AX8000: up to nine harmonics of a turn of the motor."""
    motor = what.at_motor
    if not motor.turns:
        raise BadModel(
            "the cogging objects of an AX8000 count in turns of the motor; give the travel of the"
            " axis in one by --per-turn"
        )
    fitting, left = list[tuple[int, Harmonic]](), list[Harmonic]()
    for one in known_harmonics(what):
        order = round(what.turn / one.period)
        whole = abs(what.turn / one.period - order) <= WHOLE_ORDER and 0 < order <= AX8000_HIGHEST
        if whole and len(fitting) < AX8000_HARMONICS:
            fitting.append((order, one))
        else:
            left.append(one)
    if not fitting:
        orders = ", ".join(number(what.turn / one.period) for one in left)
        raise BadModel(
            f"{what.model.card}: its cogging has orders {orders} of {what.turn_words}, none of them"
            f" whole from 1 to {AX8000_HIGHEST}; give the travel in one turn by --per-turn"
        )
    costs = tuple(
        Cost(f"cogging of order {number(what.turn / one.period, 4)}: not compensated, up to",
             one.amplitude)
        for one in left
    )  # fmt: skip
    rows = [
        row for at, (order, one) in enumerate(fitting) for row in _objects(what, at, order, one)
    ]
    values = {"rows": rows, "motor": motor.words}
    said = (what.at, UNSAID)
    return Content("N m, deg", len(fitting), None, values, costs, _unidentified(what), said)


COGGING = (
    Format("cogging.csv", "cogging-table", "", "any program that reads CSV", cogging_csv),
    Format("cogging_turn.csv", "cogging-table", "", "any program that reads CSV", turn_csv),
    Format("ax8000_cogging.csv", "cogging-table", "twincat",
           "TwinCAT drive AX8000: startup list or objects 0x32CB", ax8000_cogging),
)  # fmt: skip


def _objects(what: Compensation, at: int, order: int, one: Harmonic) -> list[tuple[str, ...]]:
    """The three objects of a harmonic: what the motor adds is the negative of the cogging."""
    phase = (np.degrees(one.phase) + 180.0) % 360.0
    values = (str(order), f"{phase:.9g}", f"{what.at_motor.travel * one.amplitude:.9g}")
    first = FIRST_OBJECT + 3 * at
    kinds = (("", "n"), ("deg", "phi"), ("N m", "r"))
    return [
        (f"0x{first + k:02X}", value, unit, f"Cogging compensation Coef {at} {name}")
        for k, (value, (unit, name)) in enumerate(zip(values, kinds, strict=True))
    ]


def known_harmonics(what: Compensation) -> tuple[Harmonic, ...]:
    """The waves of the cogging; raises BadModel where the model has none."""
    if not what.harmonics:
        if any(is_cogging(one) for one in what.model.acting):
            why = "; ".join(_unidentified(what))
            raise BadModel(f"{what.model.card}: no cogging table, as {why}")
        raise BadModel(
            f"{what.model.card}: the model has no cogging, so there is no cogging table; 'workbench"
            " trace' searches for one"
        )
    return what.harmonics


def _unidentified(what: Compensation) -> tuple[str, ...]:
    """Lines on what of the cogging no log identifies."""
    return tuple(line for line in what.unidentified_places if line.startswith("cogging"))
