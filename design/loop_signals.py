"""Signals that a plant's effects use inside a simulated loop, and the delay of its command."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.effects._base import MAX_SIGNALS, Acting
from identification.errors import BadModel


@dataclass(frozen=True)
class OfForce:
    """A signal that the applied force implies: at_rest + per_force F, in the signal's unit.

    at_rest: a number, or (n,) where it changes along the run.
    """

    at_rest: float | Array
    per_force: float

    def __call__(self, F: Array) -> Array:
        """The signal under the force F [N], (n,)."""
        return self.at_rest + self.per_force * F


def pressures(area_p: float, area_n: float, mean: float, supply: float = 0.0) -> dict[str, OfForce]:
    """Chamber pressures p_p, p_n [Pa] that make the force, their mean constant (a four-way valve).

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


def command_delay(effects: tuple[Acting, ...]) -> float:
    """Delay of the command [s]."""
    for one in effects:
        if one.effect.place.delays:
            return float(one.effect.value(0, 0, 0, 0, 0, 1, 0, 0, 0, (0.0,) * MAX_SIGNALS, one.p))
    return 0.0


def effect_signals(effects: tuple[Acting, ...], signals: Signals, n: int) -> tuple[Array, Array]:
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
