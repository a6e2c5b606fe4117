"""Logs + model -> frequency responses of plant, controller and open loop, and their resonances."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from design.closed_loop.linear_loop import dead_time, law_to_force
from design.machine.model import Model, used
from design.machine.plain import as_number
from design.machine.plausible import refuse_other_machine
from design.machine.readable import Display
from design.machine.source import Source, fingerprints
from design.measured.linear_force import (
    freed,
    of_load,
    of_model,
    of_modes,
    plain_recording,
    stiffness_of,
)
from design.measured.predict import with_applied_force
from design.measured_loop import MeasuredMargins, is_minus_one, measured_margins
from design.polynomial import evaluate
from identification.arrays import Array, BoolArray
from identification.errors import BadModel, NotIdentifiable
from identification.estimation.estimates import reported_estimate
from identification.frequency.body import body_response
from identification.frequency.estimate import Response, in_series
from identification.frequency.machine import MachineResponses, body_by_force, machine_responses
from identification.frequency.modes import Modes, Peak, fit_modes
from identification.frequency.stretches import ComplexArray, hold
from identification.frequency.swinging_load import swinging_load
from identification.log import Log, Rig
from identification.model.estimates import Estimate
from identification.model.size import Size

Curve = Literal["plant", "velocity", "plant_with_friction", "controller", "open_loop"]
PASSES_AT_REST = 1  # in which what a body at rest is held by follows from its own response
RESPONSE_SCHEMA = "response/1"
GAP_FORGIVEN = 3  # points in a row that are missing, within a range of frequencies
FEWEST_IN_RANGE = 3  # points of a range


@dataclass(frozen=True, eq=False)
class Curves:
    """What the model says at the same frequencies: (k,) each, None where it does not."""

    plant: ComplexArray
    controller: ComplexArray | None


@dataclass(frozen=True, eq=False)
class Responded:
    """The responses of a machine: measured, by the model, resonances, margins of the open loop.

    model: whose friction was taken off the force; None where none was, for the reason `left_in`.
    """

    card: str
    display: Display
    logs: tuple[dict[str, Any], ...]
    found: MachineResponses
    modes: Modes | None
    open_loop: Response | None
    margins: MeasuredMargins | None
    curves: Curves | None
    model: Model | None
    left_in: str | None
    remarks: tuple[str, ...]

    @property
    def peaks(self) -> tuple[Peak, ...]:
        """Resonances and anti-resonances by their frequency."""
        return self.modes.peaks if self.modes else ()

    @property
    def felt(self) -> tuple[Peak, ...]:
        """The same where no frequency is identified, by what lies below and above."""
        return self.modes.felt if self.modes else ()

    def gap_around(self, peaks: Sequence[Peak]) -> tuple[float, float]:
        """Frequencies [Hz] identified next below and next above all of these."""
        seen, at = self.found.f[self.found.body.seen], [one.frequency.value for one in peaks]
        return float(seen[seen < min(at)][-1]), float(seen[seen > max(at)][0])


def respond(
    runs: Sequence[Source], rig: Rig, card: str, model: Model | None, lowest: float | None = None,
    *, left_in: str | None = None, read: Sequence[str] = (),
) -> Responded:  # fmt: skip
    """The frequency responses of the runs together; card: its name.

    model: whose friction is taken off the force; left_in: why not, where there is none, or where it
    is not to be; lowest [Hz]: the frequency to reach down to. read: more remarks. Raises BadLog
    without an applied force, NotIdentifiable where the runs show nothing, or a rig moved the body.
    """
    if model is not None:
        refuse_other_machine(model.rig, rig, f"the card {card}", "motion")
        if model.prescribed_motion and not model.friction["m"].known:
            raise NotIdentifiable(
                f"the motion in the logs of {model.card} is prescribed by a rig (no inertia shows):"
                " it is no response to the force; log the body driven by its force"
            )
    logs = [with_applied_force(one.log, rig) for one in runs]
    taken = model if left_in is None else None
    found, modes = _measured(logs, rig.kind == "motor", taken, lowest)
    if not ranges(found.f, found.body.seen):
        raise NotIdentifiable(_nothing(runs, found))
    curves = None if model is None else curves_of(model, found.f)
    loop = _open_loop(found, curves)
    shut = np.zeros(len(found.f), dtype=np.bool_)
    if loop is not None and found.controller is not None:
        shut = is_minus_one(found.f, loop.H, loop.seen)
        loop = _unseen(loop, shut)
        found = replace(
            found, body=_unseen(found.body, shut), with_friction=_unseen(found.with_friction, shut)
        )
    return Responded(
        card=card,
        display=Display.of(rig),
        logs=tuple(fingerprints(runs)),
        found=found,
        modes=modes,
        open_loop=loop,
        margins=None if loop is None else measured_margins(found.f, loop.H, loop.seen),
        curves=curves,
        model=taken,
        left_in=left_in,
        remarks=(*read, *_remarks(logs, card, found, taken, found.f[shut])),
    )


def _measured(
    logs: Sequence[Log], zero_order_hold: bool, model: Model | None, lowest: float | None
) -> tuple[MachineResponses, Modes | None]:
    """The responses and their modes; a body at rest is held by what its own modes make of it."""
    if model is None:
        found = machine_responses([plain_recording(log, zero_order_hold) for log in logs], lowest)
        return found, fit_modes(found.body)
    every = [freed(log, model) for log in logs]
    runs = [one.without_friction(of_model(model)) for one in every]
    if model.resonance is None:
        load = swinging_load(runs, [one.rests for one in every], model.karnopp.m)
        runs = [one.without_friction(of_load(model, load)) for one in every]
    for _ in range(PASSES_AT_REST):
        body = body_by_force(runs, lowest)
        modes = fit_modes(body)
        if modes is None:
            break
        rests = of_modes(modes, float(body.f[body.seen][-1]))
        runs = [one.without_friction(rests) for one in every]
    found = machine_responses(runs, lowest)
    return found, fit_modes(found.body)


def curves_of(model: Model, f: Array) -> Curves:
    """What the model's mass, friction, second mass and lag make of the plant, and the controller of
    its card, at f [Hz]."""
    p, two = model.karnopp, model.resonance
    second = None
    if two is not None:
        second = (used(two["frequency"]), used(two["anti_resonance"]), used(two["damping"]))
    plant = body_response(
        f, p.m, 0.5 * (p.F_vp + p.F_vn), stiffness=stiffness_of(model),
        lag=dead_time(model), second_mass=second,
    )  # fmt: skip
    return Curves(plant, _law_of_card(model, f))


def _law_of_card(model: Model, f: Array) -> ComplexArray | None:
    """The card's controller from position to the force that counters it [N/m], with its hold; None
    where there is none, or a force loop stands between."""
    now = law_to_force(model)
    if now is None:
        return None
    law, per = now
    z = np.exp(2j * np.pi * f * law.h)
    with np.errstate(divide="ignore", invalid="ignore"):
        found = per * evaluate(law.rst.R, z) / evaluate(law.rst.S, z) * hold(f, law.h)
    return np.where(f < 0.5 / law.h, found, np.nan)


def _open_loop(found: MachineResponses, curves: Curves | None) -> Response | None:
    """The plant in series with the controller that the logs show, else with that of the card."""
    if found.controller is not None:
        return in_series(found.position, found.controller)
    if curves is None or curves.controller is None:
        return None
    return found.position.times(curves.controller)


def _nothing(runs: Sequence[Source], found: MachineResponses) -> str:
    """Why no frequency is drawn, in words."""
    names = ", ".join(dict.fromkeys(one.file for one in runs))
    best = float(np.max(found.body.coherence, initial=0.0))
    follows = "the reference" if found.instrument else "the force"
    return (
        f"{names}: no frequency at which the motion follows {follows} (coherence at most"
        f" {best:.2f}, at least 0.5 needed at {FEWEST_IN_RANGE} in a row); log a livelier run, or"
        " lay a small multisine on the reference"
    )


def _remarks(
    logs: Sequence[Log], card: str, found: MachineResponses, model: Model | None, shut: Array
) -> Iterator[str]:
    """What to know of the curves; shut: frequencies (k,) [Hz] at which the open loop is -1."""
    if not found.instrument:
        why = "the reference rests" if "r" in logs[0] else "no reference is logged"
        yield (
            f"{why}: the response is that from force to position directly; where noise goes round"
            " a loop it shows the controller's inverse instead"
        )
    if model is not None and model.card != card:
        yield f"the model is of {model.card}, the logs of {card}"
    if len(shut):
        yield (
            f"from {shut[0]:.3g} to {shut[-1]:.3g} Hz the open loop found is -1, which no loop is:"
            " noise or a force at its limit goes round there, not the reference; no margin is taken"
            " from it (lay a small multisine on the reference, and keep the command within its"
            " limits)"
        )


def _unseen(response: Response, where: BoolArray) -> Response:
    """The response as it is seen elsewhere than at these frequencies (k,)."""
    return replace(response, coherence=np.where(where, 0.0, response.coherence))


def ranges(f: Array, where: BoolArray) -> list[tuple[float, float]]:
    """Stretches of frequencies [Hz] where it holds, gaps of a few points left out."""
    at = np.flatnonzero(where)
    if not len(at):
        return []
    parts = np.split(at, np.flatnonzero(np.diff(at) > GAP_FORGIVEN) + 1)
    return [(float(f[one[0]]), float(f[one[-1]])) for one in parts if len(one) >= FEWEST_IN_RANGE]


def sure_share(response: Response, upto: float) -> float:
    """Share of the octaves up to a frequency [Hz] at which the response is to be relied on."""
    inside = response.f <= upto
    weight = np.gradient(np.log(response.f))
    sure = response.sure
    return float(np.sum(weight[inside & sure]) / np.sum(weight[inside]))


def response_document(found: Responded) -> dict[str, Any]:
    """What response.json holds; the curves themselves are in response.csv."""
    units, f = found.display, found.found.f
    loop, m = found.open_loop, found.margins
    return {
        "schema": RESPONSE_SCHEMA,
        "card": found.card,
        "log": found.logs,
        "friction": {"taken_out": found.left_in is None, "reason": found.left_in},
        "instrument": "r" if found.found.instrument else None,
        "stretches": [{"length": _plain(one, "s")} for one in found.found.stretches],
        "plant": _seen(found.found.body, f"{units.position}/{units.force}"),
        "plant_with_friction": _seen(found.found.with_friction, f"{units.position}/{units.force}"),
        "controller": None if found.found.controller is None
        else _seen(found.found.controller, units.stiffness),
        "open_loop": None if loop is None or m is None else {
            **_seen(loop, "1"),
            "crossover": _plain(m.crossover, "Hz"),
            "phase_margin": _plain(m.phase_deg, "deg"),
            "gain_margin": _plain(m.gain_db, "dB"),
            "gain_margin_at": _plain(m.gain_at, "Hz"),
            "delay_margin": _plain(m.delay_s, "s"),
            "modulus_margin": _plain(m.modulus, "1"),
        },
        "peaks": _written(found.peaks),
        "felt": _written(found.felt),
        "frequencies": len(f),
        "remarks": found.remarks,
    }  # fmt: skip


def _written(peaks: Sequence[Peak]) -> list[dict[str, Any]]:
    return [
        {"kind": one.kind, "frequency": _sized(one.frequency, "Hz"),
         "damping": _sized(one.damping, "1")}
        for one in peaks
    ]  # fmt: skip


def _seen(response: Response, unit: str) -> dict[str, Any]:
    sure = response.sure
    return {
        "unit": unit,
        "seen_hz": ranges(response.f, response.seen),
        "sure_hz": ranges(response.f, sure),
    }


def _plain(value: float | None, unit: str) -> dict[str, Any]:
    if value is None:
        return as_number(Estimate(None, unit, reason="not within what the logs show"))
    return as_number(Estimate(value, unit))


def _sized(one: Size, unit: str) -> dict[str, Any]:
    return as_number(reported_estimate(one.value, unit, one.sd))


def curve_of(found: Responded, what: Curve) -> Response:
    """One of the curves; raises BadModel where the logs show none."""
    curves = measured_curves(found)
    if what not in curves:
        raise BadModel(f"no curve {what!r}; there are {', '.join(curves)}")
    one = curves[what]
    if one is None or not np.any(one.seen):
        raise BadModel(f"the logs show no {what.replace('_', ' ')}; it needs a moving reference")
    return one


def measured_curves(found: Responded) -> dict[Curve, Response | None]:
    """The curves by name, None for one that the logs do not show."""
    every = found.found
    by_position = np.asarray(-1.0 / (2.0 * np.pi * every.f) ** 2 + 0j)
    return {
        "plant": every.position,
        "velocity": every.velocity,
        "plant_with_friction": every.with_friction.times(by_position),
        "controller": every.controller,
        "open_loop": found.open_loop,
    }


def decibels(size: Array) -> Array:
    """Magnitudes in dB; NaN stays."""
    with np.errstate(invalid="ignore"):
        return np.asarray(20.0 * np.log10(np.maximum(size, 1e-300)))


def degrees(H: ComplexArray) -> Array:
    """Phase without jumps [deg], its middle between -270 and 90; NaN stays."""
    known = np.isfinite(H)
    out = np.full(len(H), np.nan)
    if np.any(known):
        phase = np.degrees(np.unwrap(np.angle(H[known])))
        out[known] = phase - 360.0 * math.ceil((float(np.median(phase)) - 90.0) / 360.0)
    return out
