"""design.json read back, in SI, and refused where it contradicts itself."""

from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from design.cascade import CascadeGains
from design.feed_forward import FeedForward
from design.pid import PIDGains
from design.series_filters import SeriesFilter
from identification.errors import BadModel, BadSpecification
from identification.model.estimates import Estimate
from workbench.cards.nearest import nearest
from workbench.cards.parameter_units import Shown, converted, in_unit
from workbench.documents.design import (
    CompensatorValues,
    Controller,
    Design,
    GainSchedule,
    Linear,
    ScheduledController,
    Structure,
)
from workbench.documents.design_file import (
    DESIGN_SCHEMA,
    POLE_UNITS,
    UNITS_OF,
    ControllerFile,
    DesignFile,
    Numbers,
    ScheduleFile,
    SeriesFile,
    as_file,
    schedule_units,
    units_of,
)
from workbench.documents.drive import (
    command_of,
    filters_of,
    force_of,
    law_of,
    number,
    positive,
    present_of,
)
from workbench.documents.model import used
from workbench.documents.plausible import refuse_apart, refuse_unequal
from workbench.documents.reading import Stored, read_result

Value = TypeVar("Value")
DERIVED = ("k_p_command",)  # numbers that a file has for its reader alone


def read_design(path: Path | Stored) -> Design:
    """The design in the file `path`, or stored, in SI; raises BadModel in one line where it is
    none."""
    written = read_result(path, DesignFile, DESIGN_SCHEMA)
    units = units_of(written)
    try:
        found = _from_file(written, units)
        _refuse_other_laws(written, found, units)
        pairs = tuple(_pairs(written, as_file(found, units), ""))
        _refuse_changed_units(pairs, found)
    except (BadModel, BadSpecification) as error:
        raise BadModel(f"{path}: {error}") from None
    if not found.controllers:
        raise BadModel(f"{path}: holds no controller; run 'workbench design' again")
    said = (converted(one, ours, f"[{where}]") for where, one, ours in pairs)
    return replace(found, read=tuple(line for line in said if line))


def _pairs(written: object, ours: object, where: str) -> Iterator[tuple[str, Estimate, Estimate]]:
    """Every parameter of a file as it is written and in our units, with its place."""
    if isinstance(written, Estimate) and isinstance(ours, Estimate):
        yield where, written, ours
    elif isinstance(written, Mapping) and isinstance(ours, Mapping):
        for key, one in written.items():
            yield from _pairs(one, ours.get(key), f"{where}.{key}")
    elif is_dataclass(written):
        for each in fields(written):
            place = f"{where}.{each.name}" if where else each.name
            yield from _pairs(getattr(written, each.name), getattr(ours, each.name), place)


def _refuse_changed_units(pairs: tuple[tuple[str, Estimate, Estimate], ...], found: Design) -> None:
    """Raises BadModel where a value in another unit is not what the file says in other places."""
    at = {where: (one, ours) for where, one, ours in pairs}
    start = "compensator.friction."
    nine = {w.removeprefix(start): both for w, both in at.items() if w.startswith(start)}
    refuse_apart(
        {name: both[0] for name, both in nine.items()},
        {name: both[1] for name, both in nine.items()},
        f"[{start}",
    )
    if "plant.m" in at:
        (one, ours), (other, same) = at["plant.m"], nine["m"]
        refuse_unequal("[plant.m]", one, ours, used(same), f"[{start}m]")
        refuse_unequal(f"[{start}m]", other, same, used(ours), "[plant.m]")
    for name in found.controllers:
        place = name.replace("-", "_")
        (one, ours), (other, same) = at[f"{place}.h"], at["plant.h"]
        refuse_unequal(f"[{place}.h]", one, ours, used(same), "[plant.h]")
        refuse_unequal("[plant.h]", other, same, used(ours), f"[{place}.h]")


def _refuse_other_laws(written: DesignFile, found: Design, units: Shown) -> None:
    """Raises BadModel where a law is not the controller beside it."""
    every: tuple[tuple[Structure, ControllerFile | None], ...] = (
        ("rst", written.rst), ("pid", written.pid), ("p-pi", written.p_pi),
    )  # fmt: skip
    for name, one in every:
        if one is None or one.law is None:
            continue
        if found.command is None:
            raise BadModel(f"[{name}.law] needs [command]; run 'workbench design' again")
        law = law_of(one.law, units, f"{name}.law")
        ours = found.controllers[name].law(found.command)
        for key in "RST":
            mine, other = getattr(ours, key), getattr(law, key)
            if len(mine) != len(other) or not np.allclose(mine, other, rtol=1e-9, atol=0.0):
                raise BadModel(
                    f"[{name}.law] {key} is not [{name}] {key} in the unit of the command; run"
                    " 'workbench design' again"
                )


def _from_file(found: DesignFile, units: Shown) -> Design:
    p, c = found.plant, found.compensator
    mass, viscous = units.friction["m"], units.friction["F_vp"]
    return Design(
        card=found.card,
        motion=found.motion,
        plant=Linear(
            p.source,
            p.why,
            p.A,
            p.B,
            positive(p.h, "s", "plant.h"),
            None if p.m is None else in_unit(p.m, mass, "[plant.m]"),
            None if p.F_v is None else in_unit(p.F_v, viscous, "[plant.F_v]"),
            p.resonance,
        ),
        force=None if found.force is None else force_of(found.force, units, "force"),
        rst=None if found.rst is None else _controller(found.rst, units, "rst"),
        pid=None if found.pid is None else _controller(found.pid, units, "pid"),
        p_pi=None if found.p_pi is None else _controller(found.p_pi, units, "p_pi"),
        refused=found.refused,
        recommended=found.recommended,
        compensator=CompensatorValues(
            number(c.N_c, "1", "compensator.N_c"),
            number(c.e_T, units.position, "compensator.e_T"),
            {name: _nine(e, name, units) for name, e in c.friction.items()},
            None if c.filters is None else filters_of(c.filters),
            None if c.filters is None else positive(c.filters.h, "s", "compensator.filters.h"),
            c.excess,
        ),
        remarks=found.remarks,
        versions=found.versions,
        command=None if found.command is None else command_of(found.command, found.motion),
        present=None if found.present is None else present_of(found.present, units, "present"),
        recommendation=found.recommendation,
        schedule=None if found.schedule is None else _schedule(found.schedule, units),
    )


def _schedule(found: ScheduleFile, units: Shown) -> GainSchedule:
    """The schedule; raises BadModel where a controller has not one at every point."""
    names = schedule_units(found.over, units)
    rows = [
        tuple(_numbers(one, names, f"schedule.points[{k}]").values())
        for k, one in enumerate(found.points)
    ]
    controllers = dict[Structure, ScheduledController]()
    for name, written in (("pid", found.pid), ("p-pi", found.p_pi)):
        if written is None:
            continue
        if len(written.points) != len(rows):
            raise BadModel(
                f"[schedule.{name}] {len(written.points)} controllers at {len(rows)} points; run"
                " 'workbench design' again"
            )
        points = [_controller(one, units, f"schedule.{name}") for one in written.points]
        structure: Structure = "pid" if name == "pid" else "p-pi"
        controllers[structure] = ScheduledController(
            tuple(points), written.recommended, written.why
        )
    friction = tuple((row[1], row[2], row[3], row[4]) for row in rows)
    return GainSchedule(found.over, tuple(row[0] for row in rows), friction, controllers)


def _controller(one: ControllerFile, units: Shown, where: str) -> Controller:
    rate, dominant = one.reference_rate, _numbers(one.dominant, POLE_UNITS, f"{where}.dominant")
    for name, value in dominant.items():
        positive(Estimate(value, POLE_UNITS[name]), POLE_UNITS[name], f"{where}.dominant.{name}")
    if rate.value is None and not rate.reason:
        raise BadModel(f"[{where}.reference_rate] is null; it needs a 'reason'")
    at = f"{where}.reference_rate"
    return Controller(
        R=one.R,
        S=one.S,
        T=one.T,
        h=positive(one.h, "s", f"{where}.h"),
        dominant=(dominant["w_n"], dominant["zeta"]),
        auxiliary=one.auxiliary,
        margins=one.margins,
        rate=None if rate.value is None else positive(rate, units.velocity, at),
        lag=number(one.reference_lag, "s", f"{where}.reference_lag"),
        overshoot=one.overshoot,
        missed=one.missed,
        gains=_read(PIDGains, one.gains, units, f"{where}.gains"),
        note=one.note,
        W=None if one.law is None else one.law.W,
        cascade=_read(CascadeGains, one.cascade, units, f"{where}.cascade"),
        series=None if one.filter is None else _series(one.filter, one.h, f"{where}.filter"),
        feed_forward=_read(FeedForward, one.feed_forward, units, f"{where}.feed_forward"),
        acceleration=None if one.reference_acceleration is None else positive(
            one.reference_acceleration, f"{units.position}/s^2", f"{where}.reference_acceleration"
        ),
    )  # fmt: skip


def _read(kind: type[Value], found: Numbers | None, units: Shown, where: str) -> Value | None:
    """A value of `UNITS_OF`, None for None; raises BadModel where a number is missing."""
    if found is None:
        return None
    return kind(**_numbers(found, units.by_name(UNITS_OF[kind]), where))


def _numbers(found: Numbers, units: Mapping[str, str], where: str) -> dict[str, float]:
    """The numbers of these names; raises BadModel where one is missing or is not known."""
    for name in found:
        if name not in units and name not in DERIVED:
            raise BadModel(f"[{where}] unknown key {name!r}{nearest(name, units)}")
    out = {}
    for name, unit in units.items():
        one = found.get(name)
        if one is None:
            raise BadModel(f"[{where}] has no {name!r}; add it, or run the command again")
        out[name] = number(one, unit, f"{where}.{name}")
    return out


def _series(found: SeriesFile, h: Estimate, where: str) -> SeriesFilter:
    """The filter; raises BadModel where its coefficients are not those of its numbers."""
    one = SeriesFilter(
        found.kind,
        positive(found.frequency, "Hz", f"{where}.frequency"),
        number(found.numerator, "1", f"{where}.numerator"),
        positive(found.denominator, "1", f"{where}.denominator"),
        positive(h, "s", f"{where}.h"),
    )
    made = one.filter
    for key, ours, theirs in (("b", made.b, found.b), ("a", made.a, found.a)):
        if len(ours) != len(theirs) or not np.allclose(ours, theirs, rtol=1e-9, atol=1e-12):
            raise BadModel(
                f"[{where}] {key} is not the {found.kind} of its numbers; run 'workbench design'"
                " again"
            )
    return one


def _nine(found: Estimate, name: str, units: Shown) -> Estimate:
    where = f"[compensator.friction.{name}]"
    if name not in units.friction:
        raise BadModel(f"{where} is none of the nine: {', '.join(units.friction)}")
    if found.value is None and (not found.reason or found.assumed is None):
        raise BadModel(f"{where} is null; it needs a 'reason' and the value 'assumed' instead")
    return in_unit(found, units.friction[name], where)
