"""The tables of a model, its feed-forward, and the controls that take them: which files are made
and which not."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from design.compensation_tables import Harmonic, cogging_harmonics, is_cogging
from design.generated.compensation import (
    IDENTIFIED_BY_SLIDING,
    Compensation,
    Content,
    Cost,
    Format,
    TableFile,
    friction_costs,
)
from design.generated.exported import rows
from design.generated.filled import Filled
from design.generated.structured_text import st_syntax
from design.generated.table_formats import (
    BACKLASH,
    COGGING,
    FRICTION,
    NO_COGGING_TABLE,
    NO_FRICTION_TABLE,
    both_ways,
)
from identification.arrays import Array
from identification.effects._base import Acting
from identification.errors import BadModel
from identification.model.plant import Motor

TABLES_SCHEMA = "tables/1"
FILE_KEYS = {"file": "name", **{key: key for key in (
    "table", "control", "units", "where", "points", "error", "costs", "remarks")}}  # fmt: skip
FEED_FORWARD_POINTS = 20  # of the friction curve, each way


@dataclass(frozen=True)
class PlaceForce:
    """Position-dependent forces on the body: constant + sum of waves - k y - k_3 y^3 [N], y [m]."""

    constant: float
    k: float
    k_3: float
    waves: tuple[Harmonic, ...]

    def at(self, y: Array) -> Array:
        """The force [N] at these places."""
        spring = self.constant - (self.k + self.k_3 * y * y) * y
        return np.asarray(spring + sum((one.at(y) for one in self.waves), np.zeros(len(y))))


def place_force(acting: tuple[Acting, ...]) -> PlaceForce:
    """The position-dependent forces among the effects that a feed-forward holds; others it
    leaves."""
    constant = k = k_3 = 0.0
    waves = list(cogging_harmonics(acting))
    for one in acting:
        p = one.values
        match one.key:
            case "constant_force":
                constant += p["F_0"]
            case "spring":
                k, k_3 = k + p["k"], k_3 + p["k_3"]
            case "gravity":
                wave = -complex(p["b"], p["a"])
                phase = float(np.angle(wave)) % (2.0 * np.pi)
                waves.append(Harmonic(2.0 * np.pi * p["turn"], abs(wave), phase))
    return PlaceForce(constant, k, k_3, tuple(one for one in waves if one.amplitude > 0))


def is_included(one: Acting) -> bool:
    """Whether the feed-forward has this position-dependent force."""
    return is_cogging(one) or one.key in ("constant_force", "spring", "gravity")


def _costs(what: Compensation) -> tuple[Cost, ...]:
    """As of a friction table, but for the position-dependent forces that it has."""
    included = {one.key.replace("_", " ") for one in what.model.acting if is_included(one)}
    return tuple(
        one
        for one in friction_costs(what, signed=True)
        if one.what.partition(":")[0] not in included
    )


def feed_forward(what: Compensation, language: str) -> Content:
    """The feed-forward as C99, or as a function block of IEC 61131-3."""
    what.need("a feed-forward", ("m",))
    (v, F, error), model = both_ways(what, FEED_FORWARD_POINTS), what.model
    along_travel = place_force(tuple(one for one in what.places if is_included(one)))
    drive = model.simulated.actuator
    if isinstance(drive, Motor) and not drive.k_a:
        raise BadModel(f"{model.card}: its motor constant k_a is 0; run 'workbench identify' again")
    form = (lambda value: repr(float(value))) if language == "C" else st_syntax("double").number
    length, force = what.display.position, what.display.force
    values = {
        "name": what.name,
        "length": length,
        "force": force,
        "mass_unit": what.display.mass,
        "m": form(model.karnopp.m),
        "last": len(v) - 1,
        "size": len(v),
        "speeds": rows(map(form, v.tolist())),
        "forces": rows(map(form, F.tolist())),
        "constant": form(along_travel.constant),
        "k": form(along_travel.k),
        "k_3": form(along_travel.k_3),
        "waves": [
            (form(one.amplitude), form(2.0 * np.pi / one.period), form(one.phase))
            for one in along_travel.waves
        ],
        "per_force": form(1.0 / drive.k_a) if isinstance(drive, Motor) else None,
        "command": model.rig.command_unit,
        "zero": form(0.0),
    }
    units = f"{length}, {length}/s, {length}/s^2, {force} of the axis"
    small = what.small((*IDENTIFIED_BY_SLIDING, "m"))
    remarks = (*small, *what.unidentified_places, *what.beyond)
    return Content(units, len(v), error, values, _costs(what), remarks)


_IN_C = partial(feed_forward, language="C")
FEED_FORWARD_FILES = {
    "c": (Format("feed_forward.c", "feed-forward", "", "C99: call it every sample", _IN_C),
          Format("feed_forward.h", "feed-forward", "", "C99: its header", _IN_C)),
    "st": (Format("feed_forward.st", "feed-forward", "",
                  "a PLC: import it, call it in the axis's task",
                  partial(feed_forward, language="ST")),),
}  # fmt: skip


FORMATS: Mapping[str, tuple[Format, ...]] = {
    "friction-table": FRICTION,
    "cogging-table": COGGING,
    "backlash": BACKLASH,
}
NOT_THERE: Mapping[str, Mapping[str, str]] = {
    "friction-table": {"codesys": NO_FRICTION_TABLE},
    "cogging-table": NO_COGGING_TABLE,
    "backlash": {},
}


@dataclass(frozen=True)
class Tables:
    """The files of what was asked for, and what is not written, a line each with its reason."""

    files: tuple[TableFile, ...]
    left_out: tuple[str, ...]


def tables(
    what: Compensation, targets: Sequence[str], controls: Sequence[str], filled: Filled
) -> Tables:
    """The files of these targets, for these controls; for every control where none is named.

    filled: fills in their templates. Raises BadModel, in one line, where a target or a control
    that was named cannot be written: what the model lacks, or what only the user can say.
    """
    files, left = list[TableFile](), list[str]()
    for target in dict.fromkeys(targets):
        if target == "csv":
            for table in FORMATS:
                files += _tried(_of(table, ""), what, left, filled)
            if not files:
                raise BadModel("; ".join(left))
        elif target in FEED_FORWARD_FILES:
            files += [one(what, filled) for one in FEED_FORWARD_FILES[target]]
        else:
            files += [one(what, filled) for one in _of(target, "")]
            files += _for_controls(target, what, controls, left, filled)
    for control in controls:
        if left and not any(one.control == control for one in files):
            raise BadModel("; ".join(left))
    by_name = {one.name: one for one in files}
    return Tables(tuple(by_name.values()), tuple(dict.fromkeys(left)))


def _of(table: str, control: str) -> list[Format]:
    """The files of a table for a control, "" for any."""
    return [one for one in FORMATS[table] if one.control == control]


def _tried(
    formats: list[Format], what: Compensation, left: list[str], filled: Filled
) -> list[TableFile]:
    """All files of these formats, or none, and why not among what is `left`."""
    try:
        return [one(what, filled) for one in formats]
    except BadModel as error:
        left.append(str(error))
        return []


def _for_controls(
    target: str, what: Compensation, controls: Sequence[str], left: list[str], filled: Filled
) -> Iterator[TableFile]:
    """The files of each control; one that is not named is left out where a number is wanting."""
    known = dict.fromkeys(one.control for one in FORMATS[target] if one.control)
    for control in controls or known:
        formats, refused = _of(target, control), list[str]()
        if not formats:
            left.append(NOT_THERE[target][control])
        made = [file for one in formats for file in _tried([one], what, refused, filled)]
        if controls and refused and not made:
            raise BadModel(refused[0])
        yield from made
        left += refused


def costs_of(found: Tables) -> dict[Cost, list[str]]:
    """Costs with the files that have them, the largest first, those without a size last."""
    files = dict[Cost, list[str]]()
    for one in found.files:
        for cost in one.costs:
            if cost.force != 0.0:
                files.setdefault(cost, []).append(one.name)
    ordered = sorted(files, key=lambda one: -(one.force if one.force is not None else -1.0))
    return {cost: files[cost] for cost in ordered}


def tables_document(what: Compensation, found: Tables) -> dict[str, Any]:
    """The files with their units, points, error and costs, and what was not written."""
    unit = what.display.force
    return {
        "schema": TABLES_SCHEMA,
        "card": what.model.card,
        "name": what.name,
        "files": [
            {
                **{key: getattr(one, name) for key, name in FILE_KEYS.items()},
                "control": one.control or None,
                "costs": [{"what": c.what, "value": c.force, "unit": unit} for c in one.costs],
            }
            for one in found.files
        ],
        "left_out": found.left_out,
    }
