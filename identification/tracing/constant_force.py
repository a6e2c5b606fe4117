"""A constant force that is larger than friction: unequal levels of friction cannot take it up."""

from collections.abc import Sequence

import numpy as np

from identification.arrays import Array
from identification.errors import UserError
from identification.estimation.regression.equation_rows import motion_log
from identification.estimation.regression.row_fit import first_stage
from identification.log import Log

BELOW = 0.05  # of the larger Coulomb level, by which the other has to be negative


def beyond_friction(theta: Array) -> float | None:
    """Force towards +y [N] that is always there, by a regression's m, F_cp, F_cn, F_vp, F_vn (5,).

    None where both Coulomb levels can hold what there is of it.
    """
    up, down = float(theta[1]), float(theta[2])
    if min(up, down) >= -BELOW * max(abs(up), abs(down)):
        return None
    return 0.5 * (down - up)


def constant_force(logs: Sequence[Log], *, held: bool) -> float | None:
    """The same of logs with y [m] and F [N]; None too where too little of their motion slides.

    held: the force is a command held over each period.
    """
    try:
        stage, _ = first_stage(
            [motion_log(log, held=held, by_command=False) for log in logs], by_command=False
        )
    except (UserError, np.linalg.LinAlgError):
        return None
    return beyond_friction(stage.theta)


def constant_remark(force: float, unit: str) -> str:
    """What a user can do about it."""
    return (
        f"a constant force of about {force:.3g} {unit} acts beside the applied one and is larger"
        " than friction (a weight, a tilt, a sensor's offset, a wrong area or supply pressure);"
        " unequal F_cp and F_cn cannot take it up: take it out with the offset of a signal in the"
        " card"
    )
