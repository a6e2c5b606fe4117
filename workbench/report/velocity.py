"""Results of a rig whose velocity follows the command: one screen each, and a report."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from design.controllers.velocity_loop import (
    DESIGN_NEEDS,
    VelocityValidation,
    velocity_validation_document,
)
from design.identified.velocity import VelocityPredicted, VelocityPrediction, VelocityTraced
from design.identified.velocity_documents import prediction_summary, velocity_trace_document
from design.machine.readable import number
from design.machine.velocity import VelocityDesign, VelocityModel, velocity_document
from identification.velocity.record import RUN_IN
from identification.velocity.rivals import STRUCTURES, is_noise
from workbench.output import Step, step
from workbench.report.model_tables import MODEL_HEAD, estimate_cells, logs_of
from workbench.report.prediction import csv_text
from workbench.report.templating import MEANINGS
from workbench.report.view import Section, View, notes, view
from workbench.screen import Part, Row, tabled

WHAT_LAW = (
    "law: v = k_p e + k_i int(e) + dr/dt, e = r - y; u = v/g_p + d_p min(|v|/smooth, 1) where"
    " v/g_p > 0, else u = v/g_n - d_n min(|v|/smooth, 1)"
)
SLOWER_MODULUS, MOST_MODULUS = 1.3, 0.9  # asked for next; times the one before
RIVAL_ROWS = ("rival", "held out, 2 s", "0.2 s", "chance", "clearly better")


def _errors(model: VelocityModel) -> str:
    fit, display = model.fit, model.display
    return (
        f"position predicted by the command alone, on stretches held out of the fit: within"
        f" {display.length_text(fit.position_rms_2s)} rms over 2 s,"
        f" {display.length_text(fit.position_rms_02s)} over 0.2 s (sensor's noise"
        f" {display.length_text(fit.noise_y)})"
    )


def _summary(model: VelocityModel) -> str:
    known = [name for name, one in model.valve.items() if one.known]
    lost = [name for name in model.valve if name not in known]
    many = "All six" if not lost else f"{len(known)} of the six"
    said = f"{many} valve parameters identified (the velocity follows the command; no friction)."
    return f"{said} Not identifiable: {', '.join(lost)}." if lost else said


def _valve(model: VelocityModel) -> Part:
    """The numbers: value, unit, 95 % interval (or why there is none), at length what each is."""
    rows = [
        (key, *estimate_cells(one), MEANINGS["valve"].get(key, ""))
        for key, one in model.numbers.items()
    ]
    short = tabled(MODEL_HEAD, [row[:4] for row in rows], whole=rows)
    return replace(short, whole_head=(*MODEL_HEAD, "meaning"))


@view.register
def _(found: VelocityModel | VelocityTraced | VelocityDesign | VelocityValidation) -> View:
    """A model, a trace, a design or a validation: its sentence, its numbers and its remarks."""
    model = found.model if isinstance(found, VelocityTraced) else found
    parts: list[Part | str]
    files: dict[str, Callable[[], dict[str, Any]]]
    match found:
        case VelocityModel():
            what, sentence, errors = "Identification of", _summary(found), _errors(found)
            valve = _valve(found)
            files = {"model.json": partial(velocity_document, found)}
            parts = [valve, errors, notes(found.remarks, logs_of(found))]
            sections = [Section("The valve", valve), Section("In words", [errors, *found.remarks])]
        case VelocityTraced():
            what, sentence = "Trace of", _verdict(found)
            files = {"trace.json": partial(velocity_trace_document, found),
                     "model.json": partial(velocity_document, found.model)}  # fmt: skip
            untried = [f"not tried: {', '.join(found.left.not_tried)}"] * bool(found.left.not_tried)
            remarks, rivals = [*untried, *found.model.remarks], _rivals(found)
            valve = _valve(found.model)
            parts = [rivals, valve, notes(remarks, logs_of(found.model))]
            sections = [Section("The valve", valve),
                        Section("What else was tried", rivals, remarks)]  # fmt: skip
        case VelocityDesign():
            what, (sentence, *rest) = "Design for", design_lines(found)
            files = {"design.json": partial(velocity_document, found)}
            parts = [*rest, notes(found.remarks)]
            sections = [Section("The controller", [*rest, *found.remarks])]
        case VelocityValidation():
            what, loops, many = "Validation for", _validation_table(found), len(found.figures)
            failed = sum(bool(one.misses) for one in found.figures.values())
            sentence = f"Not passed: on {failed} of {many} plants a limit is missed."
            if found.passed:
                sentence = f"Passed: the loop meets every limit on {many} plants."
            files = {"validation.json": partial(velocity_validation_document, found)}
            parts, sections = [loops], [Section("The loop", loops)]
    return View(f"{what} {model.card}", sentence, parts, files, lambda: sections)


def after_velocity(model: VelocityModel, logs: Sequence[str], card: str, folder: Path) -> Step:
    """Look for what is missing where more than noise is left; add a run; else design."""
    if any(not model.valve[name].known for name in DESIGN_NEEDS):
        return step("with a run that identifies the rest added", "identify", *logs, "--card", card)
    if not is_noise(model.fit.position_rms_2s**2, model.fit.noise_y):
        return step("more than noise is left", "trace", *logs, "--card", card)
    return step("a controller for it", "design", folder / "model.json")


def _verdict(found: VelocityTraced) -> str:
    left, display = found.left, found.model.display
    over = f"{display.length_text(left.unextended.rms[0])} rms of held-out position over 2 s"
    match left.verdict:
        case "none":
            return f"Nothing is missing: the valve leaves {over}, no more than the sensor's noise"
        case "effect":
            best = next(one for one in left.rivals if one.key == left.named)
            whole = "what is left is noise" if left.complete else "more than noise is left"
            return (
                f"Missing: {STRUCTURES[best.key].words} ({best.key}): {over} ->"
                f" {display.length_text(best.left.rms[0])}; {whole}"
            )
        case "inseparable":
            able = ", ".join(one.key for one in left.rivals if one.better)
            return f"Inseparable: {able} explain the residual equally; before, {over}"
        case _:
            return f"Unknown: {over}, and no richer structure predicts it clearly better"


def _rivals(found: VelocityTraced) -> Part:
    display = found.model.display
    rows = [
        (one.key, display.length_text(one.left.rms[0]), display.length_text(one.left.rms[1]),
         number(one.p_value, 2), "yes" if one.better else "no")
        for one in found.left.rivals
    ]  # fmt: skip
    return tabled(RIVAL_ROWS, rows, (1, 2, 3))


def velocity_csv(runs: Sequence[VelocityPrediction]) -> str:
    """prediction.csv: time [s], measured and simulated position [m (rad)]; empty: no value."""
    import pandas as pd

    names = {"t": "t", "position_measured": "measured", "position_simulated": "simulated"}
    columns = {
        name: np.concatenate([getattr(one, key) for one in runs]) for name, key in names.items()
    }
    return csv_text(pd.DataFrame(columns), 9)


@view.register
def _(found: VelocityPredicted) -> View:
    """How far the simulated position is from the measured one."""
    runs, window, display = found.runs, found.window, found.display
    summary = prediction_summary(runs, window)
    begun = f" from {RUN_IN:g} s on, since commands from before the log act until then"
    anew = f"{begun}{f', anew every {window:g} s' if window else ''}"
    off, worst = (
        display.length_text(float(summary[k] or 0.0)) for k in ("position_rms", "position_worst")
    )
    return View(
        "Prediction",
        f"position by the command alone{anew}: within {off} rms, {worst} at most",
        [],
        {"prediction.csv": lambda: velocity_csv(runs)},
        has_page=False,
        content=lambda: summary,
    )


def _margins(margins: dict[str, float | None]) -> str:
    def said(name: str, unit: str) -> str:
        value = margins.get(name)
        return "none needed" if value is None else f"{number(value)}{unit}"

    return (
        f"margins: gain {said('gain', '')}, phase {said('phase_deg', ' deg')}, modulus"
        f" {said('modulus', '')}, delay {said('delay_s', ' s')}"
    )


def design_lines(found: VelocityDesign) -> list[str]:
    """The controller in words and numbers."""
    meaning = MEANINGS["valve"] | MEANINGS["valve_law"]
    numbers = [
        f"  {name} = {number(one.value or 0.0, 4)} {one.unit}: {meaning.get(name, '')}"
        for name, one in found.controller.items()
    ]
    return [
        f"{found.law} position controller with speed feedforward, dead zones compensated",
        WHAT_LAW,
        *numbers,
        _margins(dict(found.margins)),
    ]


VALIDATED = ("plant", "standstill", "overshoot", "tracking", "modulus", "delay", "misses")


def _validation_table(found: VelocityValidation) -> Part:
    rows: list[Row] = []
    for place, one in found.figures.items():
        m = one.margins or {}
        shown = [
            "-" if m.get(key) is None else number(float(m[key] or 0.0)) + unit
            for key, unit in (("modulus", ""), ("delay_s", " s"))
        ]
        shares = [f"{100 * value:.2g} %" for value in (one.standstill, one.overshoot, one.tracking)]
        rows.append((place, *shares, *shown, "; ".join(one.misses) or "nothing"))
    return tabled(VALIDATED, rows, (1, 2, 3, 4, 5))


def after_velocity_validation(found: VelocityValidation, model_file: Path) -> Step | None:
    """A slower loop where a limit is missed."""
    if found.passed:
        return None
    modulus = min(SLOWER_MODULUS * found.limits.modulus, MOST_MODULUS)
    return step("a slower loop", "design", model_file, "--modulus", f"{modulus:.2g}")
