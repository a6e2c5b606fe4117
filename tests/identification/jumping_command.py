"""A cart whose command jumps every few rows, logged at 50 Hz for five seconds, as students' are."""

import numpy as np

from identification.log import Log

H = 0.02  # s between the rows
STEPS = 40  # of the body in a row
MASS, COULOMB, VISCOUS = 0.78, 0.25, 10.3
COUNT = 8.4e-5  # m
ROWS = 256


def cart_log(seed: int, late: int) -> Log:
    """Pulses, and between them a loop that brings the cart back; late: rows until they act.

    seed: of the pulses; no noise but the position's rounding.
    """
    rng = np.random.default_rng(seed)
    y = v = amplitude = 0.0
    left, pulse = 0, False
    places, commands = [0.0], []
    waiting = [0.0] * late
    for row in range(ROWS):
        place = round(y / COUNT) * COUNT
        places.append(place)
        if left <= 0:
            pulse = not pulse
            left = int(rng.integers(5, 9) if pulse else rng.integers(12, 28))
            amplitude = float(rng.choice([-1, 1]) * rng.choice([2.9, 4.0, 8.3, 9.0]))
        left -= 1
        speed = (place - places[-2]) / H if row else 0.0
        back = float(np.clip(-30.0 * (place + 0.03) - 9.0 * speed, -8.0, 8.0))
        commands.append(amplitude if pulse else back)
        waiting.append(commands[-1])
        force = waiting.pop(0)
        for _ in range(STEPS):
            y, v = _moved(y, v, force, H / STEPS)
    t = np.asarray(np.arange(ROWS) * H, dtype=np.float64)
    u = np.asarray(commands)
    return Log("cart", {"t": t, "y": np.asarray(places[1:]), "u": u, "F": u.copy()})


def _moved(y: float, v: float, force: float, h: float) -> tuple[float, float]:
    """Place and speed after h seconds."""
    if v == 0.0 and abs(force) <= COULOMB:
        return y, v
    rubs = COULOMB * np.sign(v if v else force) + VISCOUS * v
    after = v + h * (force - rubs) / MASS
    after = 0.0 if v * after < 0.0 else after
    return y + h * after, after
