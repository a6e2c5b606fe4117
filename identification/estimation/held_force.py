"""Whether a measured force is constant between its samples: by the likelihood of the position.

A line through the samples of a zero-order hold is half a sample ahead of it (Åström, Wittenmark,
Computer-Controlled Systems (1997), 8.2), which passes for viscous friction.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.errors import UserError
from identification.estimation.latent_force import latent_forces
from identification.estimation.regression.equation_rows import FIVE, MotionLog
from identification.estimation.regression.inertia import inertia_has_no_part
from identification.estimation.regression.lagged_rows import lagged_rows, slow_of_each_way
from identification.estimation.regression.motion_log import again, motion_log
from identification.log import Log
from identification.model.karnopp import Karnopp
from identification.model.plant import Plant
from identification.model.size import Size
from identification.model.surroundings import Surroundings
from identification.thresholds import BEYOND_CHANCE

UNTIL_ITS_ROW = -1.0  # samples, by which the motion follows a force that is constant until its row
LINEAR, ROTARY = tuple(range(6)), tuple(range(8))  # columns of the equation, with those of place
NO_LAG = np.zeros(1)


@dataclass(frozen=True, eq=False)
class _Fitted:
    """The logs without the force of place that the equation of motion shows, and its plant; slowest
    [m/s]: of the windows that count."""

    logs: tuple[MotionLog, ...]
    plant: Plant
    slowest: float


def whole_samples_late(logs: Sequence[Log], lag: float, *, rotary: bool) -> float | None:
    """By how many whole samples the motion follows a column of force [N] that is constant from each
    row to the next: 0 or -1 (until its row); None where the position measured while the body slides
    is not significantly likelier so than by a line through the samples.

    lag: in samples, at which such a line is tried too. Each with mass, friction and a force of
    place (spring, gravity) of its own equation of motion; what else acts is a latent force in all
    of them. Source: likelihood of the position, `latent_force`; the comparison is ours.
    """
    lines = tuple(dict.fromkeys([(0.0, False), (lag, False)]))
    tried = (*lines, (0.0, True), (UNTIL_ITS_ROW, True))
    fits = [one for at, held in tried if (one := _fitted(logs, at, held, rotary)) is not None]
    if len(fits) < len(tried):
        return None
    slowest = max(one.slowest for one in fits)
    likely = [latent_forces(one.plant, one.logs, slowest).log_likelihood for one in fits]
    if 2.0 * (max(likely) - max(likely[: len(lines)])) <= BEYOND_CHANCE**2:
        return None
    return tried[int(np.argmax(likely))][0]


def _fitted(logs: Sequence[Log], lag: float, held: bool, rotary: bool) -> _Fitted | None:
    """What the equation of motion says with the force so many samples later, held or a line through
    its samples; None where it shows no inertia."""
    late = Surroundings(Size(lag * logs[0].h), held=held)
    try:
        moved = [motion_log(late.of_one_instant(log), held=False, by_command=False) for log in logs]
    except UserError:
        return None
    found = lagged_rows(moved, NO_LAG, True, held)
    if found is None or inertia_has_no_part(moved):
        return None
    theta = found.left(found.every, ROTARY if rotary else LINEAR)[1][:, 0]
    m, F_cp, F_cn, F_vp, F_vn = np.maximum(theta[: len(FIVE)], 1e-9).tolist()
    freed = [again(one, _without_place(one.log, theta[len(FIVE) :])) for one in moved]
    plant = Plant(Karnopp(m, F_cp, F_cn, F_vp, F_vn, 0.0, 0.0, F_cp, -F_cn))
    return _Fitted(tuple(freed), plant, max(slow_of_each_way(moved)))


def _without_place(log: Log, sizes: Array) -> Log:
    """The log without a force of these sizes times y, and sin y and cos y."""
    y = np.asarray(log["y"])
    force = np.column_stack([y, np.sin(y), np.cos(y)])[:, : len(sizes)] @ sizes
    if log.held:
        force = 0.5 * (force + np.append(force[1:], force[-1:]))
    return log.with_signals(F=np.asarray(log["F"]) - force)
