"""Results as tables for a terminal and as rows for a report."""

import re
from collections.abc import Iterable, Sequence

from design.machine.effect_values import known_effect
from design.machine.model import Model, used
from design.machine.readable import as_shown, in_digits, number, times
from design.machine.velocity import VelocityModel
from identification.effects._base import Param
from identification.estimation.converged_fit import STOP_TURNS_ON_LESS
from identification.estimation.latent_force import LatentForces
from identification.model.estimates import Estimate
from identification.thresholds import ADEQUATE, ASTRAY, MATERIAL, OF_ACCOUNT
from workbench.remarks import printed_once
from workbench.report.templating import MEANINGS
from workbench.report.trace_words import share_of_friction, two_masses_sentence
from workbench.report.view import notes
from workbench.screen import Part, Row, instead, more, tabled

MODEL_HEAD = ("parameter", "value", "unit", "95 % interval")


def parameter_rows(model: Model) -> list[Row]:
    """Parameter, value, unit, 95 % interval (or why there is none) and meaning, a row each."""
    found = {**model.friction, **(model.actuator or {})}
    meaning = MEANINGS["parameters"] | (MEANINGS["parameters_of_rotary"] if model.rotary else {})
    rows: list[Row] = [
        (name, *estimate_cells(value), meaning.get(name, "")) for name, value in found.items()
    ]
    for key, own in model.effects.items():
        params = {p.name: p for p in known_effect(key, model.library).params}
        rows += [
            (f"{key.replace('_', ' ')} {name}", *estimate_cells(value), params[name].meaning)
            for name, value in own.items()
            if not (params[name].at_default(used(value)) or is_left_out(params[name], value))
        ]
    if model.lag is not None:
        rows.append(
            ("lag", *estimate_cells(model.lag), "of the position behind the force of its row")
        )
    for name, one in (model.resonance or {}).items():
        rows.append((name.replace("_", "-") if "resonance" in name else name,
                     *estimate_cells(one), MEANINGS["resonance"][name]))  # fmt: skip
    return rows


def is_left_out(param: Param, estimate: Estimate) -> bool:
    """Whether it is a size that its effect does without."""
    return param.spare and estimate.value == 0.0 and estimate.sd is None


def estimate_cells(estimate: Estimate, why: str = "not identified: ") -> tuple[str, str, str]:
    """Value, unit, and 95 % interval or why there is none, of a parameter; why: before a reason."""
    estimate = as_shown(estimate)
    if estimate.value is None:
        reason = estimate.reason if why else estimate.reason or "not identified"
        return "-", estimate.unit, f"{why}{reason}"
    if estimate.low is None or estimate.high is None:
        return number(estimate.value, 4), estimate.unit, estimate.reason or "no interval"
    numbers = (estimate.value, estimate.low, estimate.high)
    value, low, high = in_digits(numbers, estimate.value, estimate.sd)
    return value, estimate.unit, f"{low} to {high}"


def model_parts(model: Model, remarks: Sequence[str]) -> list[Part | str]:
    """The parameters, what the fit leaves, and remarks."""
    rows = [row[:4] for row in parameter_rows(model)]
    logs, lines = logs_of(model), fit_lines(model)
    return [
        tabled(MODEL_HEAD, reasons_once(rows, logs), whole=rows),
        instead(printed_once(lines, logs), lines),
        *map(more, plant_lines(model)),
        notes((*remarks, *model.fit.remarks), logs),
    ]


def logs_of(model: Model | VelocityModel) -> tuple[str, ...]:
    """Names of the model's logs, as remarks begin with them."""
    return tuple(dict.fromkeys(entry.file for entry in model.log))


WIDE = re.compile(r"found (\S+), but the interval (.+) is wider than the value")
# At the end of a reason; in older files it begins with ": the logs".
WHAT_TO_DO = re.compile(r"(: (the logs|not identifiable)[a-z ]*)?; .*")
INSIGNIFICANT = "not significantly different from 0"


def reasons_once(
    rows: Iterable[Row], logs: Iterable[str], columns: tuple[int, int, int] = (1, 2, 3)
) -> list[Row]:
    """Rows of parameters for one screen: those that are not identified for the same reason in one
    row, without the reason's advice.

    columns: of the value, of its unit, and of its interval or the reason.
    """
    value, unit, reason = columns
    groups: dict[tuple[str, ...], list[Row]] = {}
    for row in rows:
        key = (row[0],) if row[value] != "-" else ("", _short(row[reason], logs))
        groups.setdefault(key, []).append(row)
    out = []
    for (name, *why), alike in groups.items():
        cells, units = [*alike[0]], {one[unit] for one in alike}
        if not name:
            cells[0] = ", ".join(one[0] for one in alike)
            cells[unit] = units.pop() if len(units) == 1 else ""
            cells[reason:] = [*why, *[""] * (len(cells) - reason - 1)]
        out.append(tuple(cells))
    return out


def _short(reason: str, logs: Iterable[str]) -> str:
    """A reason without the name of the log and its advice."""
    said = reason.removeprefix("not identified: ")
    for name in (*logs, *re.findall(r"^\d+ logs", said)):
        said = said.removeprefix(f"{name}: ")
    if not said:
        return "not identifiable"
    return not_identified(WIDE.sub(r"found \1, anywhere in \2", WHAT_TO_DO.sub("", said)))


def not_identified(why: str) -> str:
    """Why a parameter has no interval; one near 0 is well known, and said to be so alone."""
    return why if why.startswith(INSIGNIFICANT) else f"not identifiable: {why}"


def summary(model: Model, missing: LatentForces | None) -> str:
    """What was found, in a few sentences; missing: the force that the model lacks on its logs."""
    share = None if missing is None else missing.share(max(model.karnopp.F_cp, model.karnopp.F_cn))
    if missing is None or share is None or model.coulomb_unknown:
        return _found(model, None)
    said = share_of_friction(share, missing)
    known = None if missing.is_a_bound and share > MATERIAL else share
    return f"{_found(model, known)} Force missing: {said} of friction."


def _found(model: Model, missing: float | None) -> str:
    """What was identified and what is left; missing: share of friction, None where none shows."""
    shows = missing is not None and missing > OF_ACCOUNT
    known = [name for name, e in model.friction.items() if e.value is not None]
    many = "All nine" if len(known) == len(model.friction) else f"{len(known)} of the nine"
    logs = "one log" if len(model.log) == 1 else f"{len(model.log)} logs"
    text = f"{many} friction parameters identified from {logs}."
    if model.assumed:
        text += f" Not identifiable: {', '.join(model.assumed)}."
    if model.fit.adequate:
        more = "; the equation of motion leaves more" if shows else ""
        if model.by_equation:  # its fit had a run, with parameters of more error
            return f"{text} A free run follows the logs to the sensors' noise{more}."
        who = "free run" if shows else "model"
        return f"{text} The {who} leaves nothing but {_noise_of(model)}{more}."
    if model.resonance is not None:
        said = two_masses_sentence(model.resonance)
        return f"{text} {said[0].upper()}{said[1:]}"
    if model.by_equation and missing is not None and missing <= MATERIAL:
        times_noise = times(model.fit.chi_square**0.5)
        return f"{text} The equation of motion leaves {times_noise} the sensors' noise."
    if to_the_noise_by_equation(model):
        leaves = "little more than noise, but a force is missing" if shows else "nothing but noise"
        return f"{text} The equation of motion leaves {leaves}; no free run follows."
    if missing is not None and missing <= MATERIAL:
        return (
            f"{text} No force is missing while it slides; what the run leaves, {left_of(model)}, is"
            " of stops and breakaways."
        )
    return f"{text} The model leaves more than noise, {left_of(model)}: an effect is missing."


def _noise_of(model: Model) -> str:
    """Whose noise an adequate model leaves: that of what drives its run is larger in position than
    the position sensor's, and so is what a stop leaves that comes a row sooner or later."""
    off, drive = _off(model), model.fit.drive
    if off is None or off <= ASTRAY * model.fit.noise_y:
        return "sensor noise"
    if any(STOP_TURNS_ON_LESS in remark for remark in model.fit.remarks):
        return "sensor noise and stops that it shifts in time"
    return f"what noise of the {'command' if drive == 'command' else 'measured force'} makes"


def left_of(model: Model) -> str:
    """What the model leaves, beside the noise."""
    off = _off(model)
    if off is None:
        return f"{times(model.fit.chi_square**0.5)} the sensors' noise"
    noise = model.display.length_text(model.fit.noise_y)
    return f"{model.display.length_text(off)} rms of position, where the sensor's noise is {noise}"


def _off(model: Model) -> float | None:
    """Largest position error of the runs (rms) [m or rad], None without runs."""
    off = [e.position_rms for e in model.log if e.position_rms is not None]
    return max(off, default=None)


def to_the_noise_by_equation(model: Model) -> bool:
    """Whether the equation of motion answers for a model, and leaves hardly more than noise."""
    return model.by_equation and model.fit.chi_square <= ADEQUATE


def fit_lines(model: Model) -> list[str]:
    """What the fit leaves, and what would identify the rest, in words."""
    from design.measured.predict import FORCE_WINDOW, in_windows

    by, within = "the command", ""
    if model.fit.drive != "command":
        by = f"the applied force, {run_coupling(model)}"
    elif in_windows(model):
        within = f" in windows of {FORCE_WINDOW:g} s from measured states"
    lines = [
        f"{e.file}: simulated position within {model.display.length_text(e.position_rms)}"
        f" rms{within} over {e.duration:.4g} s, driven by {by}"
        for e in model.log
        if e.position_rms is not None
    ]
    if model.by_equation:
        lines.append("the parameters are those of the equation of motion, not of a free run")
    if model.fit.force_relative is not None and model.resonance is None:  # of one body
        share = 100 * model.fit.force_relative
        lines.append(
            f"force while sliding: {share:.2f} % unexplained from sample to sample"
            + (", the noise of the acceleration in it" if model.friction["m"].known else "")
        )
    known = any(one.sd is not None for one in model.friction.values())
    if known and not (model.fit.adequate or to_the_noise_by_equation(model)):
        lines.append(
            "the 95 % intervals hold for this law only: what it leaves beyond noise is not in them"
        )
    runs = runs_to_add(model)
    if runs:
        lines.append(f"to identify the rest: {'; '.join(runs)}")
    if model.posterior is not None:
        lines.append(f"posterior: {model.posterior['verdict']}")
    return lines


def plant_lines(model: Model) -> list[str]:
    """The linear plant, or why there is none, in words."""
    if model.plant is None:
        return [f"no ARX plant: {model.plant_reason}"]
    p = model.plant
    return [
        f"linear plant (ARX) from {p.input} to y, every {1e3 * p.h:.4g} ms: na={p.na},"
        f" nb={p.nb}, nk={p.nk}; one step ahead within"
        f" {model.display.length_text(p.one_step_rms)} rms on held-out samples"
    ]


def runs_to_add(model: Model) -> tuple[str, ...]:
    """Runs that would identify what neither the gate before the fit nor the fit could."""
    found = {**model.friction, **(model.actuator or {})}
    runs = (
        one.add.removeprefix("add ")
        for one in model.identifiability
        if one.add and one.name in found and not found[one.name].known
    )
    return tuple(dict.fromkeys(runs))


def run_coupling(model: Model) -> str:
    """How a run on the measured force was kept near the measured position."""
    from design.measured.predict import FORCE_WINDOW

    anew = f"restarted from the measured state every {FORCE_WINDOW:g} s"
    if model.fit.stiffness == 0.0:
        return anew
    unit = model.display.stiffness
    return f"corrected to the measured position by {number(model.fit.stiffness)} {unit} and {anew}"
