"""The axis test of a machine's newest tested log against those before it, out of the registry."""

from collections.abc import Sequence
from typing import NamedTuple

from workbench.registry.results import TestedLog
from workbench.steps.axis_limits import MEANING_OF, Allowed, Light, light_of, limits_of

LAST_ON_PAGE = 30
NAMED = {"constant_force.F_0": "constant_force", "backlash.width": "backlash"}


class AxisLine(NamedTuple):
    """A quantity of the newest log: value with its interval in SI, its limits and its light."""

    meaning: str
    unit: str
    value: float
    low: float
    high: float
    allowed: Allowed | None
    light: Light


def newest_lights(logs: Sequence[TestedLog]) -> tuple[str, Sequence[AxisLine]]:
    """The file of the newest log that identifies parameters, and its lines; none of them without
    one.

    logs: the newest first.
    """
    identified = [one for one in logs if one.parameters]
    if not identified:
        return "", ()
    newest, older = identified[0], identified[1 : 1 + LAST_ON_PAGE]
    past = history(list(reversed(older)))
    limits = limits_of({name: [value for _, value in every] for name, every in past.items()})
    found = {}
    for each in newest.parameters:
        name = NAMED.get(str(each["name"]), str(each["name"]))
        if name not in MEANING_OF:
            continue
        sign = -1.0 if name == "F_sn" else 1.0
        value, low, high = (sign * float(each.get(key) or each["after"])
                            for key in ("after", "low", "high"))  # fmt: skip
        low, high = min(low, high), max(low, high)
        allowed = limits.get(name)
        light = light_of(value, low, high, allowed) if allowed else ""
        found[name] = AxisLine(
            MEANING_OF[name], str(each.get("unit", "")), value, low, high, allowed, light
        )
    return newest.file, [found[name] for name in MEANING_OF if name in found]


def history(logs: Sequence[TestedLog]) -> dict[str, list[tuple[float, float]]]:
    """Values of the logs by quantity, each with the moment at which its log was recorded."""
    out: dict[str, list[tuple[float, float]]] = {}
    for one in logs:
        found = {str(each["name"]): float(each["after"]) for each in one.parameters}
        if "F_cp" in found and "F_cn" in found and "constant_force.F_0" not in found:
            found["constant_force.F_0"] = 0.5 * (found["F_cn"] - found["F_cp"])
        for name, value in found.items():
            name = NAMED.get(name, name)
            if name in MEANING_OF:
                size = abs(value) if name == "F_sn" else value
                out.setdefault(name, []).append((one.recorded_at, size))
    return out
