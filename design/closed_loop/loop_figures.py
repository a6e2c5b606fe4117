"""What a loop comes to in simulation: its runs along steps and a smooth reference, its figures."""

from collections.abc import Iterator, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace

import numpy as np

from design.asked import Limits
from design.closed_loop.driven_loop import (
    DrivenLoop,
    driven_loop,
    limit_on,
    present_loop,
    run_driven,
    scheduled_loop,
)
from design.closed_loop.linear_loop import plants_of
from design.closed_loop.loop_motion import JUDGED_SHARE, SETTLING_BAND, LoopMotion, loop_motion
from design.loop import LoopRun
from design.machine.design import (
    DESIGNED_STRUCTURES,
    Design,
    MarginValues,
    Structure,
    margin_values,
)
from design.machine.model import Model
from design.margins import margins
from design.rst import closed_loop_poles
from design.tune import worst_modulus
from identification.arrays import Array
from identification.errors import BadModel, BadSpecification
from identification.model.plant import Motor

STEP_SHARE = 0.25  # of the travel seen in the logs
SMOOTH_SHARE = 0.4
SMOOTH_OF_LOGS = 0.25  # of the speed that the logs have shown, which the smooth reference reaches
SMOOTH_PERIODS = 1.5  # in, and once round
DWELLS = 15.0  # length of a step, in time constants of the slowest loop
SHORTEST_DWELL = 1.0  # s
LAST_DWELL = 10.0  # s
WEAK = 0.2  # modulus margin below which the loop, not stiction, makes a limit cycle
STANDSTILL_SECONDS = 2.0  # s at rest over which the noise in the command is taken
COMPENSATED = " + compensator"  # behind a controller's name
SCHEDULED = " + schedule"  # the same
PRESENT = "present"  # the controller that the machine has now
ALMOST = 0.9  # of a limit, from which a loop is reported to come near it
FIGURES_SAID = (
    f"static error: the largest in the last {100 * JUDGED_SHARE:g} % of the time after a step of"
    f" {100 * STEP_SHARE:g} % of the logs' travel, held for {DWELLS:g} time constants of the"
    f" slowest loop ({SHORTEST_DWELL:g} s at least), of that step; settling time: until a step"
    f" stays within {100 * SETTLING_BAND:g} %; tracking error: root mean square along a sine over"
    f" {200 * SMOOTH_SHARE:g} % of the travel, at {100 * SMOOTH_OF_LOGS:g} % of the logs' speed, of"
    " its amplitude"
)  # the same in `design`, `validate` and `design --robust`


@dataclass(frozen=True, kw_only=True)
class LoopFigures(LoopMotion):
    """A controller on a plant: its motion, and what there is beside; force in N.

    force_seen: the largest in the machine's logs; force_limit: what a motor gives at the limit of
    its command. command_noise: standard deviation of the command at rest, None where the machine
    takes a force. margins is None where the linear loop is unstable.
    """

    margins: MarginValues | None
    force_rms: float
    force_seen: float
    command_limit: float | None
    command_noise: float | None
    missed: tuple[str, ...]
    command_unit: str = "V"
    force_limit: float | None = None

    @property
    def passed(self) -> bool:
        """Whether every limit is kept."""
        return not self.missed


@dataclass(frozen=True)
class Traces:
    """The simulated loops behind one entry of a validation; rest: a reference that stands still."""

    step: LoopRun
    smooth: LoopRun
    rest: LoopRun


def tried_loop(
    machine: Model, model: Model, found: Design, loop: DrivenLoop, limits: Limits,
    rng: np.random.Generator | None, *, arx: bool = False,
) -> tuple[LoopFigures, Traces]:  # fmt: skip
    """What a loop comes to on a machine along the motion of a design on its model; rng: of the
    noise, which is the same for every loop, None for none; arx: margins on its ARX plant."""
    motion, rng = references(model, found, loop.h), deepcopy(rng)
    runs = Traces(*(run_driven(machine, loop, r, rng) for r in motion))
    return _figures(machine, loop, runs, limits, arx), runs


def tried_loops(
    machine: Model, model: Model, found: Design, limits: Limits, rng: np.random.Generator | None,
    refused: list[str] | None = None,
) -> dict[str, tuple[LoopFigures, Traces]]:  # fmt: skip
    """What every loop of a design comes to on a machine, and that of the controller that the
    model's machine has now; refused: takes why the latter cannot be simulated."""
    out = {}
    if model.controller is not None:
        try:
            loop = present_loop(model, model.controller)
            out[PRESENT] = tried_loop(machine, model, found, loop, limits, rng)
        except BadModel as error:
            if refused is not None:
                refused.append(str(error))
    arx = found.plant.source == "arx"
    for name, loop in loops_of(model, found).items():
        out[name] = tried_loop(machine, model, found, loop, limits, rng, arx=arx)
    return out


def references(machine: Model, found: Design, h: float) -> tuple[Array, Array, Array]:
    """Steps, the smooth reference and rest [m] every h [s], one motion for every loop and plant.

    Levels and speed from what the logs have shown; a step is held until the slowest loop has
    settled, the last one for long, since a limit cycle of an integrator against stiction may take
    seconds.
    """
    n = round(dwell(machine, [found]) / h)
    levels = np.repeat(_levels(machine), [n, n, n, max(3 * n, round(LAST_DWELL / h))])
    rest = np.zeros(max(round(STANDSTILL_SECONDS / h), 2))
    return levels, smooth_reference(machine, h), rest


def common_reference(machine: Model, designs: Sequence[Design], h: float) -> Array:
    """Steps and then a smooth motion [m] at the period h [s], the same motion for every design."""
    levels = np.repeat(_levels(machine), round(dwell(machine, designs) / h))
    return np.concatenate([levels, smooth_reference(machine, h)])


def dwell(machine: Model, designs: Sequence[Design]) -> float:
    """How long a step is held [s]: until every loop of these designs has settled."""
    step, _ = _sizes(machine)
    return max(
        max(DWELLS * slowest(one), SHORTEST_DWELL) + travel(one, 2 * step) / JUDGED_SHARE
        for one in designs
    )


def smooth_reference(machine: Model, h: float) -> Array:
    """A sine over most of the travel [m], every h [s], at a share of the speed of the logs."""
    _, amplitude = _sizes(machine)
    return risen_sine(
        amplitude, SMOOTH_OF_LOGS * speed_seen(machine) / amplitude, h, SMOOTH_PERIODS
    )


def speed_seen(machine: Model) -> float:
    """The speed of the logs [m/s]; of an older file without it the travel in a second."""
    low, high = machine.travel
    return machine.speed or (high - low)


def _levels(machine: Model) -> Array:
    """The positions of the steps [m], (4,)."""
    step, _ = _sizes(machine)
    return np.array([0.0, step, -step, 0.0])


def _sizes(machine: Model) -> tuple[float, float]:
    """Height of the steps and amplitude of the smooth reference [m]."""
    low, high = machine.travel
    return STEP_SHARE * (high - low), SMOOTH_SHARE * (high - low)


def risen_sine(amplitude: float, w: float, h: float, periods: float) -> Array:
    """A sine of w [rad/s] that comes to its amplitude [m] in half a period."""
    t = h * np.arange(round(periods * 2 * np.pi / w / h), dtype=np.float64)
    rise = np.clip(t * w / np.pi, 0.0, 1.0)
    return np.asarray(amplitude * np.sin(w * t) * rise**2 * (3 - 2 * rise))


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


def tested_of(found: Design) -> Structure:
    """The controller that decides: the recommended one, or the first there is."""
    there = [name for name in DESIGNED_STRUCTURES if name in found.controllers]
    return next((name for name in there if name == found.recommended), there[0])


def loops_of(model: Model, found: Design) -> dict[str, DrivenLoop]:
    """The loops of a design's controllers by name, alone, then with the compensator beside, then
    with their schedule."""
    alone = {n: driven_loop(model, found, one) for n, one in found.controllers.items()}
    both = {
        name + COMPENSATED: driven_loop(model, found, one, found.compensator.value)
        for name, one in found.controllers.items()
        if takes_compensator(found, name)
    }
    each = found.schedule.controllers if found.schedule else ()
    return alone | both | {name + SCHEDULED: scheduled_loop(model, found, name) for name in each}


def takes_compensator(found: Design, name: str) -> bool:
    """Whether a controller may have the friction compensator beside it: not beside a feed-forward,
    which has the friction in it."""
    return found.controllers[name].feed_forward is None


def _figures(
    machine: Model, loop: DrivenLoop, run: Traces, limits: Limits, arx: bool
) -> LoopFigures:
    drive = machine.simulated.actuator
    driven = drive is not None
    limit = limit_on(machine, loop) if driven else None
    motion = loop_motion(run.step, run.smooth, machine.fit.noise_y, limit)
    if not driven:
        motion = replace(motion, command_peak=None)
    found = LoopFigures(
        **vars(motion),
        margins=_linear_margins(machine, loop, arx),
        force_rms=float(np.sqrt(np.mean(run.step.F**2))),
        force_seen=machine.force_peak,
        command_limit=limit,
        command_noise=float(np.std(run.rest.u[len(run.rest.u) // 2 :])) if driven else None,
        missed=(),
        command_unit=machine.rig.command_unit,
        force_limit=abs(drive.k_a) * limit if isinstance(drive, Motor) and limit else None,
    )
    return replace(found, missed=tuple(_missed(found, limits, machine)))


def _linear_margins(machine: Model, loop: DrivenLoop, arx: bool) -> MarginValues | None:
    """Margins of the law on the machine's own linear plant; None where it is unstable."""
    law = loop.law.rst
    try:
        plants = plants_of(machine, law.h, loop.force, arx)
        margin = margins(*plants[0], law)
    except BadSpecification:
        return None
    return margin_values(margin, worst_modulus(plants, law))


def _missed(result: LoopFigures, limits: Limits, machine: Model) -> Iterator[str]:
    """What a controller does not keep, in words."""
    if not result.stable:
        yield "the simulated loop runs away"
        return
    if result.margins is None:
        yield "the linear loop is unstable"
    else:
        if not (result.margins.modulus >= limits.modulus):
            said = f"{result.margins.modulus:.3f}, at least {limits.modulus:g} needed"
            yield f"modulus margin {said}"
        samples = result.margins.delay_samples
        if samples is not None and not (samples >= limits.delay):
            yield f"delay margin {samples:.4g} samples, at least {limits.delay:g} needed"
    standstill = f"error at standstill {machine.display.length_text(result.standstill)},"
    for what, share, of, allowed in (
        (standstill, result.standstill_relative, "the step", limits.standstill),
        ("error along the smooth reference", result.smooth_relative, "its amplitude",
         limits.tracking),
        ("overshoot", result.overshoot, "the step", limits.overshoot),
    ):  # fmt: skip
        if not (share <= allowed):
            yield f"{what} {100 * share:.1f} % of {of}, at most {100 * allowed:g} % allowed"
    units, seen = machine.display, result.force_seen
    if seen > 0 and not (result.force_peak <= limits.force * seen):
        yield (
            f"peak force {result.force_peak:.4g} {units.force}, the logs show {seen:.4g} at most,"
            f" {limits.force:g} times that allowed"
        )
    limit, peak = result.command_limit, result.command_peak
    if limit is not None and peak is not None and not (peak < limit):
        most = result.force_limit
        force = "" if most is None else f", {most:.3g} {units.force}"
        yield (
            f"the command reaches its limit of {limit:g} {result.command_unit}{force},"
            f" for {100 * result.limited:.2g} % of the time"
        )
