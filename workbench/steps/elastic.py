"""A machine's resonance where its model has none: of a frequency response that was measured."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

from design.machine.design import Design
from design.machine.model import Model, used
from design.machine.readable import number
from design.measured.response import RESPONSE_SCHEMA
from identification.errors import BadModel
from identification.model.estimates import Estimate
from workbench.documents.reading import read_document, read_raw


def with_response(model: Model, file: Path | None) -> Model:
    """The model with the lowest pair of anti-resonance and resonance in a response.json, seen or
    felt.

    Raises BadModel where the file is none, or holds no such pair.
    """
    if file is None:
        return model
    written = read_raw(file, RESPONSE_SCHEMA)
    every = (*written["peaks"], *written.get("felt", ()))
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
        f"{file}: no anti-resonance with a resonance above it (peaks: {kinds}), as two masses have"
        " them; log a run that moves the machine there, or design without --response"
    )


def beyond_response(found: Design, file: Path | None) -> Design:
    """The design, which says so where its recommended controller crosses over at a frequency that
    the response.json does not identify."""
    one = found.controllers.get(str(found.recommended))
    if file is None or one is None or one.margins.crossover_hz is None:
        return found
    at, spans = one.margins.crossover_hz, read_document(file)["plant"]["seen_hz"]
    if any(low <= at <= high for low, high in spans):
        return found
    where = ", ".join(f"{number(low)} to {number(high)}" for low, high in spans)
    said = (
        f"the {found.recommended.upper()} crosses over at {number(at)} Hz, where the response does"
        f" not identify the plant ({where} Hz)"
    )
    return replace(found, lacks="; ".join(filter(None, (found.lacks, said))))
