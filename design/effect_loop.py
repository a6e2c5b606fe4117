"""The sampled closed loop around a plant with effects: figures 5 and 10; figure 1, upper part.

As `design.loop`, but the controllers see the position that the transducer shows, and the command
passes dead zone and delay on its way to the actuator.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from design.loop import ForcePI, LoopNoise, LoopRun, prepared_loop
from design.loop_kernels import force_command, shift
from design.rst import RST
from identification.arrays import Array, IntArray
from identification.compiled import compiled
from identification.effect_run import place_of
from identification.effect_step import (
    ACTUATOR,
    BRISTLE,
    acting_command,
    delayed,
    effect_step,
    effect_table,
    pieces,
    shown_position,
    start_states,
)
from identification.effects._base import MAX_SIGNALS, Acting
from identification.errors import BadModel
from identification.plant import Plant
from identification.stepping import K1, STUCK, parameters, settled_mode

Number = TypeVar("Number", float, Array)


@dataclass(frozen=True)
class OfForce:
    """A signal that the applied force implies: at_rest + per_force F, in the signal's unit."""

    at_rest: float
    per_force: float

    def __call__(self, F: Number) -> Number:
        """The signal under the force F [N]."""
        return self.at_rest + self.per_force * F


def pressures(area_p: float, area_n: float, mean: float, supply: float = 0.0) -> dict[str, OfForce]:
    """Chamber pressures p_p, p_n [Pa] that make the force, their mean held (a four-way valve).

    area_p, area_n [m^2], mean pressure and supply [Pa] of F = S_p p_p - S_n p_n - (S_p - S_n)
    supply, which is how a log's force is made from its pressures. Raises BadModel where an area
    or the mean is not positive.
    """
    if not (area_p > 0 and area_n > 0 and mean > 0):
        raise BadModel(f"areas {area_p:g}, {area_n:g} m^2, mean pressure {mean:g} Pa: must be > 0")
    half, offset = 1.0 / (area_p + area_n), (area_p - area_n) * (mean - supply)
    return {
        "p_p": OfForce(mean - half * offset, half),
        "p_n": OfForce(mean + half * offset, -half),
    }


Signals = Mapping[str, Array | OfForce]


@compiled
def effect_loop_kernel(
    p: Array,
    h: float,
    ratio: int,
    count: int,
    codes: IntArray,
    addresses: IntArray,
    q: Array,
    base: Array,
    gain: Array,
    history: Array,
    late: float,
    motor: bool,
    feed: Array,
    R: Array,
    S: Array,
    x: Array,
    pi: tuple[float, float],
    limit: float,
    noise_y: Array,
    noise_f: Array,
    start: tuple[float, float, float],
    out: Array,
    modes: IntArray,
) -> None:
    """One plant p (1, 11) with effects in its loop: out (5, n) takes y, v, F, u, position measured.

    As `loop_kernel` and `motor_kernel`; codes (k,), addresses (k, 3), q (k, P): the effects;
    signals base (k, n, S) + gain (k, S) F; history: the command after the dead zone, preceded by
    what it was before the start; late: delay in samples; ratio: samples of the force loop in one
    of the position controller, feed (ceil(n/ratio),).
    """
    plant = parameters(p, 0)
    (k_p, k_int), k1 = pi, plant[K1]
    y, v, F = start
    z, past = np.zeros(len(codes)), len(history) - len(modes)
    bristle = place_of(codes, BRISTLE)
    mode = STUCK if motor and v == 0.0 else settled_mode(plant, v, F)
    a, u, integral, wanted = 0.0, 0.0, 0.0, 0.0
    for k in range(len(modes)):
        now, s = k * h, base[:, k] + gain * F
        if k == 0:
            start_states(codes, addresses, q, s, z, plant, now, y, v, F, u, False)
        shown = shown_position(h, codes, addresses, q, s, z, plant, now, y, v, F, u)
        measured = shown + noise_y[k]
        acts = k % ratio == 0
        if acts:
            wanted = feed[k // ratio] - R[0] * measured + x[0]
        if motor:
            u = min(max(wanted, -limit), limit)
            shift(x, R, S, measured, u)
        else:
            felt = F + noise_f[k]
            u, integral = force_command(wanted, felt, integral, k_p, k_int, limit)
            if acts:
                shift(x, R, S, measured, wanted)
        history[past + k] = acting_command(codes, addresses, q, s, z, now, u)
        g = k1 * delayed(history, past + k, late)
        if motor:
            F, g = g, 0.0
            s = base[:, k] + gain * F
        out[0, k], out[1, k], out[2, k], out[3, k], out[4, k] = y, v, F, u, measured
        state = effect_step(
            plant, count, codes, addresses, q, s, z, bristle, now, (y, v, F, mode, a), u, g, h
        )
        # A body at rest that the new force moves has left at once.
        modes[k] = mode if v == 0.0 or mode != STUCK else state[3]
        y, v, F, mode, a = state


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
) -> LoopRun:
    """`design.loop.simulate_loop` for a plant with effects; controller.h may be a multiple of h.

    signals: those that the effects use, by name, each (n,) or `OfForce`, of the plant's own force
    at the sample's start (`pressures`). The run's y is the body's position, y_measured what the
    transducer shows of it plus noise. Time counts from the start; before it no command was given.
    Raises BadModel where the parts do not fit together, or a needed signal is missing.
    """
    ratio = max(1, round(controller.h / h)) if force_controller else 1
    loop, p = prepared_loop(
        [plant], controller, force_controller, reference, h, noise, control_limit, start, ratio
    )
    n, table = len(loop.reference), effect_table(plant.effects)
    codes = table.codes
    if loop.motor:  # its force follows the command: nothing leaks
        codes = np.where(codes == ACTUATOR, -1, codes)
    base, gain = _signals(plant.effects, signals or {}, n)
    late = _delay(plant.effects) / h
    out, modes = np.empty((5, n)), np.empty(n, dtype=np.int64)
    y_noise, f_noise = (np.ascontiguousarray(one[:, 0]) for one in (loop.noise.y, loop.noise.F))
    effect_loop_kernel(
        p, h, ratio, pieces(table, h), codes, table.addresses, table.p, base, gain,
        np.zeros(n + math.ceil(late) + 1), late, loop.motor, loop.feed, loop.R, loop.S,
        loop.x.copy(), loop.pi, loop.limit, y_noise, f_noise, loop.start, out, modes,
    )  # fmt: skip
    y, v, F, u, measured = out
    if not np.all(np.isfinite(y)):
        raise BadModel(
            f"the loop cannot be followed beyond t = {h * int(np.argmin(np.isfinite(y))):g} s;"
            " check the controller's gains and the effects' parameters"
        )
    t = h * np.arange(n, dtype=np.float64)
    return LoopRun(t, loop.reference, y, v, F, measured, F + f_noise, u, modes)


def _delay(effects: tuple[Acting, ...]) -> float:
    """Delay of the command [s]."""
    for one in effects:
        if one.effect.acts == "delay":
            return float(one.effect.value(0, 0, 0, 0, 0, 1, 0, 0, 0, (0.0,) * MAX_SIGNALS, one.p))
    return 0.0


def _signals(effects: tuple[Acting, ...], signals: Signals, n: int) -> tuple[Array, Array]:
    """What does not depend on the force (k, n, MAX_SIGNALS), and what each gains with it."""
    base, gain = np.zeros((len(effects), n, MAX_SIGNALS)), np.zeros((len(effects), MAX_SIGNALS))
    for i, one in enumerate(effects):
        if one.effect.signals and not any(name in signals for name in one.effect.signals):
            raise BadModel(
                f"effect {one.key!r} needs a signal {' or '.join(one.effect.signals)}; give it in"
                " `signals` (chamber pressures: `pressures`)"
            )
        for j, name in enumerate(one.effect.signals):
            given = signals.get(name)
            if isinstance(given, OfForce):
                base[i, :, j], gain[i, j] = given.at_rest, given.per_force
            elif given is not None:
                if np.shape(given) != (n,):
                    raise BadModel(f"signal {name}: shape {np.shape(given)}, need ({n},)")
                base[i, :, j] = given
            elif name in one.effect.needs:
                raise BadModel(
                    f"effect {one.key!r} needs the signal {name!r}; give it in `signals`"
                    " (chamber pressures: `pressures`)"
                )
    return base, gain
