"""Whether a measured force is constant between its samples: by the likelihood of the position.

A line through the samples of a zero-order hold is half a sample ahead of it (Åström, Wittenmark,
Computer-Controlled Systems (1997), 8.2), which passes for viscous friction.
"""

from collections.abc import Sequence

import numpy as np

from identification.estimation.latent_force import latent_forces
from identification.estimation.regression.effect_rows import EffectRows
from identification.estimation.regression.equation_rows import MECHANICAL, MotionLog
from identification.estimation.regression.inertia import inertia_has_no_part
from identification.estimation.regression.motion_log import motion_log
from identification.estimation.regression.row_fit import RowFit, first_stage
from identification.log import Log
from identification.model.plant import Plant
from identification.model.size import Size
from identification.model.surroundings import Surroundings
from identification.thresholds import BEYOND_CHANCE

UNTIL_ITS_ROW = -1.0  # samples, by which the motion follows a force that is constant until its row


def whole_samples_late(logs: Sequence[Log], lag: float) -> float | None:
    """By how many whole samples the motion follows a column of force [N] that is constant from each
    row to the next: 0 or -1 (until its row); None where the position measured while the body slides
    is not significantly likelier so than by a line through the samples.

    lag: in samples, at which such a line is tried too. Each with the parameters of its own equation
    of motion; what else acts is a latent force in all of them. Source: likelihood of the position,
    `latent_force`; the comparison is ours.
    """
    lines = tuple(dict.fromkeys([(0.0, False), (lag, False)]))
    tried = (*lines, (0.0, True), (UNTIL_ITS_ROW, True))
    made = [_with_the_force(logs, at, held) for at, held in tried]
    if any(inertia_has_no_part(moved) or MECHANICAL not in found for moved, _, found in made):
        return None
    slowest = max(found[MECHANICAL].slowest for *_, found in made)
    likely = [
        latent_forces(Plant(stage.friction), moved, slowest).log_likelihood
        for moved, stage, _ in made
    ]
    if 2.0 * (max(likely) - max(likely[: len(lines)])) <= BEYOND_CHANCE**2:
        return None
    return tried[int(np.argmax(likely))][0]


def _with_the_force(
    logs: Sequence[Log], lag: float, held: bool
) -> tuple[list[MotionLog], EffectRows, dict[str, RowFit]]:
    """The logs with their force so many samples later, and held or a line through its samples; and
    what their equation of motion says by itself."""
    late = Surroundings(Size(lag * logs[0].h), held=held)
    moved = [motion_log(late.of_one_instant(log), held=False, by_command=False) for log in logs]
    return moved, *first_stage(moved, False, (MECHANICAL,))
