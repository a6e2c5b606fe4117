"""`workbench predict`: a model on a log -> prediction.csv."""

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from workbench import options
from workbench.output import results
from workbench.signature import option

if TYPE_CHECKING:
    from workbench.report.view import View


@options.command(
    epilog="Example: workbench predict runs/.../model.json run3.csv --card bench-a",
)
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
    out: Path | None = options.OUT_OPTION,
) -> None:
    """Predict force and position of a log by a model and its effects; nothing is fitted on it.

    Writes prediction.csv: t, force_applied, force_predicted (inverse model), force_simulated
    (actuator driven by the command), position_measured, position_simulated (free run). The force
    is predicted also where the model does not identify what a free run needs (mass, friction of
    sliding, by command the actuator); then `run_refused` says so.
    """
    from workbench.documents.velocity import is_velocity_model
    from workbench.interface.logs import predict
    from workbench.interface.models import load_model
    from workbench.report.next_steps import after_predict

    one_way = False
    with results("predict", out) as folder:
        if is_velocity_model(model_file):
            options.refuse_for_velocity("drive", "effects")
            shown = _of_velocity(model_file, log, card, window)
        else:
            model = load_model(model_file, effects)
            found = predict(model, log, card, drive=drive, window=window)
            shown, one_way = found.view, found.found.one_way
        shown.write(folder)
    shown.show(folder.final, after_predict(log, card, one_way=one_way))


def _of_velocity(model_file: Path, log: str, card: str, window: float | None) -> "View":
    """The same of a rig whose velocity follows the command."""
    from design.identified.velocity import predict_velocity
    from workbench.course import working
    from workbench.documents.velocity import read_velocity_model
    from workbench.logs.sources import read_sources
    from workbench.report.view import view

    valve = read_velocity_model(model_file)
    sources = read_sources([log], card, velocity=True)
    with working("predicting"):
        return view(predict_velocity(valve, sources.logs, str(sources.card.path), window))
