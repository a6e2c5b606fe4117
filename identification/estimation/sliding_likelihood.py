"""How likely the position is that was measured while the body slides, of variants of its log: with
the force at other instants, or other between its samples.

Each variant with mass, friction and a force of place (spring, gravity) of its own equation of
motion; what else acts is a latent force in all of them. Source: the chain of `latent_force`; the
comparison is ours.
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

# Columns of the equation with those of place, by whether it is of a rotary machine.
WITH_PLACE = {False: tuple(range(6)), True: tuple(range(8))}
NO_LAG = np.zeros(1)


@dataclass(frozen=True, eq=False)
class _Fitted:
    """The logs without the force of place that the equation of motion shows, and its plant; slowest
    [m/s]: of the windows that count."""

    logs: tuple[MotionLog, ...]
    plant: Plant
    slowest: float


def sliding_likelihoods(variants: Sequence[Sequence[Log]], *, rotary: bool) -> Array | None:
    """Logarithm of the likelihood [nats] of every variant (v,), over the same samples; None where
    one of them shows no inertia, or too little slides. Each log says whether its measured force is
    held. Source: as of the module.
    """
    fits = [one for logs in variants if (one := _fitted(logs, rotary)) is not None]
    if len(fits) < len(variants):
        return None
    slowest = max(one.slowest for one in fits)
    return np.array([latent_forces(one.plant, one.logs, slowest).log_likelihood for one in fits])


def _fitted(logs: Sequence[Log], rotary: bool) -> _Fitted | None:
    """What the equation of motion says of logs; None where it shows no inertia."""
    try:
        moved = [motion_log(log, zoh=False, by_command=False) for log in logs]
    except UserError:
        return None
    found = lagged_rows(moved, NO_LAG, True, logs[0].zoh)
    if found is None or inertia_has_no_part(moved):
        return None
    theta = found.left(found.every, WITH_PLACE[rotary])[1][:, 0]
    m, F_cp, F_cn, F_vp, F_vn = np.maximum(theta[: len(FIVE)], 1e-9).tolist()
    freed = [again(one, _without_place(one, theta[len(FIVE) :])) for one in moved]
    plant = Plant(Karnopp(m, F_cp, F_cn, F_vp, F_vn, 0.0, 0.0, F_cp, -F_cn))
    return _Fitted(tuple(freed), plant, max(slow_of_each_way(moved)))


def _without_place(one: MotionLog, sizes: Array) -> Log:
    """The log without a force of these sizes times y, and sin y and cos y."""
    y = np.asarray(one.log["y"])
    force = np.column_stack([y, np.sin(y), np.cos(y)])[:, : len(sizes)] @ sizes
    if one.zoh:
        force = 0.5 * (force + np.append(force[1:], force[-1:]))
    return one.log.with_signals(F=np.asarray(one.log["F"]) - force)
