"""Model + logs -> what the model predicts of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from design.machine.model import Model
from design.machine.plausible import refuse_other_machine, refuse_other_units
from design.machine.source import MachineLogs
from design.measured.predict import Prediction, pooled, predict
from identification.model.estimates import Drive
from identification.signals.one_way import is_one_way


@dataclass(frozen=True)
class Predicted:
    """The predictions of a log's runs, and what is said of them together, as `--json` prints it.

    inertia: whether the predicted force has that of an identified mass in it; one_way: whether the
    runs slide, or the model's logs slid, in one direction alone.
    """

    runs: tuple[Prediction, ...]
    summary: Mapping[str, Any]
    inertia: bool = True
    one_way: bool = False


def predict_logs(
    model: Model,
    logs: MachineLogs,
    where: str,
    *,
    drive: Drive | None = None,
    window: float | None = None,
) -> Predicted:
    """What the model says of the runs of the logs; see `predict`.

    where: what their card is called by. Raises BadModel where model and card are of unlike
    machines, BadLog where a run is in other units than the model's logs, and as `predict` does.
    """
    refuse_other_machine(model.rig, logs.rig, where, "motion")
    refuse_other_units(logs.logs, model.log, logs.rig)
    found = tuple(predict(model, s.log, drive=drive, window=window) for s in logs.runs)
    of_runs = dict.fromkeys(line for one in found for line in one.remarks)
    refused = dict.fromkeys(one.refused for one in found if one.refused is not None)
    names = (
        "position_rms", "force_predicted_rms", "force_steady_rms", "force_applied_rms",
        "force_simulated_rms",
    )  # fmt: skip
    other = []
    if model.card != logs.card:
        other = [f"the model is of {model.card}, the log of {logs.card}"]
    return Predicted(
        found,
        {
            "drive": found[0].drive,
            "window": window,
            "samples": sum(len(one.t) for one in found),
            **{name: pooled((getattr(one, name), len(one.t)) for one in found) for name in names},
            "run_refused": "; ".join(refused) or None,
            "remarks": (*model.read, *logs.remarks, *other, *of_runs),
        },
        model.friction["m"].known,
        model.identifies_one_way or _one_way(found),
    )


def _one_way(runs: Sequence[Prediction]) -> bool:
    """Whether all that runs slide is up, or down, but for a trace: by the way of each stretch."""
    ways = list[float]()
    for run in runs:
        parts = np.split(run.position_measured, np.flatnonzero(np.diff(run.sliding)) + 1)
        ways += [float(one[-1] - one[0]) for one in parts[0 if run.sliding[0] else 1 :: 2]]
    up, slid = sum(max(one, 0.0) for one in ways), sum(map(abs, ways))
    return slid > 0.0 and is_one_way(up / slid)
