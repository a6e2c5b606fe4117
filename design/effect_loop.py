"""The sampled closed loop around a plant with effects: figures 5 and 10; figure 1, upper part.

As `design.loop`, but the controllers see the position that the transducer shows, and the command
passes dead zone and delay on its way to the actuator.
"""

from numpy.typing import ArrayLike

from design.loop import ForcePI, LoopNoise
from design.loop_signals import Signals
from design.rst import RST
from design.servo import Servo, ServoRun, simulate_servo
from identification.model.plant import Plant


def simulate_effect_loop(
    plant: Plant,
    controller: RST,
    force_controller: ForcePI | None,
    reference: ArrayLike,
    h: float,
    *,
    noise: LoopNoise | None = None,
    control_limit: float | None = None,
    start: tuple[float, float, float] = (0.0, 0.0, 0.0),
    signals: Signals | None = None,
) -> ServoRun:
    """`design.loop.simulate_loop` for a plant with effects; see `design.servo.simulate_servo`.

    controller.h may be a multiple of h. Raises BadModel where the parts do not fit together, or a
    needed signal is missing.
    """
    # In `simulate_loop` a motor's controller is told of a clipped command, another's is not.
    told = 0.0 if force_controller is None else None
    servo = Servo(controller, force_controller, control_limit=control_limit, anti_windup=told)
    return simulate_servo(plant, servo, reference, h, noise=noise, start=start, signals=signals)
