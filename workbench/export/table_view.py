"""What the files of a model's tables hold, for a terminal and as a document."""

from pathlib import Path
from typing import Any

import numpy as np

from workbench.cards.readable import number
from workbench.export.compensation import Compensation, Cost, cost_line
from workbench.export.table_targets import Tables
from workbench.output import written
from workbench.screen import Screen, instead, listed, more, screen, tabled

FILES_HEAD = ("file", "units", "points", "off the model by")
TABLES_SCHEMA = "tables/1"


def tables_document(what: Compensation, found: Tables, folder: Path) -> dict[str, Any]:
    """The files with their units, points, error and costs, and what was not written."""
    unit = what.force_unit
    return {
        "schema": TABLES_SCHEMA,
        "card": what.model.card,
        "name": what.name,
        "files": [
            {
                "file": one.name,
                "table": one.table,
                "control": one.control or None,
                "units": one.units,
                "where": one.where,
                "points": one.points,
                "error": one.error,
                "costs": [{"what": c.what, "value": c.force, "unit": unit} for c in one.costs],
                "remarks": one.remarks,
            }
            for one in found.files
        ],
        "left_out": found.left_out,
        "out": folder,
    }


def tables_view(what: Compensation, found: Tables, folder: Path) -> Screen:
    """The answer in words, what each file holds, and what none of them can."""
    rows = [(one.name, one.units, str(one.points), _percent(one.error)) for one in found.files]
    costs = _costs(found)
    remarks = dict.fromkeys(line for one in found.files for line in one.remarks)
    paste = [f"{one.name}: {one.where}" for one in found.files]
    return screen(
        _sentence(what, found),
        tabled(FILES_HEAD, rows, right=(2, 3)),
        listed(f"not in {_whose(names)}: {line}" for line, names in _lines(what, costs)),
        listed(f"note: {line}" for line in (*what.missing, *remarks)),
        listed((f"left out: {line}" for line in found.left_out), most=6),
        instead((), paste),
        more("the manual page Compensation tables says where each file is pasted"),
        written(folder, *([one.name for one in found.files][:1])) + _rest(found),
    )


def _rest(found: Tables) -> str:
    """How many files lie beside the first."""
    return f" and {len(found.files) - 1} beside it" if len(found.files) > 1 else ""


def _sentence(what: Compensation, found: Tables) -> str:
    """What was written, and the friction that it holds."""
    kinds = list(dict.fromkeys(one.table.replace("-", " ") for one in found.files))
    said = f"{what.model.card}: {', '.join(kinds)} from its model"
    if not any(one.table in ("friction-table", "feed-forward") for one in found.files):
        return f"{said}."
    curve, (unit, factor) = what.friction, what.speed_unit
    ends = np.array([curve.low, curve.high])
    up, down = curve.positive(ends), curve.negative(ends)
    slow, fast = (number(factor * v) for v in ends)
    return (
        f"{said}; sliding from {slow} to {fast} {unit} takes {number(float(up[0]))} to"
        f" {number(float(up[1]))} {what.force_unit} in positive and {number(float(down[0]))} to"
        f" {number(float(down[1]))} {what.force_unit} in negative direction."
    )


def _percent(error: float | None) -> str:
    return "-" if error is None else f"{100.0 * error:.2f} %"


def _costs(found: Tables) -> dict[Cost, list[str]]:
    """Each cost with the files that have it."""
    out = dict[Cost, list[str]]()
    for one in found.files:
        for cost in one.costs:
            if cost.force != 0.0:
                out.setdefault(cost, []).append(one.name)
    return out


def _lines(what: Compensation, costs: dict[Cost, list[str]]) -> list[tuple[str, list[str]]]:
    """Costs in words, the largest first, those without a size last."""
    order = sorted(costs, key=lambda one: -(one.force if one.force is not None else -1.0))
    return [(cost_line(one, what.force_unit), costs[one]) for one in order]


def _whose(names: list[str]) -> str:
    """The files that a cost is of."""
    return names[0] if len(names) == 1 else f"{len(names)} of the files"
