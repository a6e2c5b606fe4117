"""A servo in a loop on three sines, logged at rows that come as a slow or busy logger has them."""

import numpy as np

from identification.arrays import Array
from identification.log import Log

MASS, COULOMB, VISCOUS, STICK = 0.002, 0.05, 0.01, 0.06  # kg m^2, N m, N m s/rad, N m
FREQUENCIES = (0.3, 0.77, 1.31)  # Hz, of the reference, which goes up to 10 rad
STEP = 5e-4  # s, of the body and of a loop that is faster than its log
NOISE = 1e-5  # rad


def servo_log(between: Array, *, zoh: bool, seed: int = 0) -> Log:
    """The servo's rows, so many seconds between them (n,); held: whether its loop gives a force at
    each row, to the next, or all the time."""
    rng, clock = np.random.default_rng(seed), np.concatenate([[0.0], np.cumsum(between)[:-1]])
    y = v = 0.0
    places, forces = list[float](), list[float]()
    for start, length in zip(clock, between, strict=True):
        force = _asked(start, y, v)
        places.append(y)
        forces.append(force)
        steps = max(1, round(float(length) / STEP))
        for k in range(steps):
            at = start + k * length / steps
            y, v = _moved(y, v, force if zoh else _asked(at, y, v), length / steps)
    F = np.asarray(forces)
    noise = NOISE * rng.standard_normal(len(F))
    return Log("servo", {"t": clock, "y": np.asarray(places) + noise, "u": F, "F": F.copy()})


def _asked(t: float, y: float, v: float) -> float:
    """The loop's force."""
    wanted = sum(np.sin(2.0 * np.pi * f * t + k) for k, f in enumerate(FREQUENCIES))
    return 2.0 * (3.4 * float(wanted) - y) - 0.1 * v


def _moved(y: float, v: float, force: float, h: float) -> tuple[float, float]:
    """Place and speed after h seconds."""
    if abs(v) < 1e-4 and abs(force) <= STICK:
        return y, 0.0
    way = np.sign(v) if v else np.sign(force)
    after = v + h * (force - way * COULOMB - VISCOUS * v) / MASS
    after = 0.0 if v * after < 0.0 and abs(force) <= STICK else after
    return y + 0.5 * h * (v + after), float(after)
