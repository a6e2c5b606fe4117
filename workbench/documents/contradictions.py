"""Documents in which a unit was changed and the number was not: what the rest of them rules out.

Only values in another unit than our commands write are looked at: a command writes no such file,
a hand or another program did. What is sure refuses the document; the rest is a remark.
"""

from collections.abc import Mapping
from math import sqrt
from typing import TYPE_CHECKING

from identification.errors import BadModel
from identification.model.estimates import Estimate

if TYPE_CHECKING:
    from workbench.documents.model import ModelFile

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


def refuse_changed_units(written: "ModelFile", found: "ModelFile") -> None:
    """Raises BadModel where `found`, `written` in SI units, contradicts its own logs by a value
    that was written in another unit."""
    other = {n for n, e in found.friction.items() if differs(written.friction[n], e)}
    refuse_apart(written.friction, found.friction, "[friction.")
    for name in sorted(other):
        why = _impossible(name, found)
        if why:
            unit = found.friction[name].unit
            raise BadModel(_only_unit(f"[friction.{name}]", written.friction[name], unit, why))
    given, k_a = found.rig.force_per_command, (found.actuator or {}).get("k_a")
    if k_a and given and written.actuator:
        where = "force_per_command under [rig]"
        refuse_unequal("[actuator.k_a]", written.actuator["k_a"], k_a, given, where)


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


def _impossible(name: str, found: "ModelFile") -> str | None:
    """Why the logs rule the value out; None where they do not."""
    value = abs(_number(found.friction[name]))
    peak = max(entry.force_peak for entry in found.log)
    speed = max((entry.speed or 0.0 for entry in found.log), default=0.0)
    force = "N m" if found.rig.motion == "rotary" else "N"
    most = f"the largest force of its logs is {peak:.4g} {force}"
    if name.startswith(("F_c", "F_s")) and value > _BEYOND * peak > 0:
        return most
    if name.startswith("F_v") and value * speed > _BEYOND * peak > 0:
        return f"{most}, and at their speed {value * speed:.3g} {force} would be needed"
    if name.startswith("dv_") and value > _BEYOND * speed > 0:
        return f"its logs are at most {speed:.3g} fast"
    return _impossible_mass(found, peak, speed, most) if name == "m" else None


def _impossible_mass(found: "ModelFile", peak: float, speed: float, most: str) -> str | None:
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
