"""Friction against velocity: what the samples of logs say of it, and its curve by a model."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from design.machine.model import Model, used
from design.measured.predict import of_one_instant
from identification.arrays import Array
from identification.effects._base import Acting
from identification.log import Log
from identification.model.estimates import NORMAL_95, Estimate, KarnoppFit
from identification.model.inverse_model import zoh_force
from identification.model.karnopp import Karnopp
from identification.model.resonance import load_acceleration
from identification.model.size import Size
from identification.model.surroundings import Surroundings
from identification.signals.differentiate import differentiate, low_pass
from identification.simulation.effect_along_motion import contribution

SLIDING_PARAMETERS = ("F_cp", "F_cn", "F_vp", "F_vn")
LOW_IN_BANDS, LOW_SHARE = 4.0, 0.25  # low speeds: in widths of the band, and of all speeds
UNSEEN_BAND = 1e-4  # of all speeds, up to which a band is not seen


def friction_samples(model: Model, log: Log) -> tuple[Array, Array]:
    """Velocity [m/s] and friction force F_e - m a [N] of a log, (n,), both smoothed alike.

    Of the instants at which the force acts, without the model's position-dependent forces (gravity,
    cogging, a spring), and of two masses with the second's own acceleration, so that what is left
    is friction alone.
    """
    late = sum(a.values["tau"] for a in model.acting if a.effect.place.delays)
    log = Surroundings(lag=Size(late)).of_one_instant(log) if late else of_one_instant(log, model)
    motion = differentiate(log["y"], log.h)
    F = zoh_force(log["F"]) if model.holds_force else log["F"]
    F = low_pass(F + _of_place(model, log), log.h, motion.cutoff)
    inner = slice(motion.edge, len(F) - motion.edge)
    left = F - _inertia(model, motion.a, log.h)
    return motion.v[inner], left[inner]


def _of_place(model: Model, log: Log) -> Array:
    """Force [N] of the effects that depend on the place alone, (n,)."""
    force = np.zeros(len(log))
    signals = {**dict.fromkeys("tvFud", force), "y": np.asarray(log["y"])}
    for one in model.acting:
        if one.effect.acts == "force" and set(one.effect.depends_on) <= {"y"}:
            force = force + contribution(one.effect, one.values, signals, log.h, model.karnopp)
    return force


def _inertia(model: Model, a: Array, h: float) -> Array:
    """Force [N] that accelerates the body, or both masses behind each other, (n,)."""
    if model.resonance is None:
        return model.karnopp.m * a
    found = {name: used(one) for name, one in model.resonance.items()}
    behind = load_acceleration(a, h, found["frequency"], found["anti_resonance"], found["damping"])
    return found["m_1"] * a + found["m_2"] * behind


def with_identified_limits(p: Karnopp, known: Mapping[str, Estimate]) -> Karnopp:
    """Friction as a curve shows it: a breakaway limit that the logs do not identify ends at the
    Coulomb level, whatever a run has made of it."""
    limits = {"F_sp": p.F_cp, "F_sn": -p.F_cn}
    return replace(p, **{n: level for n, level in limits.items() if known[n].value is None})


def low_speeds(p: Karnopp, reach: tuple[float, float]) -> tuple[float, float]:
    """The speeds [m/s] around the stick band, where friction bends; the slow ones where the band is
    too narrow to be seen."""
    band, most = max(p.dv_p, -p.dv_n), max(reach[1], -reach[0])
    low = LOW_SHARE * most
    low = min(LOW_IN_BANDS * band, low) if band > UNSEEN_BAND * most else low
    low = max(low, 1.5 * p.dv_p, -1.5 * p.dv_n)
    return -low, low


def branches(p: Karnopp, begin: float, end: float, points: int) -> tuple[Array, Array]:
    """Speeds of either direction outside the stick band [m/s]."""
    return np.linspace(begin, p.dv_n, points), np.linspace(p.dv_p, end, points)


def sliding_friction(v: Array, p: Karnopp, acting: Sequence[Acting]) -> Array:
    """Friction while sliding at `v` [m/s], (n,): Karnopp's and what effects of speed add [N]."""
    d, blank = np.sign(v), np.zeros(len(v))
    signals = {"t": blank, "y": blank, "F": blank, "u": blank, "v": v, "d": d}
    plain = np.where(v > 0, p.F_cp + p.F_vp * v, -p.F_cn + p.F_vn * v)
    more = [d * contribution(a.effect, a.values, signals, 1e-3, p) for a in acting]
    return np.asarray(plain + np.sum(more, axis=0)) if more else plain


def sliding_interval(
    fit: KarnoppFit, p: Karnopp, begin: float, end: float, points: int
) -> list[tuple[Array, Array, Array]]:
    """95 % interval of the sliding friction each way, by the covariance of its parameters: speeds
    [m/s], lower and upper end [N], all (points,)."""
    out, at = [], [fit.free.index(n) for n in SLIDING_PARAMETERS if n in fit.free]
    for v in branches(p, begin, end, points):
        up = 1.0 * (v > 0)
        change = dict(zip(SLIDING_PARAMETERS, (up, up - 1.0, up * v, (1.0 - up) * v), strict=True))
        J = np.array([change[fit.free[i]] for i in at])
        variance = np.einsum("in,ij,jn->n", J, fit.covariance[np.ix_(at, at)], J)
        half = NORMAL_95 * np.sqrt(np.maximum(variance, 0.0))
        middle = sliding_friction(v, p, ())
        out.append((v, middle - half, middle + half))
    return out
