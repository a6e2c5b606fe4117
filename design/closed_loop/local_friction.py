"""A model's friction as it is at one place, under one load or in one direction."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from design.closed_loop.driven_loop import chambers, in_the_loop
from design.machine.model import Model, used
from design.schedule import OVERS, Over
from identification.arrays import Array
from identification.effects._base import Acting
from identification.model.estimates import Estimate

CHANGES_FROM = 0.05  # of the friction, by which it has to change to ask for a schedule
LOOKED_AT_FOR_CHANGE = 100  # places or loads
LEAST_LEFT = 0.01  # of a friction, that is left where an effect takes it away
SIGNALS_OVER: Mapping[Over, frozenset[str]] = {
    "place": frozenset({"y"}),
    "load": frozenset({"F", "p_p", "p_n"}),
    "direction": frozenset(),
}


def asked_for(model: Model) -> tuple[Over, ...]:
    """Over what the model's friction changes, so that a schedule may pay."""
    return tuple(over for over in OVERS if change_over(model, over) > CHANGES_FROM)


def local(model: Model, over: Over, value: float) -> Model:
    """The model as it is at one point of a schedule: what changes over it is in its nine.

    Of a direction the viscous friction and Coulomb levels of that one stand for both.
    """
    mine = [one for one in in_the_loop(model) if _is_over(one, over)]
    nine = dict(model.friction)
    for name, way, slides in (("F_cp", 1.0, True), ("F_cn", -1.0, True), ("F_sp", 1.0, False),
                              ("F_sn", -1.0, False)):  # fmt: skip
        added = sum(_friction(model, one, over, value, way, slides) for one in mine)
        sign = -1.0 if name == "F_sn" else 1.0
        nine[name] = _moved(nine[name], sign * added)
    if over == "direction":
        mine_is, other = ("p", "n") if value >= 0.0 else ("n", "p")
        for kind in ("F_c", "F_v"):
            nine[kind + other] = nine[kind + mine_is]
    left = {
        key: values for key, values in model.effects.items() if key not in {o.key for o in mine}
    }
    return replace(model, friction=nine, effects=left)


def _is_over(one: Acting, over: Over) -> bool:
    """Whether an effect is friction without memory that changes with this alone."""
    effect = one.effect
    depends = set(effect.depends_on)
    return (
        effect.place.rubs and effect.evolve is None and bool(depends)
        and depends <= SIGNALS_OVER[over]
    )  # fmt: skip


def _friction(
    model: Model, one: Acting, over: Over, value: float, way: float, slides: bool
) -> float:
    """What an effect adds to friction in a direction, sliding or at rest, as a size [N]; of a load
    that pushes and one that pulls the mean."""
    p = model.karnopp
    c = p.F_cp if way > 0.0 else p.F_cn
    made = chambers(model.rig)
    f = 1.001 * c + 1e-9 if slides else c

    def of(y: float, F: float) -> float:
        s = [float(made[name](np.array(F))) for name in one.effect.signals]
        return float(one.effect.value(0.0, y, 0.0, F, 0.0, way, 0.0, c, f, s, one.p))

    if over == "place":
        return of(value, 0.0)
    return 0.5 * (of(0.0, value) + of(0.0, -value))


def _moved(one: Estimate, by: float) -> Estimate:
    """An estimate with a force added to it; no friction falls below a hundredth of it."""

    def put(value: float | None) -> float | None:
        if value is None:
            return None
        least = LEAST_LEFT * abs(value)
        return max(value + by, least) if value >= 0.0 else min(value + by, -least)

    return replace(
        one, value=put(one.value), low=put(one.low), high=put(one.high), assumed=put(one.assumed)
    )


def range_over(model: Model, over: Over) -> tuple[float, float]:
    """From where to where a schedule goes [m, N, -]: what the logs have shown."""
    if over == "place":
        return model.travel
    return (0.0, model.force_peak) if over == "load" else (-1.0, 1.0)


def levels_over(model: Model, over: Over) -> Callable[[Array], Array]:
    """What gives the mean Coulomb friction [N] at points of a schedule, (n,)."""

    def of(at: Array) -> Array:
        each = [local(model, over, value).karnopp for value in at.tolist()]
        return np.array([0.5 * (p.F_cp + p.F_cn) for p in each])

    return of


def change_over(model: Model, over: Over) -> float:
    """By which share the mean Coulomb friction changes over its range; of the direction viscous
    friction, by which the linear plant differs, and no more than its errors allow."""
    if over == "direction":
        one, other = model.friction["F_vp"], model.friction["F_vn"]
        unsure = 2.0 * float(np.hypot(one.sd or 0.0, other.sd or 0.0))
        a, b = used(one), used(other)
        return max(abs(a - b) - unsure, 0.0) / max(0.5 * (a + b), 1e-300)
    low, high = range_over(model, over)
    if not (high > low and any(_is_over(one, over) for one in in_the_loop(model))):
        return 0.0
    levels = levels_over(model, over)(np.linspace(low, high, LOOKED_AT_FOR_CHANGE))
    return float(np.ptp(levels) / max(float(np.mean(levels)), 1e-300))
