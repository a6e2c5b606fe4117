"""A machine's resonance where its model has none: of a response.json that was measured."""

from pathlib import Path

from design.machine.design import Design
from design.machine.model import Model
from design.measured.response import RESPONSE_SCHEMA
from design.measured.response_resonance import beyond_seen, with_peaks
from workbench.documents.reading import read_document, read_raw


def with_response(model: Model, file: Path | None) -> Model:
    """The model with the lowest pair of anti-resonance and resonance in a response.json, seen or
    felt.

    Raises BadModel where the file is none, or holds no such pair.
    """
    if file is None:
        return model
    written = read_raw(file, RESPONSE_SCHEMA)
    return with_peaks(model, (*written["peaks"], *written.get("felt", ())), str(file))


def beyond_response(found: Design, file: Path | None) -> Design:
    """The design, which says so where its recommended controller crosses over at a frequency that
    the response.json does not identify."""
    if file is None:
        return found
    return beyond_seen(found, read_document(file)["plant"]["seen_hz"])
