"""What a log identifies of a valve's numbers: values with intervals, or why there is none."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict

import numpy as np
from scipy.stats import t as student

from identification.arrays import BoolArray
from identification.errors import NotIdentifiable
from identification.estimation.estimates import reported_estimate
from identification.model.estimates import NORMAL_95, Estimate
from identification.thresholds import EVENTS_NEEDED
from identification.velocity.fit import WIDEST_ZONE, ValveFit, bounds_of
from identification.velocity.model import NUMBERS, Valve
from identification.velocity.record import Record

BESIDE_ZONE = 0.05  # of the largest command, that counts as inside: a zone may be none
WAYS = {"p": ("positive", 1.0), "n": ("negative", -1.0)}


def units(motion: str, command_unit: str) -> Mapping[str, str]:
    """The unit of each number of the model; motion: "linear" or "rotary"."""
    speed = "rad/s" if motion == "rotary" else "m/s"
    parted = f"{speed.split('/')[0]}/(s {command_unit})" if command_unit != "1" else speed
    return {
        "g_p": parted, "g_n": parted, "d_p": command_unit, "d_n": command_unit,
        "delay": "s", "lag": "s", "creep": speed,
    }  # fmt: skip


def valve_estimates(
    record: Record, found: ValveFit, unit: Mapping[str, str]
) -> Mapping[str, Estimate]:
    """Each number of the plain model with its 95 % interval, or the reason why it is not
    identified.

    unit: of each number. Raises NotIdentifiable where no gain is identifiable.
    """
    values, bounds = asdict(found.valve), bounds_of(record)
    out = dict[str, Estimate]()
    sd = dict(zip(found.free, np.sqrt(np.diag(found.covariance)).tolist(), strict=True))
    wide = float(student.ppf(0.975, max(found.clusters - 1, 1))) / NORMAL_95
    for name in NUMBERS:
        reason = _silent(name, record, found.valve)
        if reason or name not in sd:
            out[name] = Estimate(None, unit[name], reason=reason, assumed=values[name])
            continue
        size = {"d": record.u_max, "l": 1.0, "g": 0.0}.get(name[0], 0.0)
        low = bounds.get(name, (-np.inf, np.inf))
        if np.isinf(sd[name]):
            out[name] = Estimate(
                None, unit[name], reason=_together(name, record), assumed=values[name]
            )
            continue
        spread = sd[name] * wide if np.isfinite(sd[name]) else None
        if spread is None and values[name] <= low[0] + 1e-9 * max(record.u_max, 1.0):
            zero = "at its bound: not significantly different from 0"
            out[name] = Estimate(None, unit[name], reason=zero, assumed=0.0)
            continue
        out[name] = reported_estimate(values[name], unit[name], spread, bounds=low, beside=size)
    if out["g_p"].value is None and out["g_n"].value is None:
        first = f"{record.runs[0].name}: "
        why = str(out["g_p"].reason).removeprefix(first)
        raise NotIdentifiable(
            f"{first}how the velocity follows the command is not identifiable (g_p: {why})"
        )
    return out


def _entries(inside: BoolArray) -> int:
    """How often a signal is inside for a while."""
    return int(np.count_nonzero(np.diff(inside.astype(np.int8)) == 1)) + int(inside[0])


def _together(name: str, record: Record) -> str:
    """Why a number is not separable from another one."""
    if name not in ("g_p", "g_n", "d_p", "d_n"):
        return (
            f"{record.runs[0].name}: not separable from the other parameters; add commands of"
            " other sizes"
        )
    way = WAYS[name[-1]][0]
    return (
        f"{record.runs[0].name}: gain and dead zone of the {way} direction are not separable;"
        " add commands of other sizes"
    )


def _silent(name: str, record: Record, valve: Valve) -> str | None:
    """Why the command cannot identify a number, whatever the position does; None where it may."""
    if name in ("delay", "lag"):
        return None
    way, sign = WAYS[name[-1]]
    first = record.runs[0].name
    most = max(float(np.max(sign * run.u)) for run in record.runs)
    if most <= 0.0:
        return f"{first}: no command in the {way} direction; add one"
    zone = getattr(valve, f"d_{name[-1]}")
    if zone >= 0.99 * WIDEST_ZONE * record.u_max:
        return (
            f"{first}: no motion under {way} commands, which reach {sign * most:.4g}; give larger"
            " ones"
        )
    if not name.startswith("d_"):
        return None
    near = BESIDE_ZONE * record.u_max
    inside = sum(
        _entries((run.u > -valve.d_n - near) & (run.u < valve.d_p + near)) for run in record.runs
    )
    if inside < EVENTS_NEEDED:
        return (
            f"{first}: {inside} passages of the command inside the dead zone, at least"
            f" {EVENTS_NEEDED} needed; add slow ones through 0"
        )
    return None


def estimates_beside(
    found: ValveFit, names: Sequence[str], unit: Mapping[str, str]
) -> dict[str, Estimate]:
    """The numbers `names` that a richer structure has beside the plain model's, likewise."""
    sd = dict(zip(found.free, np.sqrt(np.diag(found.covariance)).tolist(), strict=True))
    wide = float(student.ppf(0.975, max(found.clusters - 1, 1))) / NORMAL_95
    values = asdict(found.valve)
    return {
        name: reported_estimate(
            values[name], unit.get(name, "1"), sd[name] * wide if np.isfinite(sd[name]) else None
        )
        for name in names
        if name in sd
    }
