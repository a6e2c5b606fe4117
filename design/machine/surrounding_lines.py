"""In words: gravity, a constant force, a position and a force that are not of one instant."""

import math
from collections.abc import Collection, Mapping

from design.machine.readable import in_digits, number
from identification.log import Rig
from identification.model.estimates import NORMAL_95, Estimate
from identification.model.plant import units_of
from identification.model.resonance import Resonance
from identification.model.size import Size
from identification.model.surroundings import Surroundings
from identification.thresholds import TWICE

MS = 1e3


def surrounding_lines(around: Surroundings, rig: Rig, *, scaled: bool = True) -> tuple[str, ...]:
    """A line on each that shows in the logs; all of them are in the model.

    scaled: whether it is known what force a unit of the command makes.
    """
    unit, lines = units_of(rig.motion)["F_cp"] if scaled else "units of u", list[str]()
    if around.sine.value or around.cosine.value:
        size = math.hypot(around.sine.value, around.cosine.value)
        rest = math.atan2(-around.cosine.value, around.sine.value)
        lines.append(
            f"gravity: {number(size)} {unit} at most ({_interval(around.sine)} {unit} by the sine"
            f" of the angle), hanging at {number(rest, 2)} rad"
        )
    if around.force.value:
        lines.append(
            f"constant force: {number(around.force.value)} {unit} ({_interval(around.force)}) acts"
            " beside the applied one and is larger than friction (a weight, a tilt, a sensor's"
            " offset, a wrong area or supply pressure): F_cp and F_cn are estimated with it, as"
            " equal within a tenth"
        )
    if around.zoh:
        until = "until" if around.lag.value else "from"
        lines.append(f"the force acts as it stands {until} its row, constant between rows")
    elif around.lag.value:
        lag, behind = around.lag, around.lag.value > 0.0
        what = "command" if around.gives else "force"
        lines.append(
            f"the position of a row is {'older' if behind else 'newer'} than its {what} by"
            f" {number(MS * abs(lag.value))} ms"
            f" ({_interval(Size(MS * abs(lag.value), MS * lag.sd))}): taken into account"
        )
    if around.resonance is not None:
        lines.append(_resonance(around.resonance, units_of(rig.motion)["m"]))
    return tuple(lines)


def unequal_friction(friction: Mapping[str, Estimate], effects: Collection[str]) -> tuple[str, ...]:
    """A line where a constant force may be in F_cp and F_cn, in motion the same as half of their
    difference: where one is at least twice the other, or beside a spring, which has a preload.

    effects: keys of those in the model.
    """
    up, down = friction["F_cp"], friction["F_cn"]
    if up.value is None or down.value is None:
        return ()
    if "spring" in effects:
        return (
            "spring: its force is 0 at y = 0; a preload stands in F_cp and F_cn as unequal friction"
            " does, and their intervals are those of both together",
        )
    low, high = sorted((up.value, down.value))
    if high < TWICE * low or high - low < NORMAL_95 * math.hypot(up.sd or 0.0, down.sd or 0.0):
        return ()
    mean, force = 0.5 * (up.value + down.value), 0.5 * (down.value - up.value)
    return (
        f"F_cp and F_cn may as well be {number(mean)} {up.unit} in both directions and a constant"
        f" force of {number(force)} {up.unit} (a weight, a tilt, a sensor's offset): motion"
        " alone does not distinguish them",
    )


def _resonance(found: Resonance, unit: str) -> str:
    hertz, behind = (number(one.value, 4) for one in (found.frequency, found.anti_resonance))
    first, second = (
        in_digits((one.value, *_limits(one)), one.value, one.sd) for one in (found.m_1, found.m_2)
    )
    return (
        f"two masses: a resonance at {hertz} Hz, damping {number(found.damping.value, 2)}, behind"
        f" an anti-resonance at {behind} Hz; {first[0]} {unit} ({first[1]} to {first[2]}) are"
        f" measured and {second[0]} ({second[1]} to {second[2]}) hang on a spring; m is both"
        " together"
    )


def _interval(of: Size) -> str:
    low, high = _limits(of)
    return f"{number(low)} to {number(high)}"


def _limits(of: Size) -> tuple[float, float]:
    return of.value - NORMAL_95 * of.sd, of.value + NORMAL_95 * of.sd
