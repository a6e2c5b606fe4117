"""Model + Design -> Validation: the loop in simulation, on the identified plant and another."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from design.asked import Limits
from design.closed_loop.driven_loop import effects_left_out
from design.closed_loop.loop_figures import (
    ALMOST,
    COMPENSATED,
    PRESENT,
    SCHEDULED,
    WEAK,
    LoopFigures,
    Traces,
    tested_of,
    tried_loops,
)
from design.controllers.recommend import called, cycle_words, reasons
from design.machine.design import Design
from design.machine.documents import design_digest
from design.machine.model import Model
from design.machine.readable import Display
from design.machine.versions import versions
from identification.model.estimates import Estimate
from identification.remarks import MinorRemark


@dataclass(frozen=True)
class Validation:
    """Every controller on every plant (by names like "rst", then "model", "plant").

    judged: the loop that decides, which is the one recommended; "rst + compensator" is that of the
    RST with the compensator, "pid + schedule" with its gain schedule, "present" that of the
    controller that the machine has now. why: what speaks for the tested one. design: digest of the
    design. lacks: what the design's model lacks, "" where nothing.
    """

    card: str
    judged: str
    passed: bool
    limits: Limits
    figures: Mapping[str, Mapping[str, LoopFigures]]
    remarks: tuple[str, ...]
    versions: Mapping[str, str]
    why: str = ""
    design: str = ""
    lacks: str = ""


def validate(
    model: Model,
    found: Design,
    rng: np.random.Generator,
    *,
    plant: Model | None = None,
    limits: Limits | None = None,
) -> tuple[Validation, Mapping[tuple[str, str], Traces]]:
    """The design on the model it was made for and on `plant`, with the noise of the logs.

    The recommended controller is tested, on every plant. Raises BadModel where the design does
    not fit the plant (a force loop without an actuator).
    """
    limits = limits or Limits()
    model = with_resonance(model, found.plant.resonance)
    plant = None if plant is None else with_resonance(plant, found.plant.resonance)
    plants = {"model": model} | ({"plant": plant} if plant else {})
    figures: dict[str, dict[str, LoopFigures]] = {}
    traces: dict[tuple[str, str], Traces] = {}
    unseen: list[str] = []
    for place, machine in plants.items():
        refused = list[str]()
        for name, tried in tried_loops(machine, model, found, limits, rng, refused).items():
            figures.setdefault(name, {})[place], traces[name, place] = tried
        unseen += [f"the present controller is not shown on the {place}: {why}" for why in refused]
    figures = calm_or_missed(figures, model.display)
    alone = tested_of(found)
    with_it = found.recommendation is not None and found.recommendation.compensator
    judged = alone + (COMPENSATED if with_it else "")
    first = {name: places["model"] for name, places in figures.items()}
    read: dict[str, Model | Design | None] = {"model": model, "design": found, "plant": plant}
    return Validation(
        card=model.card,
        judged=judged,
        passed=all(one.passed for one in figures[judged].values()),
        limits=limits,
        figures=figures,
        remarks=(
            *(f"{name}: {line}" for name, one in read.items() if one for line in one.read),
            *unseen,
            *_remarks(figures, judged, found, (model, plant)),
        ),
        versions=versions(),
        why=reasons(alone, with_it, first, model.display),
        design=design_digest(found),
        lacks=found.lacks or model.lacks,
    ), traces


def with_resonance(model: Model, resonance: Mapping[str, Estimate] | None) -> Model:
    """The model with this resonance, where it has none of its own."""
    if model.resonance is not None or resonance is None:
        return model
    return replace(model, resonance=resonance)


def calm_or_missed(
    figures: Mapping[str, Mapping[str, LoopFigures]], units: Display
) -> dict[str, dict[str, LoopFigures]]:
    """The figures, in which a loop misses a limit that swings at rest where the same controller
    alone, or the one that the machine has now, does not."""
    out = {name: dict(places) for name, places in figures.items()}
    for name, places in out.items():
        alone = name.removesuffix(COMPENSATED).removesuffix(SCHEDULED)
        for place, one in places.items():
            before = [other for other in (alone, PRESENT) if other != name]
            calm = [
                other for other in before
                if (its := figures.get(other, {}).get(place)) and its.stable
                and its.limit_cycle is None
            ]  # fmt: skip
            if one.limit_cycle is not None and calm:
                said = f"swings at rest, {cycle_words(one.limit_cycle, units)}, where"
                other = "the present controller" if calm[0] == PRESENT else calm[0].upper()
                places[place] = replace(one, missed=(*one.missed, f"{said} {other} alone does not"))
    return out


def _remarks(
    figures: Mapping[str, Mapping[str, LoopFigures]],
    judged: str,
    found: Design,
    machines: Sequence[Model | None],
) -> list[str]:
    alone = judged.removesuffix(COMPENSATED)
    out: list[str] = [
        MinorRemark(
            f"with the compensator, on the {place}: error at standstill"
            f" {100 * figures[alone][place].standstill_relative:.3g} ->"
            f" {100 * one.standstill_relative:.3g} %, along the smooth reference"
            f" {100 * figures[alone][place].smooth_relative:.3g} ->"
            f" {100 * one.smooth_relative:.3g} %{'' if one.stable else ', unstable'}"
        )
        for place, one in figures.get(alone + COMPENSATED, {}).items()
    ]
    if found.recommended == "none":
        why = f" ({found.recommendation.why})" if found.recommendation else ""
        out.insert(0, f"the design recommends no controller{why}; its {alone.upper()} is shown")
    out += dict.fromkeys(
        said for machine in machines if machine and (said := effects_left_out(machine))
    )
    unit = found.display
    for name, places in figures.items():
        for place, one in places.items():
            seen = _seen(one, unit, missed=name == judged or not name.endswith(COMPENSATED))
            lines = (f"{called(name)} on the {place}: {line}" for line in seen)
            # What the table of the loops shows of those that nobody takes is an aside.
            out += lines if name in (judged, alone) else map(MinorRemark, lines)
    if found.compensator.assumed:
        out.append(f"simulated with assumed values of {', '.join(found.compensator.assumed)}")
    return out


def _seen(one: LoopFigures, units: Display, *, missed: bool) -> Iterator[str]:
    """A limit cycle, and limits that a loop hits or comes near, in words.

    missed: what a loop misses is reported elsewhere, a command at its limit among it.
    """
    if one.limit_cycle:
        weak = one.margins is None or one.margins.modulus < WEAK
        cause = "too little margin" if weak else "as an integrator against stiction makes"
        yield f"{cycle_words(one.limit_cycle, units)}, {cause}"
    peak, limit = one.command_peak, one.command_limit
    reported = missed and one.limited > 0.0
    if one.stable and not reported and peak is not None and limit and peak >= ALMOST * limit:
        force = f", {one.force_peak:.3g} of {one.force_limit or 0.0:.3g} {units.force}"
        yield (
            f"the command reaches {peak:.3g} of {limit:.3g} {one.command_unit}"
            f"{force if one.force_limit else ''}"
            f"{f', {100 * one.limited:.2g} % of the time at its limit' if one.limited else ''}"
        )


def validation_document(found: Validation) -> dict[str, Any]:
    """The validation as validation.json writes it, the schema first."""
    document = asdict(found)
    for name, places in found.figures.items():
        for place, one in places.items():
            document["figures"][name][place]["passed"] = one.passed
    return {"schema": "validation/1", **document}
