"""A machine's parameters over its last logs, each with its interval and its active value."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from identification.arrays import Array
from workbench.registry.results import TestedLog
from workbench.report.chart import Area, Chart, Line, Panel

MOST_PARAMETERS = 8
FEWEST_LOGS = 2
PARAMETER_HEIGHT = 190
SPANS = ((86400.0, "days"), (3600.0, "hours"), (60.0, "minutes"), (1.0, "seconds"))


def parameter_charts(logs: Sequence[TestedLog]) -> list[Chart]:
    """The parameters that the logs identify, the one that moved most first; none of a single log.

    logs: the oldest first.
    """
    history = [one for one in logs if one.parameters]
    if len(history) < FEWEST_LOGS:
        return []
    x, label = _times([one.recorded_at for one in history])
    found: dict[str, dict[int, Mapping[str, Any]]] = {}
    for k, one in enumerate(history):
        for parameter in one.parameters:
            found.setdefault(str(parameter["name"]), {})[k] = parameter
    names = sorted(found, key=lambda name: -_moved(found[name]))
    panels = [_panel(name, found[name], x, label) for name in names[:MOST_PARAMETERS]
              if len(found[name]) >= FEWEST_LOGS]  # fmt: skip
    return [Chart("parameters", "parameters over the last logs", panels, columns=2)]


def _panel(name: str, history: Mapping[int, Mapping[str, Any]], x: Array, label: str) -> Panel:
    at = np.array(sorted(history))
    place = x[at]

    def column(key: str) -> Array:
        return np.array(
            [np.nan if history[k].get(key) is None else history[k][key] for k in at], float
        )

    unit = str(history[int(at[0])].get("unit", ""))
    return Panel(
        label, f"{name} [{unit}]",
        [Line("active model", place, column("before"), "reference", "dashed"),
         Line("by each log", place, column("after"), "measured")],
        areas=[Area("95 %", place, column("low"), column("high"), "band")], height=PARAMETER_HEIGHT,
    )  # fmt: skip


def _moved(history: Mapping[int, Mapping[str, Any]]) -> float:
    last = history[max(history)]
    change, sd = abs(float(last.get("change") or 0.0)), float(last.get("sd") or 0.0)
    return change / sd if sd > 0.0 else 0.0


def _times(seconds: Sequence[float]) -> tuple[Array, str]:
    """When the logs were recorded, back from the last one; their numbers where times do not say.

    Equal times are set apart by a little, so that no log hides another.
    """
    at = np.array(seconds) - seconds[-1]
    span = -float(at[0])
    if span <= 0.0 or np.any(np.diff(at) < 0.0):
        return np.arange(1.0, len(seconds) + 1.0), "log"
    size, unit = next((one for one in SPANS if span > 2.0 * one[0]), SPANS[-1])
    return at / size + 1e-6 * np.arange(len(at)), f"{unit} before the last log"
