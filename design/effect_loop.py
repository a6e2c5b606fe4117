"""The sampled closed loop around a plant with effects: figures 5 and 10; figure 1, upper part.

As `design.loop`, but the controllers see the position that the transducer shows, and the command
passes dead zone and delay on its way to the actuator.
"""

from numpy.typing import ArrayLike

from design.loop import Cascade, LoopNoise
from design.loop_signals import Signals
from design.servo import Countermeasure, Servo, ServoRun, simulate_servo
from identification.model.plant import Plant


def simulate_effect_loop(
    plant: Plant,
    cascade: Cascade,
    reference: ArrayLike,
    h: float,
    *,
    noise: LoopNoise | None = None,
    start: tuple[float, float, float] = (0.0, 0.0, 0.0),
    signals: Signals | None = None,
    friction: Countermeasure | None = None,
) -> ServoRun:
    """`design.loop.simulate_loop` for a plant with effects, or with a friction countermeasure in
    the loop; see `design.servo.simulate_servo`.

    cascade.position.h may be a multiple of h. Raises BadModel where the parts do not fit together,
    or a needed signal is missing.
    """
    # In `simulate_loop` a motor's controller knows of a clipped command, another's is not.
    tracking_time = 0.0 if cascade.force is None else None
    limit = cascade.control_limit
    servo = Servo(
        cascade.position, cascade.force, friction, control_limit=limit, anti_windup=tracking_time
    )
    return simulate_servo(plant, servo, reference, h, noise=noise, start=start, signals=signals)
