"""What a user says beside a model whose tables are asked for, and what the files hold, for a
terminal and as a document."""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from design.generated.compensation import Compensation, Encoder, TablesAsked
from design.generated.tables import Tables, costs_of
from design.machine.readable import Display, number
from identification.errors import BadModel
from workbench.cards.units import in_unit_of
from workbench.output import written
from workbench.screen import Screen, instead, listed, more, screen, tabled

FILES_HEAD = ("file", "units", "points", "off the model by")


def tables_screen(what: Compensation, found: Tables, folder: Path) -> Screen:
    """The answer in words, what each file holds, and what none of them can."""
    rows = [
        (one.name, one.units, str(one.points),
         "-" if one.error is None else f"{100.0 * one.error:.2f} %")
        for one in found.files
    ]  # fmt: skip
    names = [one.name for one in found.files]
    beside = f" and {len(names) - 1} beside it" if len(names) > 1 else ""
    remarks = dict.fromkeys(line for one in found.files for line in one.remarks)
    return screen(
        _sentence(what, found),
        tabled(FILES_HEAD, rows, right=(2, 3)),
        listed(_left_out(what, found)),
        listed(f"note: {line}" for line in (*what.missing, *remarks)),
        listed((f"left out: {line}" for line in found.left_out), most=6),
        instead((), [f"{one.name}: {one.where}" for one in found.files]),
        more("the manual page Compensation tables says where each file is pasted"),
        written(folder, *names[:1]) + beside,
    )


def _sentence(what: Compensation, found: Tables) -> str:
    """What was written, and the friction that it holds."""
    kinds = list(dict.fromkeys(one.table.replace("-", " ") for one in found.files))
    said = f"{what.model.card}: {', '.join(kinds)} from its model"
    if not any(one.table in ("friction-table", "feed-forward") for one in found.files):
        return f"{said}."
    curve, (unit, factor) = what.friction, what.display.shown("velocity")
    ends = np.array([curve.low, curve.high])
    slow, fast = (number(factor * v) for v in ends)
    up, down = (
        " to ".join(number(float(one)) for one in way(ends))
        for way in (curve.positive, curve.negative)
    )
    return (
        f"{said}; sliding from {slow} to {fast} {unit} takes {up} {what.display.force} in positive"
        f" and {down} {what.display.force} in negative direction."
    )


def _left_out(what: Compensation, found: Tables) -> Iterator[str]:
    """Costs with the files that have them, the largest first, those without a size last."""
    for cost, names in costs_of(found).items():
        whose = names[0] if len(names) == 1 else f"{len(names)} of the files"
        yield f"not in {whose}: {cost.in_words(what.display.force)}"


def tables_asked(
    display: Display, name: str | None, speed: str | None, per_turn: str | None, rated: str | None,
    encoder: Encoder | None,
) -> TablesAsked:  # fmt: skip
    """The options in SI; raises BadModel where one is no positive number of its kind."""
    turn = _positive(per_turn, "deg" if display.rotary else "mm", "--per-turn")
    travel = None if turn is None else (math.radians(turn) if display.rotary else 1e-3 * turn)
    high = _positive(speed, display.shown("velocity").name, "--speed")
    high = high if high is None or display.rotary else 1e-3 * high
    unit = "N m" if travel else display.force
    return TablesAsked(name, high, travel, _positive(rated, unit, "--rated"), encoder)


def _positive(written: str | None, unit: str, option: str) -> float | None:
    """The number in `unit`, which it has where it says none."""
    if written is None:
        return None
    found = in_unit_of(written, unit, option)
    if found is None or not (math.isfinite(found) and found > 0):
        raise BadModel(f"{option} {written!r}: a number above 0 needed, in {unit!r} or its like")
    return found
