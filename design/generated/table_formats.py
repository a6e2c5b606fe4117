"""Friction, cogging and backlash in the formats of controls, each by a template of its own."""

from functools import partial

import numpy as np

from design.compensation_tables import (
    TURN_POINTS,
    Harmonic,
    Points,
    is_cogging,
    spread_points,
    summed,
    table_points,
)
from design.generated.compensation import (
    IDENTIFIED_BY_SLIDING,
    Compensation,
    Content,
    Cost,
    Format,
    friction_costs,
)
from design.machine.readable import number
from identification.arrays import Array
from identification.errors import BadModel
from identification.model.estimates import Estimate

NEUTRAL_POINTS = 40
CNC_POINTS = 20  # P-COMP-00062: the default upper limit, of which (0, 0) takes one
CNC_PARTS = 1000  # of 0.1 %: its torque is a whole number, which scaling_factor 1 divides by
SINAMICS_POINTS = 10
CURVE_OF_HAL = 16  # points of lincurve, half of them each way
CNC_SPEED = {False: (1e6, "0.001 mm/s"), True: (180e3 / np.pi, "0.001 deg/s")}
NO_FRICTION_TABLE = (
    "codesys: SoftMotion has no friction table; --to st writes the feed-forward as a block"
)


def unsigned(what: Compensation, most: int) -> Points:
    """The mean of both ways at rising speeds."""
    curve = what.friction
    return table_points(curve.mean, curve.speeds, most)


def both_ways(what: Compensation, most_each: int) -> tuple[Array, Array, float]:
    """Velocities, rising from the fastest in negative direction, the friction there with its sign,
    and the largest relative error; straight through 0 between the lowest speeds."""
    curve = what.friction
    up = table_points(curve.positive, curve.speeds, most_each)
    down = table_points(curve.negative, curve.speeds, most_each)
    v = np.concatenate([-down.x[::-1], up.x])
    F = np.concatenate([-down.y[::-1], up.y])
    return v, F, max(up.error, down.error)


def friction_csv(what: Compensation) -> Content:
    """Speed, and the force that each direction needs, for any control."""
    curve, (unit, factor) = what.friction, what.display.shown("velocity")
    ways = (curve.positive, curve.negative)
    found = [table_points(one, curve.speeds, NEUTRAL_POINTS // 2) for one in ways]
    v = np.unique(np.concatenate([one.x for one in found]))
    rows = zip(factor * v, curve.positive(v), -curve.negative(v), strict=True)
    return _content(
        what, f"{unit}, {what.display.force} of the axis", len(v), max(one.error for one in found),
        signed=True, speed=unit, force=what.display.force,
        rows=[[f"{one:.9g}" for one in row] for row in rows],
    )  # fmt: skip


def twincat_cnc(what: Compensation) -> Content:
    """`frict_comp.*` of a compensation value list of TwinCAT CNC."""
    rated, motor = what.asked.rated, what.at_motor
    if rated is None:
        raise BadModel(
            "the friction table of TwinCAT CNC is in 0.1 % of the motor's rated torque, which is"
            " not in the model; give it by --rated [N m, or N of a linear motor]"
        )
    points = unsigned(what, CNC_POINTS - 1)
    factor, unit = CNC_SPEED[what.display.rotary]
    share = 1e3 * CNC_PARTS * motor.travel / rated
    pairs = [(round(factor * v), round(share * F)) for v, F in zip(points.x, points.y, strict=True)]
    written, curve = np.array(pairs) / np.array([factor, share]), what.friction
    found = np.interp(curve.speeds, *written.T)
    error = float(np.max(np.abs(found / curve.mean(curve.speeds) - 1.0)))
    torque = f"{number(rated, 6)} {motor.torque_unit}"
    return _content(
        what, f"{unit}, 0.0001 % of {torque}", len(pairs) + 1, error, pairs=[(0, 0), *pairs],
        speed=unit, rated=torque, scaling=1000 // CNC_PARTS, motor=motor.words,
    )  # fmt: skip


def ax8000(what: Compensation) -> Content:
    """Objects 3144 of a drive AX8000: one static and one dynamic friction."""
    motor, curve = what.at_motor, what.friction
    v = np.linspace(curve.low, curve.high, len(curve.speeds))
    # Relative to the curve, so that slow motion counts as fast.
    weight = 1.0 / np.maximum(curve.mean(v), 1e-300)
    columns = np.column_stack([np.ones_like(v), v])
    (level, slope), *_ = np.linalg.lstsq(columns * weight[:, None], curve.mean(v) * weight)
    off = np.abs(columns @ np.array([level, slope]) - curve.mean(v))
    bent = "the curve is no straight line: static and dynamic friction are off by up to"
    if min(level, slope) < 0:
        raise BadModel(
            f"{what.model.card}: its friction falls with speed over the whole table, which static"
            " and dynamic friction of an AX8000 cannot hold; shorten the table by --speed"
        )
    spring = what.model.effects.get("presliding", {}).get("sigma_0")
    known = None if spring is None else spring.value
    angle = "rad" if motor.turns else "m"
    return _content(
        what, f"{motor.torque_unit}, {motor.torque_unit} s/{angle}", 2, float(np.max(off * weight)),
        (Cost(bent, float(off.max())),) if off.max() > 1e-6 * curve.mean(v).max() else (),
        static=f"{motor.travel * level:.9g}", dynamic=f"{motor.travel**2 * slope:.9g}",
        spring=None if known is None else f"{motor.travel**2 * known:.9g}",
        torque=motor.torque_unit, angle=angle, motor=motor.words,
    )  # fmt: skip


def sinamics(what: Compensation) -> Content:
    """The friction characteristic of a SINAMICS drive: ten speeds and torques."""
    motor, curve = what.at_motor, what.friction
    found = spread_points(unsigned(what, SINAMICS_POINTS), curve.mean, SINAMICS_POINTS)
    unit, factor = motor.speed
    rows = [
        (3820 + at, f"{factor * v:.9g}", 3830 + at, f"{motor.travel * F:.9g}")
        for at, (v, F) in enumerate(zip(found.x, found.y, strict=True))
    ]
    return _content(
        what, f"{unit}, {motor.torque_unit}", len(rows), found.error, rows=rows, speed=unit,
        torque=motor.torque_unit, motor=motor.words,
    )  # fmt: skip


def linuxcnc_hal(what: Compensation) -> Content:
    """Both directions as a lincurve of LinuxCNC's HAL."""
    v, F, error = both_ways(what, CURVE_OF_HAL // 2)
    factor, unit = (180.0 / np.pi, "deg/s") if what.display.rotary else (1e3, "mm/s")
    return _content(
        what, f"{unit}, {what.display.force} of the axis", len(v), error, signed=True,
        name=what.name.lower(), speed=unit, force=what.display.force,
        points=[(f"{factor * one:.9g}", f"{force:.9g}") for one, force in zip(v, F, strict=True)],
    )  # fmt: skip


FRICTION = (
    Format("friction.csv", "friction-table", "", "any program that reads CSV", friction_csv),
    Format("twincat_cnc_friction.lis", "friction-table", "twincat",
           "TwinCAT CNC: the axis's compensation value list", twincat_cnc),
    Format("ax8000_friction.csv", "friction-table", "twincat",
           "TwinCAT drive AX8000: startup list or objects 0x3144", ax8000),
    Format("sinamics_friction.txt", "friction-table", "sinumerik",
           "SINAMICS S120 of the axis: expert list, p3820 to p3839", sinamics),
    Format("linuxcnc_friction.hal", "friction-table", "linuxcnc",
           "LinuxCNC: a HAL file of the machine", linuxcnc_hal),
)  # fmt: skip


def _content(
    what: Compensation, units: str, points: int, error: float, own: tuple[Cost, ...] = (), /, *,
    signed: bool = False, **values: object,
) -> Content:  # fmt: skip
    """A file of friction against speed; own: costs of this format; signed: it has both ways."""
    (unit, factor), curve = what.display.shown("velocity"), what.friction
    ends = {"low": f"{number(factor * curve.low)} {unit}",
            "high": f"{number(factor * curve.high)} {unit}"}  # fmt: skip
    costs = (*own, *friction_costs(what, signed=signed))
    remarks = (*what.small(IDENTIFIED_BY_SLIDING), *what.beyond)
    said = () if signed else (what.at,)
    return Content(units, points, error, {**ends, **values}, costs, remarks, said)


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
    unit, factor = what.display.shown("position")
    waves = known_harmonics(what)
    rows = [
        [f"{value:.9g}" for value in (what.turn / one.period, factor * one.period, one.amplitude,
                                      np.degrees(one.phase))]
        for one in waves
    ]  # fmt: skip
    turn = f"{number(factor * what.turn, 6)} {unit}, {what.turn_words}"
    values = {"rows": rows, "unit": unit, "force": what.display.force, "turn": turn}
    units = f"{what.display.force}, deg, {unit} of the axis"
    return Content(units, len(rows), values=values, remarks=_unidentified(what))


def turn_csv(what: Compensation) -> Content:
    """The force of cogging over one turn, and the one that compensates it."""
    unit, factor = what.display.shown("position")
    y = what.turn * np.arange(TURN_POINTS) / TURN_POINTS
    force = summed(known_harmonics(what), y)
    rows = [[f"{v:.9g}" for v in row] for row in zip(factor * y, force, -force, strict=True)]
    values = {"rows": rows, "unit": unit, "force": what.display.force, "turn": what.turn_words}
    units = f"{unit}, {what.display.force} of the axis"
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


CNC_UNITS = {False: (1e7, "0.0001 mm"), True: (1.8e6 / np.pi, "0.0001 deg")}  # P-AXIS-00103
CNC_LARGEST = 32767  # SGN16
AXIS_UNITS = "{unit} (the axis's units are to be these)"
JOINT_UNITS = "{unit} (LINEAR_UNITS or ANGULAR_UNITS are to be these)"
QUADRANTS_LEFT_OUT = (
    "sinumerik: quadrant error compensation (MD32520) is left out: it is a speed impulse, and how"
    " large depends on the speed controller, which no model has; the circularity test finds it"
)
HALF_OF_THE_PLAY = (
    "codesys: fBacklash is half of the play: after a reversal the block moves twice as far"
)
WHICH_SIDE = (
    "the sign of the value depends on where the control's encoder is; say by --encoder motor"
    " (before the play, the usual case) or --encoder load (the transducer of the logs, behind it)"
)
MOTOR_SIDE = "the control positions by an encoder before the play"
LOAD_SIDE = (
    "the control positions by the transducer behind the play: the drive's side is ahead of it, so"
    " the value is negative; a tool on the transducer's side needs no compensation at all"
)
ONLY_BEFORE = (
    "has a value for play behind the encoder alone; with --encoder load there is none to write"
)


def backlash_csv(what: Compensation) -> Content:
    """The width of the play with its interval."""
    play, (unit, factor) = known_play(what), _length(what)
    ends = {"width": play.value, "low": play.low, "high": play.high}
    shown = {key: "" if one is None else f"{factor * one:.9g}" for key, one in ends.items()}
    return Content(f"{unit} of the axis", values={"unit": unit, **shown})


def of_axis(
    what: Compensation, units: str, said: tuple[str, ...] = (), only_before: str = ""
) -> Content:
    """The play in a control that takes it in the axis's units, which are called so.

    only_before: the control's name where it knows play before its encoder alone.
    """
    width, unit, factor = _signed(what)
    if only_before and width < 0:
        raise BadModel(f"{only_before} {ONLY_BEFORE}")
    values = {
        **_values(what, unit, factor * width),
        "half": f"{factor * width / 2:.9g}",
        "shown": f"{number(factor * width, 6)} {unit}",
    }
    return Content(units.format(unit=unit), values=values, said=said)


def twincat_cnc_play(what: Compensation) -> Content:
    """getriebe[0].lose of an axis of TwinCAT CNC."""
    width, _unit, _factor = _signed(what)
    factor, unit = CNC_UNITS[what.display.rotary]
    value = round(factor * width)
    if abs(value) > CNC_LARGEST:
        raise BadModel(
            f"{what.model.card}: a play of {value} times {unit}, where P-AXIS-00103 of TwinCAT CNC"
            f" holds {CNC_LARGEST} at most; take MC_BacklashCompensation"
        )
    off = abs(value / (factor * width) - 1.0)
    return Content(unit, error=off, values={**_values(what, unit, factor * width), "value": value})


BACKLASH = (
    Format("backlash.csv", "backlash", "", "any program that reads CSV", backlash_csv),
    Format("twincat_nc_backlash.st", "backlash", "twincat",
           "TwinCAT NC: a program of the axis, Tc2_MC2", partial(of_axis, units=AXIS_UNITS)),
    Format("twincat_cnc_backlash.lis", "backlash", "twincat",
           "TwinCAT CNC: the axis's parameter list, P-AXIS-00103", twincat_cnc_play),
    Format("codesys_backlash.st", "backlash", "codesys",
           "CODESYS SoftMotion: a program of the axis's task",
           partial(of_axis, units=AXIS_UNITS, said=(HALF_OF_THE_PLAY,),
                   only_before="SMC_BacklashCompensation of CODESYS")),
    Format("linuxcnc_backlash.ini", "backlash", "linuxcnc",
           "LinuxCNC: the INI file, section of the joint",
           partial(of_axis, units=JOINT_UNITS, only_before="BACKLASH of LinuxCNC")),
    Format("sinumerik_backlash.mpf", "backlash", "sinumerik",
           "SINUMERIK: machine data of the axis, MD32450 (AX1 is to be your axis)",
           partial(of_axis, units="{unit}", said=(QUADRANTS_LEFT_OUT,))),
)  # fmt: skip


def known_play(what: Compensation) -> Estimate:
    """The width of the play [m]; raises BadModel where the model has none."""
    if what.play is None or not what.play.value:
        raise BadModel(
            f"{what.model.card}: the model has no backlash, so there is no value for it; 'workbench"
            " trace' searches for one"
        )
    return what.play


def _length(what: Compensation) -> tuple[str, float]:
    """The unit in which controls take lengths or angles of an axis, and how many make one in SI."""
    return ("deg", 180.0 / np.pi) if what.display.rotary else ("mm", 1e3)


def _signed(what: Compensation) -> tuple[float, str, float]:
    """Width [m], negative where the encoder trails the drive; unit and factor of the control's."""
    width = known_play(what).value or 0.0
    if what.asked.encoder is None:
        raise BadModel(f"backlash in a control's format: {WHICH_SIDE}")
    return (width if what.asked.encoder == "motor" else -width), *_length(what)


def _values(what: Compensation, unit: str, width: float) -> dict[str, str]:
    """What the template of a control is filled with: the width in its unit, and whose side."""
    side = MOTOR_SIDE if what.asked.encoder == "motor" else LOAD_SIDE
    return {"side": side, "name": what.name, "unit": unit, "width": f"{width:.9g}"}
