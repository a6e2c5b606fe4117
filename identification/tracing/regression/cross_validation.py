"""What an equation leaves of logs that are left out of its fit."""

import numpy as np

from identification.estimation.regression.effect_rows import EffectRows
from identification.estimation.regression.equation_rows import MECHANICAL
from identification.estimation.regression.weighted_rows import solve_rows, stacked


def left_out_error(stage: EffectRows, slowest: float) -> float:
    """Root mean square of the mechanical equation [N] on each log, fitted on all others.

    Source: cross-validation, Stone (1974). Runs of one file, cut at its gaps, are left out together
    where there are more files. 0 where there is one log only.
    """
    parts = stage.parts[MECHANICAL]
    if len(parts) < 2:
        return 0.0
    rows = stacked(parts)
    names, of_part = np.unique([one.log.name for one in stage.logs], return_inverse=True)
    of_part = of_part if len(names) > 1 else np.arange(len(parts))
    of_log = np.repeat(of_part, [len(p.b) for p in parts])
    keep = rows.speed >= slowest
    r = np.zeros(len(rows.b))
    for i in range(int(of_part.max()) + 1):
        out = of_log == i
        theta = solve_rows(rows, keep & ~out).theta
        r[out] = rows.b[out] - rows.X[out] @ theta
    return float(np.sqrt(np.mean(r[keep] ** 2)))
