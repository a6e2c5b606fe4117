"""The axis test of a machine's newest log against those before it, by what their results hold.

Light to import, since the page of a machine asks for it.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol

from design.judgement import ALARMING
from design.machine.readable import shown_unit
from design.measured.axis_limits import (
    FEWEST_EARLIER,
    MEANING_OF,
    Allowed,
    Light,
    light_of,
    limits_of,
)

LAST_ON_PAGE = 30
MOST_NAMED = 3  # files that a sentence names
NAMED = {"constant_force.F_0": "constant_force", "backlash.width": "backlash"}


class Tested(Protocol):
    """A tested log: what it gave of each parameter, and whether it is of the machine as somebody
    has accepted it, and no alarm."""

    @property
    def file(self) -> str: ...
    @property
    def sha256(self) -> str: ...
    @property
    def recorded_at(self) -> float: ...
    @property
    def verdict(self) -> str | None: ...
    @property
    def parameters(self) -> Sequence[Mapping[str, Any]]: ...
    @property
    def sound(self) -> bool: ...


class AxisLine(NamedTuple):
    """A quantity of the newest log: value with its interval, its limits, all in the unit in which
    people read it, and its light."""

    meaning: str
    unit: str
    value: float
    low: float
    high: float
    allowed: Allowed | None
    light: Light


@dataclass(frozen=True)
class AxisShown:
    """The axis test of the newest log that gives parameters: its file, its lines, and what to know
    of the limits, a sentence each; newer: logs after it, which gave none."""

    file: str
    lines: Sequence[AxisLine]
    said: Sequence[str]
    newer: str


def newest_lights(
    logs: Sequence[Tested], sound: Sequence[Tested], accepted: int | None
) -> AxisShown:
    """The newest log's lines against the sound logs before it; no file where none has parameters.

    logs, sound: the newest first; accepted: the version whose logs are the sound ones.
    """
    identified = [one for one in logs if one.parameters]
    if not identified:
        return AxisShown("", (), (), "")
    newest = identified[0]
    older = [one for one in sound if one.parameters and one.sha256 != newest.sha256][:LAST_ON_PAGE]
    past = history(list(reversed(older)))
    limits = limits_of({name: [value for _, value in every] for name, every in past.items()})
    found = {}
    for name, (unit, value, low, high) in by_quantity(newest.parameters).items():
        allowed, (unit, factor) = limits.get(name), shown_unit(unit)
        light = light_of(value, low, high, allowed) if allowed else ""
        if allowed is not None:
            allowed = replace(allowed, low=factor * allowed.low, high=factor * allowed.high)
        numbers = factor * value, factor * low, factor * high
        found[name] = AxisLine(MEANING_OF[name], unit, *numbers, allowed, light)
    said = [f"limits: mean ± 3 sd of {len(older)} sound logs (wider of few)"]
    if len(older) < FEWEST_EARLIER:
        said = [f"no limits: {few_sound_logs(len(older), accepted)}"]
    out = left_out([one for one in identified if one is not newest], accepted)
    silent = [one.file for one in logs[: logs.index(newest)] if one.verdict is not None]
    lines = [found[name] for name in MEANING_OF if name in found]
    return AxisShown(newest.file, lines, [*said, out] if out else said, _few(silent))


def few_sound_logs(count: int, accepted: int | None) -> str:
    """Why the machine's own logs give no limits."""
    of = f" of the accepted version {accepted}" if accepted else ""
    return f"{count} sound logs with parameters{of}, at least {FEWEST_EARLIER} needed"


def left_out(logs: Sequence[Tested], accepted: int | None) -> str:
    """Which of the logs are no part of the limits, and why; "" where all are."""
    out = [one for one in logs if one.parameters and not one.sound]
    alarmed = [one.file for one in out if one.verdict in ALARMING]
    others = [one.file for one in out if one.verdict not in ALARMING]
    parts = [f"{_few(alarmed)} (alarm)"] if alarmed else []
    if others:
        parts.append(f"{_few(others)} (not tested against the accepted version {accepted})")
    return f"the limits leave out {', '.join(parts)}" if parts else ""


def _few(files: Sequence[str]) -> str:
    """The first of the names, the newest, and how many more there are."""
    more = len(files) - MOST_NAMED
    return ", ".join(files[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")


def by_quantity(
    parameters: Iterable[Mapping[str, Any]],
) -> dict[str, tuple[str, float, float, float]]:
    """Unit, value and ends of the interval of what the axis test looks at, by quantity."""
    out = {}
    for each in parameters:
        name = NAMED.get(str(each["name"]), str(each["name"]))
        if name in MEANING_OF:
            sign, value = -1.0 if name == "F_sn" else 1.0, float(each["after"])
            ends = sorted(sign * float(each.get(key) or value) for key in ("low", "high"))
            out[name] = (str(each.get("unit", "")), sign * value, ends[0], ends[1])
    return out


def history(logs: Sequence[Tested]) -> dict[str, list[tuple[float, float]]]:
    """Values of the logs by quantity, each with the moment at which its log was recorded."""
    out: dict[str, list[tuple[float, float]]] = {}
    for one in logs:
        found = {name: value for name, (_, value, *_) in by_quantity(one.parameters).items()}
        if "F_cp" in found and "F_cn" in found:
            found.setdefault("constant_force", 0.5 * (found["F_cn"] - found["F_cp"]))
        for name, value in found.items():
            out.setdefault(name, []).append((one.recorded_at, value))
    return out
