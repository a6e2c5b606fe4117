"""Model + Design -> Validation: the loop in simulation, on the identified plant and another."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from design.loop import LoopRun
from design.margins import margins
from design.rst import closed_loop_poles
from design.tune import worst_modulus
from identification.arrays import Array
from identification.errors import BadSpecification
from workbench.closed_loop import loop_period, run_loop
from workbench.design_values import Controller, Design, Linear, MarginValues, margin_values
from workbench.limit_cycle import LimitCycle, limit_cycle
from workbench.model import Model, versions
from workbench.tuning import corners, linear_plant_of

STEP_SHARE = 0.25  # of the travel seen in the logs
SMOOTH_SHARE = 0.4
SMOOTH_SPEED = 0.03  # frequency of the smooth reference, in units of w_n
DWELLS = 15.0  # length of a step, in time constants of the slowest loop
SHORTEST_DWELL = 1.0  # s
LAST_DWELL = 10.0  # s
LAST = 0.5  # part of a dwell that is judged
WEAK = 0.2  # modulus margin below which the loop, not stiction, makes a limit cycle
BEYOND = 1.2  # times the largest force in the logs that the loop may ask for unremarked
ESCAPED = 10.0  # times the step


@dataclass(frozen=True)
class Limits:
    """What a loop must keep to pass: margins, standstill error relative to the step, and the
    error along the smooth reference relative to its amplitude."""

    modulus: float = 0.5
    delay: float = 2.0
    standstill: float = 0.05
    tracking: float = 0.15


@dataclass(frozen=True)
class Figures:
    """A controller on a plant: errors in m, relative ones to step and amplitude; force in N.

    standstill: largest error in the last half of a dwell. overshoot: relative to the step.
    margins is None where the linear loop is unstable.
    """

    stable: bool
    margins: MarginValues | None
    step: float
    standstill: float
    standstill_relative: float
    overshoot: float
    step_rms: float
    smooth_rms: float
    smooth_relative: float
    force_rms: float
    force_peak: float
    limit_cycle: LimitCycle | None
    missed: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether every limit is kept."""
        return not self.missed


@dataclass(frozen=True)
class Validation:
    """Every controller on every plant (by names like "rst", then "model", "plant")."""

    card: str
    judged: Literal["rst", "pid"]
    passed: bool
    limits: Limits
    figures: Mapping[str, Mapping[str, Figures]]
    remarks: tuple[str, ...]
    versions: Mapping[str, str]
    schema: Literal["validation/1"] = "validation/1"


@dataclass(frozen=True)
class Traces:
    """The simulated loops behind one entry of a validation."""

    step: LoopRun
    smooth: LoopRun


def validate(
    model: Model,
    found: Design,
    rng: np.random.Generator,
    *,
    plant: Model | None = None,
    limits: Limits | None = None,
) -> tuple[Validation, Mapping[tuple[str, str], Traces]]:
    """The design on the model it was made for and on `plant`, with the noise of the logs.

    The recommended controller is judged, on every plant. Raises BadModel where the design does
    not fit the plant (a force loop without an actuator).
    """
    limits = limits or Limits()
    reference = references(model, found)
    plants = {"model": model} | ({"plant": plant} if plant else {})
    figures: dict[str, dict[str, Figures]] = {}
    traces: dict[tuple[str, str], Traces] = {}
    for name, controller in found.controllers.items():
        figures[name] = {}
        for place, machine in plants.items():
            step, smooth = (run_loop(machine, found, controller, r, rng) for r in reference)
            run = Traces(step, smooth)
            traces[name, place] = run
            figures[name][place] = _figures(machine, found, controller, run, limits)
    judged = judged_of(found)
    return Validation(
        card=model.card,
        judged=judged,
        passed=all(one.passed for one in figures[judged].values()),
        limits=limits,
        figures=figures,
        remarks=tuple(_remarks(figures[judged], found, plants)),
        versions=versions(),
    ), traces


def references(machine: Model, found: Design) -> tuple[Array, Array]:
    """Steps and the smooth reference [m], the same for every controller and plant.

    Levels from the travel that the logs have shown; the last one is held for long, since a limit
    cycle of an integrator against stiction may take seconds.
    """
    low, high = machine.travel
    step, amplitude = STEP_SHARE * (high - low), SMOOTH_SHARE * (high - low)
    h = loop_period(found)
    n = round(max(DWELLS * slowest(found), SHORTEST_DWELL) / h)
    counts = [n, n, n, max(3 * n, round(LAST_DWELL / h))]
    levels = np.repeat(np.array([0.0, step, -step, 0.0]), counts)
    w = SMOOTH_SPEED * found.controllers[judged_of(found)].dominant[0]
    t = h * np.arange(round(2.5 * 2 * np.pi / w / h), dtype=np.float64)
    rise = np.clip(t * w / np.pi, 0.0, 1.0)
    return levels, amplitude * np.sin(w * t) * rise**2 * (3 - 2 * rise)


def slowest(found: Design) -> float:
    """Time constant [s] of the slowest pole of all loops on the design's plant."""
    radius = max(
        float(np.abs(closed_loop_poles(found.plant.A, found.plant.B, one.rst)[0]))
        for one in found.controllers.values()
    )
    return -found.plant.h / float(np.log(min(radius, 0.9999)))


def judged_of(found: Design) -> Literal["rst", "pid"]:
    """The controller that decides: the recommended one, or the one there is."""
    if found.recommended in found.controllers:
        return found.recommended
    return "rst" if found.rst else "pid"


def _figures(
    machine: Model, found: Design, one: Controller, run: Traces, limits: Limits
) -> Figures:
    step = float(np.max(run.step.r))
    amplitude = float(np.max(np.abs(run.smooth.r)))
    stable = _stays(run.step, step) and _stays(run.smooth, amplitude)
    judged = _judged(run.step)
    standstill = float(np.max(np.abs(run.step.r - run.step.y)[judged])) if stable else np.inf
    smooth = float(np.sqrt(np.mean((run.smooth.r - run.smooth.y) ** 2)))
    margin = _linear_margins(machine, found, one)
    result = Figures(
        stable=stable,
        margins=margin,
        step=step,
        standstill=standstill,
        standstill_relative=standstill / step,
        overshoot=_overshoot(run.step, step),
        step_rms=float(np.sqrt(np.mean((run.step.r - run.step.y) ** 2))),
        smooth_rms=smooth,
        smooth_relative=smooth / amplitude,
        force_rms=float(np.sqrt(np.mean(run.step.F**2))),
        force_peak=float(max(np.max(np.abs(run.step.F)), np.max(np.abs(run.smooth.F)))),
        limit_cycle=limit_cycle(run.step, machine.fit.noise_y) if stable else None,
        missed=(),
    )
    return Figures(**{**_shallow(result), "missed": _missed(result, limits, found, machine)})


def _shallow(value: Figures) -> dict[str, Any]:
    return {name: getattr(value, name) for name in value.__dataclass_fields__}


def _stays(trace: LoopRun, size: float) -> bool:
    """Whether a loop stays near a reference of this size [m]; not where it is lost to NaN."""
    return bool(np.all(np.abs(trace.y) < ESCAPED * size))


def _judged(trace: LoopRun) -> Any:
    """The last half of every dwell, True at its samples."""
    change = np.flatnonzero(np.diff(trace.r)) + 1
    starts = np.concatenate([[0], change, [len(trace.r)]])
    keep = np.zeros(len(trace.r), dtype=bool)
    for low, high in pairwise(starts.tolist()):
        keep[high - round(LAST * (high - low)) : high] = True
    return keep


def _overshoot(trace: LoopRun, step: float) -> float:
    """Largest overshoot of a step, relative to its height."""
    change = np.flatnonzero(np.diff(trace.r)) + 1
    ends = np.append(change[1:], len(trace.r))
    worst = 0.0
    for low, high in zip(change, ends, strict=True):
        height = float(trace.r[low] - trace.r[low - 1])
        beyond = float(np.max(np.sign(height) * (trace.y[low:high] - trace.r[low])))
        worst = max(worst, beyond / abs(height))
    return worst


def _linear_margins(machine: Model, found: Design, one: Controller) -> MarginValues | None:
    """Margins of the controller on the machine's own linear plant; None where it is unstable."""
    try:
        plant = linear_plant_of(machine, found)
        margin = margins(plant.A, plant.B, one.rst)
    except BadSpecification:
        return None
    return margin_values(margin, _worst(machine, found, one, plant))


def _worst(machine: Model, found: Design, one: Controller, plant: Linear) -> float | None:
    """Least modulus margin over the machine's intervals; None: unstable for some of them."""
    try:
        others = corners(machine, plant, found.force)
    except BadSpecification:
        return None
    return worst_modulus([(np.array(plant.A), np.array(plant.B)), *others], one.rst)


def _missed(result: Figures, limits: Limits, found: Design, machine: Model) -> tuple[str, ...]:
    """What a controller does not keep, in words."""
    unit = "rad" if machine.rotary else "m"
    if not result.stable:
        return ("the simulated loop runs away",)
    missed: list[str] = []
    if result.margins is None:
        missed.append("the linear loop is unstable")
    else:
        if not (result.margins.modulus >= limits.modulus):
            said = f"{result.margins.modulus:.3f}, at least {limits.modulus:g} needed"
            missed.append(f"modulus margin {said}")
        samples = result.margins.delay_samples
        if samples is not None and not (samples >= limits.delay):
            missed.append(f"delay margin {samples:.2f} samples, at least {limits.delay:g} needed")
    if not (result.standstill_relative <= limits.standstill):
        missed.append(
            f"error at standstill {result.standstill:.3g} {unit},"
            f" {100 * result.standstill_relative:.1f} % of the step, at most"
            f" {100 * limits.standstill:g} % allowed"
        )
    if not (result.smooth_relative <= limits.tracking):
        missed.append(
            f"error along the smooth reference {100 * result.smooth_relative:.1f} % of its"
            f" amplitude, at most {100 * limits.tracking:g} % allowed"
        )
    return tuple(missed)


def _remarks(
    figures: Mapping[str, Figures], found: Design, plants: Mapping[str, Model]
) -> list[str]:
    out = ["the compensator is not part of this loop yet: friction is met by feedback alone"]
    for place, one in figures.items():
        if one.limit_cycle:
            weak = one.margins is None or one.margins.modulus < WEAK
            cause = "too little margin" if weak else "as an integrator against stiction makes"
            out.append(
                f"limit cycle on the {place}: {one.limit_cycle.amplitude:.3g} peak to peak every"
                f" {one.limit_cycle.period:.3g} s, {cause}"
            )
        seen = plants[place].force_peak
        if one.force_peak > BEYOND * seen:
            out.append(
                f"the loop on the {place} asks for {one.force_peak:.3g} of force, the logs show"
                f" {seen:.3g} at most; see that the machine has it"
            )
    if found.compensator.assumed:
        out.append(f"simulated with assumed values of {', '.join(found.compensator.assumed)}")
    return out


def validation_document(found: Validation) -> dict[str, Any]:
    """The validation as validation.json writes it, the schema first."""
    document = asdict(found)
    for name, places in found.figures.items():
        for place, one in places.items():
            document["figures"][name][place]["passed"] = one.passed
    return {"schema": document.pop("schema"), **document}
