"""Model of a rig whose velocity follows the command -> design, and its validation in simulation."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from design.asked import Limits
from design.machine.readable import Display
from design.machine.velocity import VelocityDesign, VelocityModel
from design.machine.versions import versions
from design.margins import Margins, margins
from design.valve_loop import (
    SLOW_END,
    ValveController,
    ValveLoopRun,
    at_edges,
    run_valve_loop,
    tuned,
    valve_plant,
    valve_rst,
)
from identification.arrays import Array
from identification.errors import BadModel, BadSpecification, NotIdentifiable
from identification.model.estimates import Estimate
from identification.velocity.model import Valve

SMOOTHED = 3.0  # deviations of the position's noise, within which no offset is given in full
STEP_OF_TRAVEL = 0.25
STEP_LENGTH = 15.0  # time constants of the loop, that a step is given
SHORTEST_STEP = 4.0  # s
SMOOTH_OF_SPEED = 0.5  # of the fastest speed, that the smooth reference reaches
SMOOTH_OF_LOOP = 0.1  # of k_p, that it turns with at most
LESS_OVERSHOOT = 0.7  # of the limit, that a design takes: the integral and the sensor add to it
DESIGN_NEEDS = ("g_p", "g_n", "d_p", "d_n")


def design_velocity(
    model: VelocityModel, limits: Limits, *, integrator: bool = True, period: float | None = None
) -> VelocityDesign:
    """The fastest P or PI position loop that keeps the margins, dead zones compensated.

    They are kept at the slow ends of the model's intervals too. limits: of them modulus [-], delay
    [periods] and overshoot; period: of the loop [s], by default the logs'.
    Raises NotIdentifiable where gains or dead zones are not identified, BadSpecification where no
    gain keeps the margins.
    """
    for name in DESIGN_NEEDS:
        if not model.valve[name].known:
            raise NotIdentifiable(
                f"{name} is not identified, without which there is no dead zone to compensate:"
                f" {model.valve[name].reason}"
            )
    valve, narrow = model.simulated, model.end(low=True)
    slow = at_edges(valve, narrow, model.end(low=False))[SLOW_END]
    h = period or min(entry.h for entry in model.log)
    k_p, k_i = tuned(
        slow, h, gain=_gain_over(slow, valve), modulus=limits.modulus, delay_samples=limits.delay,
        overshoot=LESS_OVERSHOOT * limits.overshoot, integrator=integrator,
    )  # fmt: skip
    found = margins(*valve_plant(valve.delay, valve.lag, h), valve_rst(k_p, k_i, h))
    band = SMOOTHED * model.fit.noise_y
    limit = model.rig.control_limit or model.command_peak
    # A dead zone compensated too far makes the loop hunt: the law has the narrow end.
    law = ValveController(
        k_p, k_i, h, valve.g_p, valve.g_n, max(narrow.d_p, 0.0), max(narrow.d_n, 0.0),
        smooth=k_p * band, band=band, limit=limit,
    )  # fmt: skip
    remarks = []
    if not model.rig.control_limit:
        remarks.append(
            f"the command is limited to {limit:.4g} {model.rig.command_unit}, the largest of the"
            " logs; set control_limit under [rig] of the card for another"
        )
    return VelocityDesign(
        card=model.card,
        rig=model.rig,
        law="PI" if integrator else "P",
        controller=_numbers(law, model),
        margins=margin_numbers(found),
        remarks=tuple(remarks),
        versions=versions(),
    )


def _gain_over(plant: Valve, law: ValveController | Valve) -> float:
    """The plant's gain over the one that the law has, of the way where that is more."""
    return max(plant.g_p / law.g_p, plant.g_n / law.g_n)


def margin_numbers(found: Margins) -> dict[str, float | None]:
    """The margins as a design and a validation write them."""
    return {
        "modulus": found.modulus,
        "gain": found.gain_up,
        "phase_deg": found.phase_deg,
        "delay_s": found.delay_s,
    }


def _numbers(law: ValveController, model: VelocityModel) -> dict[str, Estimate]:
    display = model.display
    unit = {
        "k_p": "1/s", "k_i": "1/s^2", "h": "s",
        "smooth": display.velocity, "band": display.position, "limit": display.command,
        **{name: model.valve[name].unit for name in DESIGN_NEEDS},
    }  # fmt: skip
    return {name: Estimate(value, unit[name]) for name, value in asdict(law).items()}


def law_of(found: VelocityDesign) -> ValveController:
    """The controller that a design holds; raises BadModel where a number is missing."""
    names = [one.name for one in fields(ValveController)]
    if set(names) != set(found.controller):
        raise BadModel(f"[controller] holds {sorted(found.controller)}; {', '.join(names)} needed")
    numbers = {name: float(one.value or 0.0) for name, one in found.controller.items()}
    for name in ("h", "k_p", "limit"):
        if not numbers[name] > 0.0:
            raise BadModel(f"[controller.{name}] = {numbers[name]:g}, must be > 0")
    if numbers["g_p"] * numbers["g_n"] <= 0.0:
        raise BadModel("[controller] g_p and g_n must be of one sign, and not 0")
    return ValveController(**numbers)


@dataclass(frozen=True)
class VelocityFigures:
    """A loop on a plant: error at standstill and overshoot relative to the step, error along the
    smooth reference relative to its amplitude, share of it with the command at its limit."""

    stable: bool
    standstill: float
    overshoot: float
    tracking: float
    limited: float
    margins: Mapping[str, float | None] | None
    misses: tuple[str, ...]


@dataclass(frozen=True)
class VelocityValidation:
    """Figures by plant: the model, the ends of its intervals, and another plant."""

    card: str
    passed: bool
    limits: Limits
    figures: Mapping[str, VelocityFigures]
    versions: Mapping[str, str]


def validate_velocity(
    model: VelocityModel, design: VelocityDesign, rng: np.random.Generator, limits: Limits,
    plant: VelocityModel | None = None,
) -> VelocityValidation:  # fmt: skip
    """The design on the model, at the ends of its intervals, and on `plant`, with the logs' noise.

    Raises BadModel where design and plant are of unlike machines.
    """
    law = law_of(design)
    for one in (model, *([plant] if plant else [])):
        if one.display != Display.of(design.rig):
            raise BadModel(
                f"the design is for {design.card} (command in {design.rig.command_unit}), the model"
                f" of {one.card} ({one.rig.command_unit}); give those of one machine"
            )
    valve = model.simulated
    plants = {"model": valve, **at_edges(valve, model.end(low=True), model.end(low=False))}
    figures = {name: _figures(law, one, model, limits, rng) for name, one in plants.items()}
    if plant is not None:
        figures["plant"] = _figures(law, plant.simulated, plant, limits, rng)
    passed = not any(one.misses for one in figures.values())
    return VelocityValidation(model.card, passed, limits, figures, versions())


def _figures(
    law: ValveController, valve: Valve, model: VelocityModel, limits: Limits,
    rng: np.random.Generator,
) -> VelocityFigures:  # fmt: skip
    step = STEP_OF_TRAVEL * (model.travel[1] - model.travel[0])

    def run(r: Array) -> ValveLoopRun:
        noise = model.fit.noise_y * rng.standard_normal(len(r))
        return run_valve_loop(law, valve, r, noise, model.command_peak, model.travel)

    standstill, overshoot = _along_stairs(law, step, run)
    # A sine that the valve can follow, three periods of it; it comes up in half of the first.
    w = min(SMOOTH_OF_LOOP * law.k_p, SMOOTH_OF_SPEED * law.fastest / step)
    t = np.arange(0.0, 6.0 * np.pi / w, law.h)
    r = step * np.minimum(w * t / np.pi, 1.0) * np.sin(w * t)
    smooth, late = run(r), slice(len(r) // 3, None)
    tracking = float(np.sqrt(np.mean((smooth.y - r)[late] ** 2))) / step
    limited = float(np.mean(np.abs(smooth.u) >= law.limit))
    A, B = valve_plant(valve.delay, valve.lag, law.h)
    try:
        found = margins(A, _gain_over(valve, law) * B, valve_rst(law.k_p, law.k_i, law.h))
    except BadSpecification:
        found = None
    misses = tuple(_missed(limits, found, law.h, (standstill, tracking, overshoot), limited))
    numbers = margin_numbers(found) if found else None
    return VelocityFigures(
        found is not None, standstill, overshoot, tracking, limited, numbers, misses
    )


def _missed(
    limits: Limits, found: Margins | None, h: float, figures: tuple[float, float, float],
    limited: float,
) -> Iterator[str]:  # fmt: skip
    if found is None:
        yield "the loop is not stable"
        return
    if found.modulus < limits.modulus - 1e-6:
        yield f"modulus margin {found.modulus:.3g} < {limits.modulus:g}"
    if found.delay_s is not None and found.delay_s < (limits.delay - 1e-6) * h:
        yield f"delay margin {found.delay_s / h:.3g} < {limits.delay:g} samples"
    named = ("standstill", "tracking", "overshoot")
    for name, value in zip(named, figures, strict=True):
        if not value <= getattr(limits, name):
            yield f"{name} {value:.3g} > {getattr(limits, name):g}"
    if limited > 0.0:
        yield f"the command is at its limit in {100 * limited:.2g} % of the smooth reference"


def _along_stairs(
    law: ValveController, step: float, run: Callable[[Array], ValveLoopRun]
) -> tuple[float, float]:
    """Largest error in the last half of a step [m] up, down and back, and overshoot, relative to
    the step."""
    seconds = max(SHORTEST_STEP, 2.0 * step / law.fastest + STEP_LENGTH / law.k_p)
    dwell = round(seconds / law.h)
    found = run(np.concatenate([[0.0], np.repeat([step, 0.0, -step, 0.0], dwell)]))
    standstill = overshoot = 0.0
    for begin in range(1, len(found.r) - dwell + 1, dwell):
        y, target = found.y[begin : begin + dwell], found.r[begin]
        rise = target - found.r[begin - 1]
        standstill = max(standstill, float(np.max(np.abs(y[dwell // 2 :] - target))) / step)
        overshoot = max(overshoot, float(np.max((y - target) * np.sign(rise))) / step)
    return standstill, overshoot


def velocity_validation_document(found: VelocityValidation) -> dict[str, Any]:
    """validation.json of such a rig."""
    return {"schema": "velocity-validation/1", "kind": "velocity", **asdict(found)}
