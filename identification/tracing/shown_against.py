"""Against which signal what a trace leaves is shown: each effect by its own, the rest by what it
depends on."""

from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.effects._base import Acting, Effect
from identification.model.karnopp import Karnopp
from identification.tracing.residual_rows import (
    effect_at_rows,
    folded_at,
    in_equation,
    shown_residuals,
    signal_of,
)
from identification.tracing.result import Residual, Trace

LEVELS = 30  # of a signal, over which the running median is taken
A_PERIOD = 12  # levels at least, of an effect that repeats


@dataclass(frozen=True, eq=False)
class Picture:
    """A residual, the signal against which it is drawn, and the effect that it is to show.

    without: the residual of the model without this effect, (r,), and `how` it is called; curve:
    what the effect takes away, (r,), where it depends on this signal only; period: over which the
    effect repeats, in the signal's unit, None where it does not.
    """

    residual: Residual
    signal: str
    effect: Effect | None
    without: Array
    how: str
    curve: Array | None
    period: float | None = None

    @property
    def place(self) -> tuple[str, str]:
        """The equation and the signal of which it is."""
        return self.residual.equation, self.signal

    @property
    def levels(self) -> int:
        """Of the signal, over which running medians are taken: enough for what repeats."""
        if self.period is None:
            return LEVELS
        travel = float(np.ptp(self.residual.signals[self.signal]))
        return max(LEVELS, min(round(A_PERIOD * travel / self.period), len(self.residual.t) // 8))


def pictures(found: Trace) -> list[Picture]:
    """What to draw: each effect against its signal, and what is left against those unexplained."""
    residuals = {r.equation: r for r in shown_residuals(found)}
    out: list[Picture] = []
    for e in found.effects:
        equation = in_equation(e.effect)
        residual = residuals.get(equation) if equation else None
        if residual is None:
            continue
        others = [o for o in found.effects if in_equation(o.effect) == equation]
        acting = next(a for a in found.plant.effects if a.key == e.effect.key)
        out.append(_of_effect(acting, residual, found.plant.friction, len(others) == 1))
    rest = _unexplained(found)
    if rest is not None and all(one.place != rest.place for one in out):
        out.append(rest)
    # One picture of each residual and signal.
    return list({one.place: one for one in reversed(out)}.values())[::-1]


def _of_effect(acting: Acting, residual: Residual, p: Karnopp, alone: bool) -> Picture:
    """The picture of one effect; not alone in its equation, it is taken out by its own equation."""
    effect = acting.effect
    signal = signal_of(effect, residual)
    taken, how = residual.before - residual.after, "before"
    if not alone:
        own = effect_at_rows(acting, residual, p)
        if own is not None:
            taken, how = own, f"without {effect.key.replace('_', ' ')}"
    single = len(effect.depends_on) == 1 and (alone or how != "before")
    repeats = effect.named("period") if signal == "y" else None
    period = None if repeats is None else acting.values[repeats]
    curve = taken if single else None
    return Picture(residual, signal, effect, residual.after + taken, how, curve, period)


def _unexplained(found: Trace) -> Picture | None:
    """What no effect explains, or (where there is no effect) the residual that is largest."""
    wanted, residuals = found.unknown.depends_on, shown_residuals(found)
    if not residuals or (found.effects and not wanted):
        return None
    having = [r for r in residuals if set(wanted) & set(r.signals)]
    # By what is left in units of its noise (of a smoothed force: of its own deviation).
    residual = max(
        having or residuals,
        key=lambda one: float(np.median(np.abs(one.after) / np.maximum(one.noise, 1e-300))),
    )
    if found.unknown.swing > 0.0 and "t" in residual.signals:
        folded = folded_at(residual, found.unknown.swing)
        return Picture(folded, "phase", None, folded.before, "before", None)
    named = [name for name in (*wanted, "v", "y", *residual.signals) if name in residual.signals]
    return Picture(residual, named[0], None, residual.before, "before", None) if named else None
