"""Model + log files -> what the model predicts of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from design.machine.model import Model
from design.machine.plausible import refuse_other_machine, refuse_other_units
from design.measured.predict import Prediction, pooled, predict
from identification.model.estimates import Drive
from workbench.logs.sources import Sources

if TYPE_CHECKING:
    import pandas as pd

PREDICTION_COLUMNS = (
    "t",
    "force_applied",
    "force_predicted",
    "force_simulated",
    "position_measured",
    "position_simulated",
)


@dataclass(frozen=True)
class Predicted:
    """The predictions of a log's runs, and what is said of them together, as `--json` prints it."""

    runs: tuple[Prediction, ...]
    summary: Mapping[str, Any]


def predict_sources(
    model: Model, sources: Sources, *, drive: Drive | None = None, window: float | None = None
) -> Predicted:
    """What the model says of the runs that the sources are; see `predict`.

    Raises BadModel where model and card are of unlike machines, BadLog where a run is in other
    units than the model's logs, and as `predict` does.
    """
    refuse_other_machine(model.rig, sources.rig, str(sources.card.path), "motion")
    refuse_other_units([one.log for one in sources.runs], model.log, sources.rig)
    found = tuple(predict(model, s.log, drive=drive, window=window) for s in sources.runs)
    of_runs = dict.fromkeys(line for one in found for line in one.remarks)
    refused = dict.fromkeys(one.refused for one in found if one.refused is not None)
    names = ("position_rms", "force_predicted_rms", "force_simulated_rms")
    other = []
    if model.card != sources.card.name:
        other = [f"the model is of {model.card}, the log of {sources.card.name}"]
    return Predicted(
        found,
        {
            "drive": found[0].drive,
            "window": window,
            "samples": sum(len(one.t) for one in found),
            **{name: pooled((getattr(one, name), len(one.t)) for one in found) for name in names},
            "run_refused": "; ".join(refused) or None,
            "remarks": (*model.read, *sources.remarks, *other, *of_runs),
        },
    )


def prediction_frame(found: Sequence[Prediction]) -> "pd.DataFrame":
    """The columns of prediction.csv of the runs of one log; NaN where there is no value."""
    import pandas as pd

    frames = [
        pd.DataFrame({name: getattr(one, name) for name in PREDICTION_COLUMNS}) for one in found
    ]
    return pd.concat(frames, ignore_index=True)
