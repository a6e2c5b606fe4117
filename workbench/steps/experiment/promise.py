"""What a run promises, by the estimator itself on simulated logs of it; and whether it is safe."""

from collections.abc import Mapping, Sequence

import numpy as np

from design.experiment.limits import MotionLimits, Peaks, peaks
from identification.arrays import Array
from identification.errors import BadModel, UserError
from identification.estimation.settling import settled
from identification.estimation.windowed_run.parameters import names_of, values_of
from identification.model.estimates import Estimate
from identification.model.plant import Plant
from identification.progress import Progress, quiet
from workbench.documents.model import Model
from workbench.steps.experiment.machines import Bench
from workbench.steps.experiment.planned import Promised, Safety, half_width

SAFETY_PASSES = 8  # in which a reference is made smaller until no limit is exceeded
SMALLER_SCALE = 0.93  # in each


def promised(
    bench: Bench, plants: Sequence[Plant], r: Array, rng: np.random.Generator, report: Progress
) -> tuple[Promised, ...]:
    """Half the 95 % intervals that a fit of the run is to give, the median over these plants.

    Each plant runs with the sensors' noise, and the fit converges to it as it would on a log.
    """
    found: list[Mapping[str, Estimate]] = []
    for i, plant in enumerate(plants):
        report("what it promises", i / len(plants))
        noise, settle = rng.spawn(2)
        try:
            recorded = bench.recorded(bench.log(bench.run(plant, r, noise)))
            fit = settled(bench.fitted(plant), recorded, 1.0, settle, quiet)
        except UserError:
            continue
        found.append(fit.estimates)
    plant = bench.fitted(plants[0])
    names = names_of(plant, bench.drive)
    values = dict(zip(names, values_of(plant, names).tolist(), strict=True))
    units = {**bench.model.friction, **(bench.model.actuator or {})}
    out = []
    for name, value in values.items():
        now = _estimate(bench.model, name)
        relative = [
            half / abs(one[name].value or 1.0)
            for one in found
            if name in one and (half := half_width(one[name])) is not None
        ]
        identified_share = len(relative) / len(plants)
        after = abs(value) * float(np.median(relative)) if identified_share >= 0.5 else None
        unit = now.unit if now is not None else units[name].unit
        out.append(
            Promised(
                name, unit, value, None if now is None else half_width(now), after, identified_share
            )
        )
    return tuple(out)


def _estimate(model: Model, name: str) -> Estimate | None:
    """The model's estimate of a parameter, effects' as key.name."""
    if "." in name:
        key, own = name.split(".")
        return model.effects[key].get(own)
    return {**model.friction, **(model.actuator or {})}.get(name)


def made_safe(
    bench: Bench, plants: Sequence[Plant], r: Array, limits: MotionLimits, rng: np.random.Generator
) -> tuple[Array, Safety]:
    """The reference, made smaller about home until none of these plants exceeds a limit.

    Raises BadModel where none of them can be followed.
    """
    seeds, scale = rng.spawn(len(plants)), 1.0
    smaller, (worst, exceeding) = r, _extremes(bench, plants, r, limits, seeds)
    for _ in range(SAFETY_PASSES):
        if exceeding == 0:
            break
        scale *= SMALLER_SCALE
        smaller = limits.home + scale * (r - limits.home)
        worst, exceeding = _extremes(bench, plants, smaller, limits, seeds)
    if worst is None:
        raise BadModel("none of the drawn machines can be simulated in this loop; check the model")
    return smaller, Safety(len(plants), worst, exceeding, scale)


def _extremes(
    bench: Bench, plants: Sequence[Plant], r: Array, limits: MotionLimits,
    seeds: Sequence[np.random.Generator],
) -> tuple[Peaks | None, int]:  # fmt: skip
    """The extremes of all plants along r, and how many exceed a limit or cannot be followed."""
    worst: Peaks | None = None
    exceeding = 0
    for plant, rng in zip(plants, seeds, strict=True):
        try:
            own = peaks(bench.run(plant, r, rng))
        except UserError:
            exceeding += 1
            continue
        exceeding += bool(own.exceeded(limits))
        worst = own if worst is None else worst.or_more(own)
    return worst, exceeding
