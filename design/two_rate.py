"""The loop of figure 5 with its position controller run once in `ratio` samples of the force loop.

A force loop at the logger's rate hides the actuator from a position controller at 10 ms; at one
rate either the force loop is too slow or the position controller's poles crowd at z = 1.
"""

from numpy.typing import ArrayLike

from design.loop import ForcePI, LoopNoise, LoopRun, one_run, prepared_loop
from design.rst import RST
from identification.errors import BadModel
from identification.model.plant import Plant


def simulate_two_rate(
    plant: Plant,
    controller: RST,
    force_controller: ForcePI,
    reference: ArrayLike,
    h: float,
    *,
    noise: LoopNoise | None = None,
    control_limit: float | None = None,
    y_0: float = 0.0,
) -> LoopRun:
    """The loop of a plant with an Actuator, from rest at y_0 [m]; see `loop.simulate_loop`.

    h [s]: of the force loop, `reference` and `noise`; controller.h is a multiple of it. Raises
    BadModel where it is not, or where the parts do not fit together.
    """
    ratio = round(controller.h / h)
    if ratio < 1 or abs(ratio * h - controller.h) > 1e-6 * h:
        raise BadModel(
            f"position loop every {controller.h:g} s, force loop every {h:g} s: the first must be"
            " a multiple of the second"
        )
    start = (y_0, 0.0, 0.0)
    loop, p = prepared_loop(
        [plant], controller, force_controller, reference, h, noise, control_limit, start, ratio
    )
    return one_run(loop, p, h)
