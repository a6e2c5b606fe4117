"""`workbench predict`: a model on a log -> prediction.csv."""

from pathlib import Path
from typing import Literal

import click

from workbench import options
from workbench.ending import StatusCommand
from workbench.output import JSON_OPTION, OUT_OPTION, progress, results
from workbench.signature import by_signature, option


@click.command(
    cls=StatusCommand,
    epilog="Example: workbench predict runs/.../model.json run3.csv --card bench-a",
)
@by_signature
def command(
    model_file: Path = options.MODEL_ARGUMENT,
    log: str = options.LOG_ARGUMENT,
    card: str = options.CARD_OPTION,
    window: float | None = option(
        "Restart from the measured state every S.", type=options.POSITIVE, metavar="S"
    ),
    drive: Literal["force", "command"] | None = option(
        "What drives the run.  [default: the command where the model has an actuator]"
    ),
    effects: tuple[Path, ...] = options.EFFECTS_OPTION,
    as_json: bool = JSON_OPTION,
    out: Path | None = OUT_OPTION,
) -> None:
    """Predict force and position of a log by a model and its effects; nothing is fitted on it.

    Writes prediction.csv: t, force_applied, force_predicted (inverse model), force_simulated
    (actuator driven by the command), position_measured, position_simulated (free run). The force
    is predicted also where the model does not identify what a free run needs (mass, friction of
    sliding, by command the actuator); then `run_refused` says so.
    """
    from workbench.cards.own_effects import library
    from workbench.documents.model_file import read_model
    from workbench.documents.velocity import is_velocity_model, read_velocity_model
    from workbench.logs.sources import read_sources
    from workbench.report.prediction import prediction_view
    from workbench.report.view import show
    from workbench.steps.predict import predict_sources

    velocity = is_velocity_model(model_file)
    if velocity:
        from workbench.report.velocity import velocity_prediction_view
        from workbench.steps.velocity import predict_velocity

        options.refuse_for_velocity("drive", "effects")
        valve = read_velocity_model(model_file)
    else:
        model = read_model(model_file, library(effects))
    sources = read_sources([log], card, velocity=velocity)
    with results("predict", out) as folder:
        with progress("predicting", as_json=as_json):
            if velocity:
                runs = predict_velocity(valve, sources, window)
                view = velocity_prediction_view(runs, window, valve.rotary)
            else:
                found = predict_sources(model, sources, drive=drive, window=window)
                view = prediction_view(found, model.rotary, log, card)
        view.write(folder)
    show(view, folder.final, as_json)
