"""Model + Design -> Validation: the loop in simulation, on the identified plant and another."""

from collections.abc import Iterator, Mapping, Sequence
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
from workbench.cards.parameter_units import shown
from workbench.documents.design import Controller, Design, Linear, MarginValues, margin_values
from workbench.documents.model import Model, versions
from workbench.steps.closed_loop import effects_left_out, loop_period, run_loop
from workbench.steps.design import corners, linear_plant_of
from workbench.steps.limit_cycle import LimitCycle, limit_cycle

STEP_SHARE = 0.25  # of the travel seen in the logs
SMOOTH_SHARE = 0.4
SMOOTH_SPEED = 0.03  # frequency of the smooth reference, in units of w_n
DWELLS = 15.0  # length of a step, in time constants of the slowest loop
SHORTEST_DWELL = 1.0  # s
LAST_DWELL = 10.0  # s
JUDGED_SHARE = 0.5  # part of a dwell that is judged
WEAK = 0.2  # modulus margin below which the loop, not stiction, makes a limit cycle
SETTLING_BAND = 0.05  # of a step, in which a settled position stays
STANDSTILL_SECONDS = 2.0  # s at rest over which the noise in the command is taken
COMPENSATED = " + compensator"  # behind a controller's name
ESCAPED = 10.0  # times the step


@dataclass(frozen=True)
class Limits:
    """What a loop must keep to pass.

    Margins; error at standstill and overshoot relative to the step; error along the smooth
    reference relative to its amplitude; largest force relative to that in the machine's logs.
    """

    modulus: float = 0.5
    delay: float = 2.0
    standstill: float = 0.05
    tracking: float = 0.15
    overshoot: float = 0.1
    force: float = 1.2


@dataclass(frozen=True)
class LoopFigures:
    """A controller on a plant: errors in m, relative ones to step and amplitude; force in N.

    standstill: largest error in the last half of a dwell. overshoot: relative to the step.
    settling: longest time [s] until a step stays within 5 %. force_seen: the largest in the
    machine's logs. command_peak, command_noise: largest command and its standard deviation at rest
    [V], None where the machine takes a force. margins is None where the linear loop is unstable.
    """

    stable: bool
    margins: MarginValues | None
    step: float
    standstill: float
    standstill_relative: float
    overshoot: float
    settling: float
    step_rms: float
    smooth_rms: float
    smooth_relative: float
    force_rms: float
    force_peak: float
    force_seen: float
    command_peak: float | None
    command_limit: float | None
    command_noise: float | None
    limit_cycle: LimitCycle | None
    missed: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether every limit is kept."""
        return not self.missed


@dataclass(frozen=True)
class Validation:
    """Every controller on every plant (by names like "rst", then "model", "plant").

    The loop that decides is without the compensator; "rst + compensator" is the same with it.
    """

    card: str
    judged: Literal["rst", "pid"]
    passed: bool
    limits: Limits
    figures: Mapping[str, Mapping[str, LoopFigures]]
    remarks: tuple[str, ...]
    versions: Mapping[str, str]
    schema: Literal["validation/1"] = "validation/1"


@dataclass(frozen=True)
class Traces:
    """The simulated loops behind one entry of a validation; rest: a reference that stands still."""

    step: LoopRun
    smooth: LoopRun
    rest: LoopRun


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
    figures: dict[str, dict[str, LoopFigures]] = {}
    traces: dict[tuple[str, str], Traces] = {}
    cases = [
        (name + suffix, controller, compensator)
        for suffix, compensator in (("", None), (COMPENSATED, found.compensator.value))
        for name, controller in found.controllers.items()
    ]
    for name, controller, compensator in cases:
        figures[name] = {}
        for place, machine in plants.items():
            run = Traces(
                *(run_loop(machine, found, controller, r, rng, compensator) for r in reference)
            )
            traces[name, place] = run
            figures[name][place] = _figures(machine, found, controller, run, limits)
    judged = judged_of(found)
    return Validation(
        card=model.card,
        judged=judged,
        passed=all(one.passed for one in figures[judged].values()),
        limits=limits,
        figures=figures,
        remarks=(
            *_as_read(model, found, plant),
            *_remarks(figures, judged, found, (model, plant)),
        ),
        versions=versions(),
    ), traces


def _as_read(model: Model, found: Design, plant: Model | None) -> Iterator[str]:
    """What to say of the files, with the name of the one that is meant."""
    for name, lines in (("model", model.read), ("design", found.read)):
        yield from (f"{name}: {line}" for line in lines)
    if plant is not None:
        yield from (f"plant: {line}" for line in plant.read)


def references(machine: Model, found: Design) -> tuple[Array, Array, Array]:
    """Steps, the smooth reference and rest [m], the same for every controller and plant.

    Levels from the travel that the logs have shown; the last one is held for long, since a limit
    cycle of an integrator against stiction may take seconds.
    """
    low, high = machine.travel
    step, amplitude = STEP_SHARE * (high - low), SMOOTH_SHARE * (high - low)
    h = loop_period(found)
    n = round(
        (max(DWELLS * slowest(found), SHORTEST_DWELL) + travel(found, 2 * step) / JUDGED_SHARE) / h
    )
    counts = [n, n, n, max(3 * n, round(LAST_DWELL / h))]
    levels = np.repeat(np.array([0.0, step, -step, 0.0]), counts)
    w = SMOOTH_SPEED * found.controllers[judged_of(found)].dominant[0]
    t = h * np.arange(round(2.5 * 2 * np.pi / w / h), dtype=np.float64)
    rise = np.clip(t * w / np.pi, 0.0, 1.0)
    smooth = amplitude * np.sin(w * t) * rise**2 * (3 - 2 * rise)
    return levels, smooth, np.zeros(max(round(STANDSTILL_SECONDS / h), 2))


def travel(found: Design, step: float) -> float:
    """Longest time [s] for which a step [m] is on its way, moved at the controllers' rates."""
    return max(step / one.rate if one.rate else 0.0 for one in found.controllers.values())


def slowest(found: Design) -> float:
    """Time constant [s] of the slowest pole of all loops on the design's plant."""
    radius = max(
        float(np.abs(closed_loop_poles(found.plant.A, found.plant.B, one.rst)[0]))
        for one in found.controllers.values()
    )
    return -found.plant.h / float(np.log(min(radius, 0.9999)))


def judged_of(found: Design) -> Literal["rst", "pid"]:
    """The controller that decides: the recommended one, or the one there is."""
    if found.recommended == "pid" and found.pid:
        return "pid"
    return "rst" if found.rst else "pid"


def _figures(
    machine: Model, found: Design, one: Controller, run: Traces, limits: Limits
) -> LoopFigures:
    step = float(np.max(run.step.r))
    amplitude = float(np.max(np.abs(run.smooth.r)))
    stable = _stays(run.step, step) and _stays(run.smooth, amplitude)
    judged = _judged(run.step)
    standstill = float(np.max(np.abs(run.step.r - run.step.y)[judged])) if stable else np.inf
    smooth = float(np.sqrt(np.mean((run.smooth.r - run.smooth.y) ** 2)))
    margin = _linear_margins(machine, found, one)
    runs = (run.step, run.smooth)
    volts = machine.simulated.actuator is not None
    result = LoopFigures(
        stable=stable,
        margins=margin,
        step=step,
        standstill=standstill,
        standstill_relative=standstill / step,
        overshoot=_overshoot(run.step),
        settling=_settling(run.step),
        step_rms=float(np.sqrt(np.mean((run.step.r - run.step.y) ** 2))),
        smooth_rms=smooth,
        smooth_relative=smooth / amplitude,
        force_rms=float(np.sqrt(np.mean(run.step.F**2))),
        force_peak=max(float(np.max(np.abs(each.F))) for each in runs),
        force_seen=machine.force_peak,
        command_peak=max(float(np.max(np.abs(each.u))) for each in runs) if volts else None,
        command_limit=machine.rig.control_limit if volts else None,
        command_noise=float(np.std(run.rest.u[len(run.rest.u) // 2 :])) if volts else None,
        limit_cycle=limit_cycle(run.step, machine.fit.noise_y) if stable else None,
        missed=(),
    )
    return LoopFigures(**{**_shallow(result), "missed": _missed(result, limits, found, machine)})


def _shallow(value: LoopFigures) -> dict[str, Any]:
    return {name: getattr(value, name) for name in value.__dataclass_fields__}


def _stays(trace: LoopRun, size: float) -> bool:
    """Whether a loop stays near a reference of this size [m]; not where it is lost to NaN."""
    return bool(np.all(np.abs(trace.y) < ESCAPED * size))


def _judged(trace: LoopRun) -> Any:
    """The last half of every dwell, True at its samples."""
    keep = np.zeros(len(trace.r), dtype=bool)
    for low, high in _dwells(trace):
        keep[high - round(JUDGED_SHARE * (high - low)) : high] = True
    return keep


def _dwells(trace: LoopRun) -> list[tuple[int, int]]:
    """First sample of every level of the reference, and the one after its last."""
    change = np.flatnonzero(np.diff(trace.r)) + 1
    return list(pairwise([0, *change.tolist(), len(trace.r)]))


def _after_steps(trace: LoopRun) -> list[tuple[float, Array]]:
    """Height of every step [m] and the error y - r after it [m]."""
    return [
        (float(trace.r[low] - trace.r[low - 1]), trace.y[low:high] - trace.r[low:high])
        for low, high in _dwells(trace)[1:]
    ]


def _overshoot(trace: LoopRun) -> float:
    """Largest overshoot of a step, relative to its height."""
    return max(float(np.max(error / height)) for height, error in _after_steps(trace))


def _settling(trace: LoopRun) -> float:
    """Longest time [s] from a step until the position stays within `SETTLING_BAND` of it."""
    h = float(trace.t[1] - trace.t[0])
    outside = [
        np.flatnonzero(np.abs(e) > SETTLING_BAND * abs(height)) for height, e in _after_steps(trace)
    ]
    return h * max(float(late[-1] + 1) if late.size else 0.0 for late in outside)


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


def _missed(result: LoopFigures, limits: Limits, found: Design, machine: Model) -> tuple[str, ...]:
    """What a controller does not keep, in words."""
    unit = shown(machine.rotary).position
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
            missed.append(f"delay margin {samples:.4g} samples, at least {limits.delay:g} needed")
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
    if not (result.overshoot <= limits.overshoot):
        missed.append(
            f"overshoot {100 * result.overshoot:.1f} % of the step, at most"
            f" {100 * limits.overshoot:g} % allowed"
        )
    return (*missed, *_too_much(result, limits, machine.rotary))


def _too_much(result: LoopFigures, limits: Limits, rotary: bool) -> Iterator[str]:
    """Force beyond what the logs have shown, command at its limit, in words."""
    units, seen = shown(rotary), result.force_seen
    if seen > 0 and not (result.force_peak <= limits.force * seen):
        yield (
            f"peak force {result.force_peak:.4g} {units.force}, the logs show {seen:.4g} at most,"
            f" {limits.force:g} times that allowed"
        )
    limit, peak = result.command_limit, result.command_peak
    if limit is not None and peak is not None and not (peak < limit):
        yield f"the command reaches its limit of {limit:g} V"


def _remarks(
    figures: Mapping[str, Mapping[str, LoopFigures]],
    judged: str,
    found: Design,
    machines: Sequence[Model | None],
) -> list[str]:
    out = [
        f"with the compensator, on the {place}: error at standstill"
        f" {100 * figures[judged][place].standstill_relative:.3g} ->"
        f" {100 * one.standstill_relative:.3g} %, along the smooth reference"
        f" {100 * figures[judged][place].smooth_relative:.3g} -> {100 * one.smooth_relative:.3g} %"
        f"{'' if one.stable else ', unstable'}"
        for place, one in figures[judged + COMPENSATED].items()
    ]
    out += dict.fromkeys(
        said for machine in machines if machine and (said := effects_left_out(machine))
    )
    for place, one in figures[judged].items():
        if one.limit_cycle:
            weak = one.margins is None or one.margins.modulus < WEAK
            cause = "too little margin" if weak else "as an integrator against stiction makes"
            out.append(
                f"limit cycle on the {place}: {one.limit_cycle.amplitude:.3g} peak to peak every"
                f" {one.limit_cycle.period:.3g} s, {cause}"
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
