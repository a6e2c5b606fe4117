"""Kernels of the servo compiled by a process of their own, while a first run has not come to them.

Numba compiles one kernel at a time in a process. A chain that identifies first and simulates a loop
last would compile for a minute on one core what another core could have ready by then.

    python -m workbench.steps.kernels_ahead
"""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np


def compile_servo() -> None:
    """A few samples of a servo without and with an effect, which leave its kernels in the cache."""
    from design.loop import ForcePI
    from design.pid import pd_to_rst
    from design.servo import Servo, simulate_servo
    from identification.effects._library import built_in
    from identification.model.karnopp import Karnopp
    from identification.model.plant import Actuator, Plant

    friction = Karnopp(1.0, 10.0, 10.0, 100.0, 100.0, 0.01, -0.01, 12.0, -12.0)
    effect = built_in()["stribeck"]
    acting = effect.acting({one.name: one.typical for one in effect.params})
    h = 1e-3
    servo = Servo(pd_to_rst(200.0, 0.1, 0.2, h), ForcePI(0.02, 0.05))
    for effects in ((), (acting,)):
        simulate_servo(Plant(friction, Actuator(1e4, 1e3), effects), servo, np.zeros(8), h)


def are_compiled() -> bool:
    """Whether the cache holds kernels of the servo."""
    from design.servo_loop import servo_kernel

    cache = Path(servo_kernel.stats.cache_path)  # type: ignore[attr-defined]
    return any(cache.glob("servo_loop.servo_kernel-*.nbi"))


@contextmanager
def servo_compiled_ahead() -> Iterator[None]:
    """Within the block another process compiles the kernels of the servo, if they are not yet."""
    if are_compiled():
        yield
        return
    command = [sys.executable, "-m", __spec__.name]
    ahead = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield
    finally:
        ahead.terminate()
        ahead.wait()


if __name__ == "__main__":
    compile_servo()
