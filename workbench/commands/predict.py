"""`workbench predict`: a model on a log -> prediction.csv."""

from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from workbench.options import POSITIVE, card_option, effects_option
from workbench.output import OutputFolder, emit, output_options, progress

if TYPE_CHECKING:
    from workbench.steps.predict import Prediction


@click.command(epilog="Example: workbench predict runs/.../model.json run3.csv --card bench-a")
@click.argument("model_file", metavar="MODEL", type=click.Path(path_type=Path))
@click.argument("log", metavar="LOG")
@card_option
@click.option(
    "--window", type=POSITIVE, metavar="S", help="Restart from the measured state every S."
)
@click.option(
    "--drive",
    type=click.Choice(["force", "command"]),
    help="What drives the run.  [default: the command where the model has an actuator]",
)
@effects_option
@output_options
def command(
    model_file: Path,
    log: str,
    card: str,
    window: float | None,
    drive: Literal["force", "command"] | None,
    effects: tuple[Path, ...],
    as_json: bool,
    out: Path | None,
) -> None:
    """Predict force and position of a log by a model and its effects; nothing is fitted on it.

    Writes prediction.csv: t, force_applied, force_predicted (inverse model), force_simulated
    (actuator driven by the command), position_measured, position_simulated (free run). The force
    is predicted also where the model does not tell what a free run needs (mass, friction of
    sliding, by command the actuator); then `run_refused` says so.
    """
    from identification.errors import BadModel
    from workbench.cards.own_effects import library
    from workbench.documents.model import read_model
    from workbench.logs.sources import read_sources
    from workbench.steps.predict import predict, prediction_csv

    model = read_model(model_file, library(effects))
    sources = read_sources([log], card)
    if sources.rig.motion != model.rig.motion:
        raise BadModel(
            f"{model_file}: of a {model.rig.motion} machine, but {sources.card.path} says"
            f' motion = "{sources.rig.motion}"; give the model and the card of one machine'
        )
    with OutputFolder("predict", out, now=datetime.now()) as folder:
        with progress("predicting", as_json=as_json):
            found = [predict(model, s.log, drive=drive, window=window) for s in sources.runs]
        folder.write_text("prediction.csv", prediction_csv(found))
    of_runs = dict.fromkeys(line for one in found for line in one.remarks)
    other_card = _other_card(model.card, sources.card.name)
    remarks = (*model.read, *sources.remarks, *other_card, *of_runs)
    refused = dict.fromkeys(one.refused for one in found if one.refused is not None)
    summary = {
        "drive": found[0].drive,
        "window": window,
        "samples": sum(len(one.t) for one in found),
        **_errors(found),
        "run_refused": "; ".join(refused) or None,
        "remarks": remarks,
        "out": folder.final,
    }
    emit(summary, as_json, lambda: "\n".join(_lines(summary, model.rotary, remarks)))


def _other_card(of_model: str, of_log: str) -> list[str]:
    if of_model == of_log:
        return []
    return [f"the model is of {of_model}, the log of {of_log}"]


def _errors(found: "list[Prediction]") -> dict[str, float | None]:
    """Root mean squares over all runs of the log."""
    import numpy as np

    def rms(name: str) -> float | None:
        pairs = [(getattr(one, name), len(one.t)) for one in found]
        known = [(value, n) for value, n in pairs if value is not None]
        if not known:
            return None
        return float(np.sqrt(sum(v * v * n for v, n in known) / sum(n for _, n in known)))

    names = ("position_rms", "force_predicted_rms", "force_simulated_rms")
    return {name: rms(name) for name in names}


def _lines(summary: Mapping[str, object], rotary: bool, remarks: tuple[str, ...]) -> list[str]:
    from workbench.cards.parameter_units import shown

    length, _, force, *_ = shown(rotary)
    by = "the command" if summary["drive"] == "command" else "the applied force"
    window = summary["window"]
    start = "free run" if window is None else f"restarted every {window} s"
    lines = []
    if summary["position_rms"] is not None:
        rms = f"{summary['position_rms']:.4g} {length} rms"
        lines.append(f"position ({start}, driven by {by}): {rms}")
    if summary["run_refused"] is not None:
        lines.append(f"position: {summary['run_refused']}")
    if summary["force_predicted_rms"] is not None:
        rms = f"{summary['force_predicted_rms']:.4g} {force} rms"
        lines.append(f"force, inverse model: {rms} while sliding, outside the stick band")
    if summary["force_simulated_rms"] is not None:
        lines.append(f"force, simulated: {summary['force_simulated_rms']:.4g} {force} rms")
    lines.extend(f"note: {line}" for line in remarks)
    return [*lines, f"written: {Path(str(summary['out'])) / 'prediction.csv'}"]
