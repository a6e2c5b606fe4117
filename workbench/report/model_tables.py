"""Results as tables for a terminal and as rows for a report."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from identification.model.estimates import Estimate
from workbench.cards.parameter_units import shown
from workbench.documents.model import Model
from workbench.output import Row, table, written

if TYPE_CHECKING:
    from rich.console import Group

MODEL_HEAD = ("parameter", "value", "unit", "95 % interval")
MEANING = {
    "m": "moving mass",
    "F_cp": "Coulomb friction, positive direction",
    "F_cn": "Coulomb friction, negative direction",
    "F_vp": "viscous friction, positive direction",
    "F_vn": "viscous friction, negative direction",
    "dv_p": "stick band, upper velocity limit",
    "dv_n": "stick band, lower velocity limit",
    "F_sp": "breakaway force, positive direction",
    "F_sn": "breakaway force, negative direction",
    "k1": "actuator gain",
    "k2": "actuator back-effect of velocity",
    "k_a": "motor constant",
}
ROTARY_MEANING = {
    **MEANING,
    "m": "moment of inertia",
    "F_sp": "breakaway torque, positive direction",
    "F_sn": "breakaway torque, negative direction",
}


def parameter_rows(model: Model) -> list[Row]:
    """Parameter, value, unit, 95 % interval (or why there is none) and meaning, a row each."""
    found = {**model.friction, **(model.actuator or {})}
    meaning = ROTARY_MEANING if model.rotary else MEANING
    return [(name, *_cells(value), meaning.get(name, "")) for name, value in found.items()]


def _cells(estimate: Estimate) -> tuple[str, str, str]:
    if estimate.value is None:
        return "-", estimate.unit, f"not identified: {estimate.reason}"
    if estimate.low is None or estimate.high is None:
        return f"{estimate.value:.4g}", estimate.unit, estimate.reason or "no interval"
    low, high = in_digits((estimate.low, estimate.high), estimate.value, estimate.sd)
    (value,) = in_digits((estimate.value,), estimate.value, estimate.sd)
    return value, estimate.unit, f"{low} to {high}"


def in_digits(values: Iterable[float], size: float, sd: float | None) -> list[str]:
    """Numbers with as many digits as their standard deviation leaves meaning to."""
    import math

    digits = 4
    if sd and size and math.isfinite(sd):
        digits = max(2, math.ceil(math.log10(abs(size) / sd)) + 2)
    return [f"{value:#.{min(digits, 8)}g}".rstrip(".") for value in values]


def model_view(model: Model, remarks: Sequence[str], folder: Path | None) -> "Group":
    """The parameters, what the fit leaves, and remarks, for a terminal."""
    from rich.console import Group, RenderableType

    rows = [row[:4] for row in parameter_rows(model)]
    parts: list[RenderableType] = [table(MODEL_HEAD, rows)]
    parts.extend(fit_lines(model))
    parts.extend(f"note: {line}" for line in (*remarks, *model.fit.remarks))
    if folder is not None:
        parts.append(written(folder, "model.json", "report.html"))
    return Group(*parts)


def summary(model: Model) -> str:
    """What was found, in one sentence."""
    known = [name for name, e in model.friction.items() if e.value is not None]
    text = f"{len(known)} of 9 friction parameters identified from {len(model.log)} run(s)."
    if model.assumed:
        text += f" The logs do not tell {', '.join(model.assumed)}."
    if model.fit.adequate:
        return text + " The model leaves nothing but sensor noise."
    return text + (
        " The model leaves more than sensor noise: run 'workbench trace' to find what it lacks, and"
        " see the remarks."
    )


def fit_lines(model: Model) -> list[str]:
    """What the fit leaves, in words."""
    unit = shown(model.rotary).position
    by = "the command" if model.fit.drive == "command" else f"the applied force, {held(model)}"
    lines = [
        f"{e.file}: simulated position within {e.position_rms:.3g} {unit} rms over"
        f" {e.duration:.4g} s, driven by {by}"
        for e in model.log
        if e.position_rms is not None
    ]
    if model.imposed:
        lines.append("the motion was imposed: the equation of motion was fitted, not a free run")
    if model.fit.force_relative is not None:
        share = 100 * model.fit.force_relative
        lines.append(f"force while sliding: {share:.2f} % unexplained by the equation of motion")
    if model.posterior is not None:
        lines.append(f"posterior: {model.posterior['verdict']}")
    if model.plant is None:
        lines.append(f"no ARX plant: {model.plant_reason}")
    else:
        p = model.plant
        lines.append(
            f"ARX plant {p.input} -> y: na={p.na}, nb={p.nb}, nk={p.nk} at {1e3 * p.h:.4g} ms,"
            f" one step ahead within {p.one_step_rms:.2g} {unit} rms on held-out samples"
        )
    return lines


def held(model: Model) -> str:
    """How a run on the measured force was kept near the measured position."""
    from workbench.steps.predict import FORCE_WINDOW

    anew = f"restarted from the measured state every {FORCE_WINDOW:g} s"
    if model.fit.stiffness == 0.0:
        return anew
    unit = shown(model.rotary).stiffness
    return f"held to the measured position by {model.fit.stiffness:.3g} {unit} and {anew}"
