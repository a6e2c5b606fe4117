"""The loop of figure 5 with its position controller run once in `ratio` samples of the force loop.

A force loop at the logger's rate hides the actuator from a position controller at 10 ms; at one
rate either the force loop is too slow or the position controller's poles crowd at z = 1.
"""

from numpy.typing import ArrayLike

from design.loop import Cascade, LoopNoise, LoopRun, one_run, prepared_loop
from identification.errors import BadModel
from identification.model.plant import Plant


def simulate_two_rate(
    plant: Plant,
    cascade: Cascade,
    reference: ArrayLike,
    h: float,
    *,
    noise: LoopNoise | None = None,
    y_0: float = 0.0,
) -> LoopRun:
    """The loop of a plant with an Actuator, from rest at y_0 [m]; see `loop.simulate_loop`.

    h [s]: of the force loop, `reference` and `noise`; cascade.position.h is a multiple of it.
    Raises BadModel where it is not, or where the parts do not fit together.
    """
    slow = cascade.position.h
    ratio = round(slow / h)
    if ratio < 1 or abs(ratio * h - slow) > 1e-6 * h:
        raise BadModel(
            f"position loop every {slow:g} s, force loop every {h:g} s: the first must be"
            " a multiple of the second"
        )
    loop, p = prepared_loop([plant], cascade, reference, h, noise, (y_0, 0.0, 0.0), ratio)
    return one_run(loop, p, h)
