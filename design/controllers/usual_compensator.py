"""The friction compensator beside a design's controllers, where nobody has searched for a better.

A loop without an integrator is given the whole friction, as in the paper. An integrator holds the
sliding friction already: given it once more at each breakaway its loop leaps, and hunts at rest. So
beside one only what breakaway needs beyond sliding is added, within the stick band.
"""

from collections.abc import Iterable

import numpy as np

from design.filters import filters_at, quick_filters
from design.machine.compensator import CompensatorValues, FiltersAt
from design.machine.design import Controller
from design.machine.model import Model
from design.tracking import integrates

N_C = 2.0  # the paper's, in simulation and on the rig
E_T_PER_TRAVEL = 0.03  # the paper's 3 mm on steps of 0.1 m
# N_c of one that gives the excess alone, and its e_T in the position's noise.
EXCESS_N_C = 1.05
USUAL_EXCESS = 20.0


def usual_compensator(model: Model, h: float, beside: Iterable[Controller]) -> CompensatorValues:
    """The compensator every h [s] that suits all of these controllers."""
    if any(integrates(np.ones(1), one.rst) for one in beside):
        return excess_compensator(model, h)
    return whole_compensator(model, h)


def whole_compensator(model: Model, h: float) -> CompensatorValues:
    """The paper's, which gives the whole friction, every h [s]. Source: paper, eqs. (2)-(4)."""
    low, high = model.travel
    e_T = E_T_PER_TRAVEL * (high - low)
    return CompensatorValues(N_C, e_T, model.friction, FiltersAt.of(filters_at(h), h))


def excess_compensator(model: Model, h: float, many: float = USUAL_EXCESS) -> CompensatorValues:
    """The excess of breakaway over sliding alone, in full at `many` times the position's noise,
    every h [s]; of a model without noise at the error of the whole one. Source: our own."""
    whole, noise = whole_compensator(model, h), model.fit.noise_y
    p = whole.value.friction
    filters = FiltersAt.of(quick_filters(h, noise, min(p.dv_p, -p.dv_n)), h)
    e_T = many * noise if noise > 0.0 else whole.e_T
    return CompensatorValues(EXCESS_N_C, e_T, model.friction, filters, excess=True)
