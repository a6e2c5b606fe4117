"""Sizes that servo machines have, the slip of a unit that a size far off suggests, and documents in
which a unit was changed and the number was not.

A remark changes nothing; it names what to look at.

A document is refused where the rest of it rules a value out. Only values in another unit than our
commands write are looked at: a command writes no such file, a hand or another program did.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import sqrt

import numpy as np

from design.machine.model import LogEntry, Model
from design.machine.sizes import LINEAR, ROTARY, Size
from identification.errors import BadLog, BadModel
from identification.log import Log, Rig
from identification.model.estimates import Estimate

LESS_USUAL = 0.2  # log-odds of a slip of unit against the next in its list
# Times another log's clock or travel: a slip of 1000, and motions alike in part.
_OTHER_UNIT = 200.0
_UNUSED = 1e-3  # share of the command's limit that a log reaches at least


def model_remarks(model: Model) -> tuple[str, ...]:
    """A line where the mass, or what the logs' force makes of it, is of no machine's size."""
    mass = model.friction["m"].value
    if mass is None:
        return ()
    where = "friction.m, by the units of t, y and the force"
    line = size_remark("mass", mass, model.rig, where, "the moving body has")
    clock = any(size_remark("period", entry.h, model.rig, "", "") for entry in model.log)
    if line is None and mass > 0 and not clock:  # a wrong clock makes the mass wrong, and is said
        said = f"on {mass:.4g} {model.friction['m'].unit} the logs' largest force makes"
        reached = model.force_peak / mass
        line = size_remark("acceleration", reached, model.rig, "the unit of y (or t)", said)
    return (line,) if line else ()


def stored_remarks(model: Model) -> tuple[str, ...]:
    """As `model_remarks`, and what a model file says of its logs and rig, for who reads it."""
    logs, rig = model.log, model.rig
    periods = extremes([entry.h for entry in logs])
    lines = [size_remark("period", h, rig, "t of its logs", "sampled every") for h in periods]
    travel = max(travel_of(entry) for entry in logs)
    way = size_remark("travel", travel, rig, "y of its logs", "the position covers")
    speed = max((entry.speed or 0.0 for entry in logs), default=0.0)
    lines += [
        way or size_remark("speed", speed, rig, "y or t of its logs", "the body moves at"),
        size_remark("force", model.force_peak, rig, "the force of its logs", "at most"),
    ]
    every = (*lines, *rig_remarks(rig), *model_remarks(model))
    return tuple(dict.fromkeys(line for line in every if line))


def bandwidth_remarks(w_n: Iterable[float], rig: Rig) -> tuple[str, ...]:
    """A line where the dominant poles [rad/s] of a design lie where no position loop has them."""
    where = "design (units of the model's logs)"
    found = (size_remark("bandwidth", w, rig, where, "the loop's w_n is") for w in w_n)
    return tuple(dict.fromkeys(line for line in found if line))


def refuse_other_units(
    logs: Sequence[Log], known: Sequence[Log] | Sequence[LogEntry], rig: Rig
) -> None:
    """Raises BadLog where the clock or the travel of a log is hundreds of times that of the known
    ones, training logs or those of a model, or as much less: it is in other units."""
    periods, travels = [one.h for one in known], [travel_of(one) for one in known]
    for log in logs:
        _refuse_apart("period", log.h, periods, rig, f"{log.name}: signals.t: sampled every")
        said = f"{log.name}: signals.y: the position covers"
        _refuse_apart("travel", travel_of(log), travels, rig, said)


def refuse_other_machine(of_model: Rig, of_logs: Rig, card: str, *keys: str) -> None:
    """Raises BadModel where the logs' rig, by their card, is another by one of these keys."""
    for key in keys:
        own, other = getattr(of_model, key), getattr(of_logs, key)
        if own != other:
            what = f"a {own} machine" if key == "motion" else f"a rig with {key} {own!r}"
            raise BadModel(
                f"the model is of {what}, but {card} says {key} = {other!r}; give the model and the"
                " card of one machine"
            )


def _refuse_apart(quantity: str, value: float, known: Sequence[float], rig: Rig, said: str) -> None:
    low, high = extremes(known)
    if value <= 0.0 or low <= 0.0 or low / _OTHER_UNIT < value < high * _OTHER_UNIT:
        return
    size = (ROTARY if rig.motion == "rotary" else LINEAR)[quantity]
    near = high if value > high else low
    like = min(_slips(size), key=lambda slip: abs(np.log(value * slip[0] / near)))
    raise BadLog(
        f"{said} {value:.4g} {size.unit}, {max(value / near, near / value):.4g} times"
        f" {'more' if value > near else 'less'} than in the logs of the model ({near:.4g}"
        f" {size.unit}), as if it were {like[1]}; correct its unit, or give it its own card"
    )


def rig_remarks(rig: Rig) -> Iterator[str | None]:
    """Areas, supply pressure and stroke as the card gives them."""
    for key, area in (("area_p_m2", rig.area_p), ("area_n_m2", rig.area_n)):
        if area is not None:
            yield size_remark("area", area, rig, f"rig.{key}", "an area of")
    if rig.supply_pressure:
        where = "rig.supply_pressure_pa"
        yield size_remark("pressure", abs(rig.supply_pressure), rig, where, "a pressure of")
    if rig.stroke is not None:
        yield size_remark(
            "travel", rig.stroke[1] - rig.stroke[0], rig, "rig.stroke_m", "a stroke of"
        )


def size_remark(quantity: str, value: float, rig: Rig, where: str, said: str) -> str | None:
    """What to say of a value out of its range, with the unit that would bring it there."""
    size = (ROTARY if rig.motion == "rotary" else LINEAR)[quantity]
    if value == 0.0 or size.low <= value <= size.high:
        return None
    middle = np.sqrt(size.low * size.high)

    def off(slip: tuple[float, str, int]) -> float:
        return float(abs(np.log(value * slip[0] / middle))) + LESS_USUAL * slip[2]

    other = min(_slips(size), key=off, default=None)
    hint = "check the units in the card"
    if other and size.low <= value * other[0] <= size.high:
        hint = f"{other[1]} would make it {value * other[0]:.4g} {size.unit}; check the unit"
    return (
        f"{where}: {said} {value:.4g} {size.unit}, where servo machines have {size.low:g} to"
        f" {size.high:g}; {hint}"
    )


def _slips(size: Size) -> Iterator[tuple[float, str, int]]:
    """Factors that a slip of unit takes out of a value, either way round, their names, and how many
    are more usual."""
    unit = size.unit.split("/s")[0]
    for rank, (factor, name) in enumerate(size.slips):
        yield factor, f"{name} in place of {unit}", rank
    for rank, (factor, name) in enumerate(size.slips):
        yield 1.0 / factor, f"{unit} in place of {name}", rank + 1


def extremes(values: Sequence[float]) -> tuple[float, float]:
    """The least and the largest."""
    return min(values), max(values)


def travel_of(of: Log | LogEntry) -> float:
    """From the lowest to the highest position of a log [m]."""
    return float(np.ptp(of["y"] if isinstance(of, Log) else of.travel))


# Parameters that no machine has this far apart: directions, and breakaway over sliding friction.
# The widest of the shipped recipes and measured sets are 8.
_PAIRS = (("F_cp", "F_cn"), ("F_vp", "F_vn"), ("dv_p", "dv_n"), ("F_sp", "F_sn"),
          ("F_sp", "F_cp"), ("F_sn", "F_cn"))  # fmt: skip
_APART = 30.0
# Times what the logs have shown at most: forces of effects and a drive that is not logged stay
# below it, a factor of 1000 does not.
_BEYOND = 10.0
# Times less than the smallest standard deviation of a mass that the log's noise allows. Those of
# the shipped recipes are 1.6 to 2.7 times it; of a log with effects more, and a change then passes.
_SHARPER = 20.0
_SAME = 0.01  # relative difference of two numbers that are one


def refuse_changed_units(written: Mapping[str, Estimate], found: Model) -> None:
    """Raises BadModel where a model contradicts its own logs by a value in another unit.

    written: its parameters by their places, as the file has them.
    """
    nine = {name: written[f"friction.{name}"] for name in found.friction}
    refuse_apart(nine, found.friction, "[friction.")
    for name, one in sorted(found.friction.items()):
        why = _impossible(name, found) if differs(nine[name], one) else None
        if why:
            raise BadModel(_only_unit(f"[friction.{name}]", nine[name], one.unit, why))
    given, k_a = found.rig.force_per_command, (found.actuator or {}).get("k_a")
    if k_a and given:
        where = "force_per_command under [rig]"
        refuse_unequal("[actuator.k_a]", written["actuator.k_a"], k_a, given, where)


def refuse_apart(
    written: Mapping[str, Estimate], found: Mapping[str, Estimate], where: str
) -> None:
    """Raises BadModel where two of the nine lie far apart in SI and did not as they are written.

    where: what stands before the name of a parameter in the message.
    """
    for pair in _PAIRS:
        if not all(name in found for name in pair):
            continue
        changed = [name for name in pair if differs(written[name], found[name])]
        if changed and _ratio(found, pair) > _APART and _ratio(written, pair) <= _APART:
            name = changed[0]
            other = pair[0] if name == pair[1] else pair[1]
            why = f"{other} is {_number(found[other]):.4g} {found[other].unit}"
            raise BadModel(_only_unit(f"{where}{name}]", written[name], found[name].unit, why))


def differs(written: Estimate, found: Estimate) -> bool:
    """Whether an estimate was written in another unit, by its number."""
    one, other = _number(written), _number(found)
    return abs(one - other) > 1e-9 * abs(other)


def refuse_unequal(
    where: str, written: Estimate, found: Estimate, needed: float, beside: str
) -> None:
    """Raises BadModel where a value written in another unit is not the one `beside` it."""
    if differs(written, found) and abs(_number(found) - needed) > _SAME * abs(needed):
        raise BadModel(
            _only_unit(where, written, found.unit, f"{beside} is {needed:.4g} {found.unit}")
        )


def _number(found: Estimate) -> float:
    """The value that simulations use, 0 where there is none."""
    return (found.assumed if found.value is None else found.value) or 0.0


def _ratio(of: Mapping[str, Estimate], pair: tuple[str, str]) -> float:
    low, high = sorted(abs(_number(of[name])) for name in pair)
    return high / low if low > 0 else 1.0


def _impossible(name: str, found: Model) -> str | None:
    """Why the logs rule the value out; None where they do not."""
    value = abs(_number(found.friction[name]))
    peak = max(entry.force_peak for entry in found.log)
    speed = max((entry.speed or 0.0 for entry in found.log), default=0.0)
    force = found.display.force
    most = f"the largest force of its logs is {peak:.4g} {force}"
    if name.startswith(("F_c", "F_s")) and value > _BEYOND * peak > 0:
        return most
    if name.startswith("F_v") and value * speed > _BEYOND * peak > 0:
        return f"{most}, and at their speed {value * speed:.3g} {force} would be needed"
    if name.startswith("dv_") and value > _BEYOND * speed > 0:
        return f"its logs are at most {speed:.3g} fast"
    return _impossible_mass(found, peak, speed, most) if name == "m" else None


def _impossible_mass(found: Model, peak: float, speed: float, most: str) -> str | None:
    """Too heavy to reach the logs' speed, or known better than the logs' noise allows.

    A mass that is off by dm shifts the position by at most speed/F_v dm, so that n positions with
    noise gives it no better than to noise F_v/(speed sqrt(n)): the bound of Cramer and Rao.
    """
    mass = found.friction["m"]
    duration = max(entry.duration for entry in found.log)
    if peak > 0 and _number(mass) * speed / peak > _BEYOND * duration:
        return f"{most}, which could not bring it to their speed"
    viscous = [_number(found.friction[name]) for name in ("F_vp", "F_vn")]
    samples = sum(entry.rows for entry in found.log)
    if mass.value is None or not mass.sd or not speed > 0 or found.fit.drive != "command":
        return None
    least = found.fit.noise_y * 0.5 * sum(viscous) / speed / sqrt(samples)
    if mass.sd < least / _SHARPER:
        return (
            f"its standard deviation would be {mass.sd:.2g} {mass.unit}, but with the noise of its"
            f" logs it is at least {least:.2g} {mass.unit}"
        )
    return None


def _only_unit(where: str, written: Estimate, unit: str, why: str) -> str:
    return (
        f"{where} {_number(written):.4g} {written.unit} cannot be: {why}; if only the unit was"
        f" changed, write {unit!r} again, else correct the value"
    )


def read_in(name: str, unit: str) -> str:
    """How a line names a signal and the unit in which it is read."""
    return f"signals.{name}, read in {unit!r}"


def log_size_remarks(
    logs: Sequence[Log], rig: Rig, units: Mapping[str, str], other: Mapping[str, str]
) -> tuple[str, ...]:
    """A line for each signal, and each number of the rig, whose size no machine has, or whose unit
    is not that of its header.

    units: in which each signal is read, by its name; other: the lines on units that are not those
    of the headers.
    """
    named = {name: read_in(name, unit) for name, unit in units.items()}

    def peak(name: str, logged: str = "") -> float:
        return max(float(np.max(np.abs(log.signals.get(logged, log[name])))) for log in logs)

    periods = [log.h for log in logs]
    seen = [("t", "period", h, "sampled every") for h in extremes(periods)]
    seen += [("y", "travel", max(map(travel_of, logs)), "the position covers")]
    if "F" in units:
        seen += [("F", "force", peak("F", "F_logged"), "the force is at most")]
    pressures = (name for name in ("p_p", "p_n") if name in units)
    seen += [(name, "pressure", peak(name), "the pressure is at most") for name in pressures]
    lines = [*other.values()] + [
        size_remark(quantity, value, rig, named.get(name, f"signals.{name}"), said)
        for name, quantity, value, said in seen
        if name not in other
    ]
    if rig.control_limit and "u" in units and "u" not in other:
        most = peak("u")
        if 0 < most < _UNUSED * rig.control_limit:
            lines += [
                f"{named['u']}: the command reaches {most:.3g} of a control_limit_v ="
                f" {rig.control_limit:g}; check both units"
            ]
    return tuple(dict.fromkeys(line for line in (*lines, *rig_remarks(rig)) if line))
