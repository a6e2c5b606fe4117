"""Friction against speed in the formats of controls, each by a template of its own."""

import numpy as np

from design.compensation_tables import Points, spread_points, table_points
from identification.arrays import Array
from identification.errors import BadModel
from workbench.cards.readable import number
from workbench.export.compensation import (
    IDENTIFIED_BY_SLIDING,
    Compensation,
    Content,
    Cost,
    Format,
    friction_costs,
)

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
    curve, (unit, factor) = what.friction, what.speed_unit
    ways = (curve.positive, curve.negative)
    found = [table_points(one, curve.speeds, NEUTRAL_POINTS // 2) for one in ways]
    v = np.unique(np.concatenate([one.x for one in found]))
    rows = zip(factor * v, curve.positive(v), -curve.negative(v), strict=True)
    return _content(
        what, f"{unit}, {what.force_unit} of the axis", len(v), max(one.error for one in found),
        signed=True, speed=unit, force=what.force_unit,
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
    factor, unit = CNC_SPEED[what.rotary]
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
    factor, unit = (180.0 / np.pi, "deg/s") if what.rotary else (1e3, "mm/s")
    return _content(
        what, f"{unit}, {what.force_unit} of the axis", len(v), error, signed=True,
        name=what.name.lower(), speed=unit, force=what.force_unit,
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
    (unit, factor), curve = what.speed_unit, what.friction
    ends = {"low": f"{number(factor * curve.low)} {unit}",
            "high": f"{number(factor * curve.high)} {unit}"}  # fmt: skip
    costs = (*own, *friction_costs(what, signed=signed))
    remarks = (*what.small(IDENTIFIED_BY_SLIDING), *what.beyond)
    said = () if signed else (what.at,)
    return Content(units, points, error, {**ends, **values}, costs, remarks, said)
