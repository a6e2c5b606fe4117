"""The gate before a fit: how well a log can identify each parameter, by its run at a first
estimate.

No fit is made. The equations and the breakaways give a first plant; the sensitivities of its run,
in windows from measured states, are the information that the log holds. Bands and stick limits of
a first plant may be far off, so what is promised is wider than the information alone would have it.
"""

from collections.abc import Sequence

import numpy as np

from identification.effects._base import Acting
from identification.effects._library import Library
from identification.errors import UserError
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regressed_plant import first_plant
from identification.estimation.windowed_run.run_errors import judge
from identification.estimation.windowed_run.windows import RUN_WINDOW
from identification.experiment.information import Information, information
from identification.experiment.structures import discriminated, sought
from identification.model.estimates import NORMAL_95
from identification.model.plant import Plant
from identification.thresholds import GATE_MARGIN

# Half intervals over the value, below which nothing is promised: what a fit gives that loses a
# stop, where an actuator's command brings the run back to the log, and where nothing does
# (benchmarks/gate.py, seeds below 1500).
NO_SURER = {
    "m": 0.01, "F_c": 0.005, "F_v": 0.005, "dv_": 0.05, "F_s": 0.01, "k1": 0.002, "k2": 0.002,
}  # fmt: skip
NO_SURER_CHAOTIC = {"m": 0.1, "F_c": 0.03, "F_v": 0.04, "dv_": 0.12, "F_s": 0.01}


def identifiability(recorded: RecordedLogs) -> dict[str, float]:
    """How well logs can identify each of the nine, and k1 and k2 where a command drives their runs:
    half the 95 % interval, over the value, that a fit should give at most.

    Infinite where the run says nothing. Raises NotIdentifiable where nothing moves. Empty where no
    run of a first plant can be followed.
    """
    known = _information(first_plant(recorded), recorded)
    if known is None:
        return {}
    least = NO_SURER if recorded.by_command else NO_SURER_CHAOTIC
    return {
        name: max(NORMAL_95 * GATE_MARGIN * float(sd), least[name[:3]])
        for name, sd in zip(known.names, known.deviations, strict=True)
    }


def tellable_effects(recorded: RecordedLogs, library: Library) -> dict[str, float]:
    """By how many deviations of the noise each effect, at a size that matters, would show in the
    logs' runs beyond what the parameters make up for; those that act by other signals left out.

    Raises NotIdentifiable where nothing moves. Empty where no run of a first plant can be followed.
    """
    plant = first_plant(recorded)
    y = np.concatenate([log["y"] for log in recorded.plain])
    stroke = (float(np.min(y)), float(np.max(y)))
    rivals = [sought(one, plant, stroke) for one in library.values() if not one.signals]
    known = _information(plant, recorded, rivals)
    if known is None:
        return {}
    own = range(len(known.names) - len(rivals))
    return {
        one.key: float(np.sqrt(discriminated(known.matrix, at, own)))
        for at, one in enumerate(rivals, len(own))
    }


def _information(
    plant: Plant, recorded: RecordedLogs, rivals: Sequence[Acting] = ()
) -> Information | None:
    """What the logs' runs in windows identify of the plant; None where it cannot follow them."""
    try:
        errors_of = judge(plant, recorded.logs, recorded.drive, RUN_WINDOW)
        return information(plant, errors_of, recorded.drive, rivals, lost=np.inf)
    except UserError:
        return None
