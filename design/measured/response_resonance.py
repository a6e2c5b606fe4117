"""A machine's resonance where its model has none: of the peaks of a frequency response."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

from design.machine.design import Design
from design.machine.model import Model, used
from design.machine.readable import number
from identification.errors import BadModel
from identification.model.estimates import Estimate


def with_peaks(model: Model, every: Sequence[Mapping[str, Any]], where: str) -> Model:
    """The model with the lowest pair of anti-resonance and resonance among the peaks.

    every: peaks as a response.json has them; where: what it is called by. Raises BadModel where
    they hold no such pair.
    """
    peaks = sorted(every, key=lambda one: float(one["frequency"]["value"]))
    for low, high in pairwise(peaks):
        if (low["kind"], high["kind"]) == ("anti-resonance", "resonance"):
            anti, top = Estimate(**low["frequency"]), Estimate(**high["frequency"])
            m, unit = model.karnopp.m, model.friction["m"].unit
            first = m * (used(anti) / used(top)) ** 2
            pair = {
                "frequency": top,
                "anti_resonance": anti,
                "damping": Estimate(**high["damping"]),
            }
            masses = {"m_1": Estimate(first, unit), "m_2": Estimate(m - first, unit)}
            return replace(model, resonance=pair | masses)
    kinds = ", ".join(one["kind"] for one in peaks) or "none"
    raise BadModel(
        f"{where}: no anti-resonance with a resonance above it (peaks: {kinds}), as two masses have"
        " them; log a run that moves the machine there, or design without --response"
    )


def beyond_seen(found: Design, spans: Sequence[tuple[float, float]]) -> Design:
    """The design, which says so where its recommended controller crosses over outside of the spans
    of frequencies [Hz] at which a response identifies the plant."""
    one = found.controllers.get(str(found.recommended))
    if one is None or one.margins.crossover_hz is None:
        return found
    at = one.margins.crossover_hz
    if any(low <= at <= high for low, high in spans):
        return found
    where = ", ".join(f"{number(low)} to {number(high)}" for low, high in spans)
    said = (
        f"the {found.recommended.upper()} crosses over at {number(at)} Hz, where the response does"
        f" not identify the plant ({where} Hz)"
    )
    return replace(found, lacks="; ".join(filter(None, (found.lacks, said))))
