"""Feed-forward of acceleration, velocity and friction as C99 and Structured Text."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from design.compensation_tables import Harmonic, cogging_harmonics, is_cogging
from identification.arrays import Array
from identification.effects._base import Acting
from identification.errors import BadModel
from identification.model.plant import Motor
from workbench.export.compensation import (
    IDENTIFIED_BY_SLIDING,
    Compensation,
    Cost,
    TableFile,
    friction_costs,
)
from workbench.export.filled import filled, rows
from workbench.export.friction_formats import both_ways
from workbench.export.structured_text import st_syntax

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


def feed_forward_c(what: Compensation) -> tuple[TableFile, ...]:
    """The feed-forward as C99: a header and a source."""
    values = _values(what, "C")
    source = _file(what, "c", values, "C99: call it every sample")
    return source, _file(what, "h", values, "C99: its header")


def feed_forward_st(what: Compensation) -> tuple[TableFile, ...]:
    """The feed-forward as a function block of IEC 61131-3."""
    where = "a PLC: import it, call it in the axis's task"
    return (_file(what, "st", _values(what, "ST"), where),)


def _file(what: Compensation, ending: str, values: dict[str, Any], where: str) -> TableFile:
    name, text = f"feed_forward.{ending}", filled(f"feed_forward.{ending}", **values)
    v, _, error = both_ways(what, FEED_FORWARD_POINTS)
    units = ("rad, rad/s, rad/s^2, N m" if what.rotary else "m, m/s, m/s^2, N") + " of the axis"
    return TableFile(
        f"{what.name}_{name}", text, "feed-forward", "", units, where, len(v), error, _costs(what),
        _remarks_of(what),
    )  # fmt: skip


def _remarks_of(what: Compensation) -> tuple[str, ...]:
    return (*what.small((*IDENTIFIED_BY_SLIDING, "m")), *what.unidentified_places, *what.beyond)


def _costs(what: Compensation) -> tuple[Cost, ...]:
    """As of a friction table, but for the position-dependent forces that it has."""
    included = {one.key.replace("_", " ") for one in what.model.acting if is_included(one)}
    return tuple(
        one
        for one in friction_costs(what, signed=True)
        if one.what.partition(":")[0] not in included
    )


def _values(what: Compensation, language: str) -> dict[str, Any]:
    """What the templates are filled with."""
    what.need("a feed-forward", ("m",))
    model = what.model
    v, F, _ = both_ways(what, FEED_FORWARD_POINTS)
    along_travel = place_force(tuple(one for one in what.places if is_included(one)))
    drive = model.simulated.actuator
    if isinstance(drive, Motor) and not drive.k_a:
        raise BadModel(f"{model.card}: its motor constant k_a is 0; run 'workbench identify' again")
    form = (lambda value: repr(float(value))) if language == "C" else st_syntax("double").number
    return {
        "card": model.card,
        "name": what.name,
        "costs": [one.in_words(what.force_unit) for one in _costs(what)],
        "remarks": _remarks_of(what),
        "length": "rad" if what.rotary else "m",
        "force": what.force_unit,
        "mass_unit": "kg m^2" if what.rotary else "kg",
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
