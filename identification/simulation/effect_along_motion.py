"""What an effect would contribute along a measured motion: the regressor of its parameters."""

from collections.abc import Mapping

import numpy as np
from scipy.ndimage import uniform_filter1d

from identification.arrays import Array, IntArray, read_only
from identification.compiled import call_evolve, call_value, compiled
from identification.effects._base import MAX_PARAMS, Effect
from identification.model.karnopp import Karnopp
from identification.signals.sampling import samples
from identification.simulation.effect_table import EVOLVE, INITIAL, VALUE

SMOOTH = 8  # samples of 2 ms, over which the force on a bristle at rest is averaged, twice
BRISTLE_PIECES = 8  # of a sample, in which a bristle is followed


@compiled
def along_kernel(
    addresses: IntArray,
    q: Array,
    h: float,
    t: Array,
    y: Array,
    v: Array,
    F: Array,
    u: Array,
    d: IntArray,
    up: tuple[float, float, float],
    down: tuple[float, float, float],
    s: Array,
    out: Array,
) -> None:
    """`value` at every sample into out (n,); d 0 is a body at rest, in the last direction.

    up, down: level [N], viscous coefficient [N s/m] and stick limit [N] of either direction.
    """
    z, way = 0.0, 1.0
    for k in range(len(out)):
        if d[k] != 0:
            way = float(d[k])
        speed = v[k] if d[k] != 0 else 0.0
        s_k = s.ctypes.data + k * s.strides[0]
        c, viscous, _ = up if d[k] >= 0 else down
        f = c + viscous * abs(v[k])
        borne = f
        if d[k] == 0:
            borne = up[2] if F[k] >= 0.0 else down[2]
        now = t[k] - t[0]
        x = (now, y[k], speed, F[k], u[k], way, z, c, f)
        if k == 0 and addresses[INITIAL] != 0:
            z = call_value(addresses[INITIAL], x, s_k, q.ctypes.data)
        elif addresses[EVOLVE] != 0:
            step = (h, now, y[k], speed, F[k], u[k], float(d[k]), z, c, borne)
            z = call_evolve(addresses[EVOLVE], step, s_k, q.ctypes.data)
        x = (now, y[k], speed, F[k], u[k], way, z, c, f)
        out[k] = call_value(addresses[VALUE], x, s_k, q.ctypes.data)


def contribution(
    effect: Effect, values: Mapping[str, float], signals: Mapping[str, Array], h: float,
    friction: Karnopp,
) -> Array:  # fmt: skip
    """`value` of an effect along a motion, (n,), in the unit of what it gives.

    signals: t, y, v, F, u, d (direction, 0 at rest) and those that the effect uses, (n,) each;
    those that it may miss read as 0. friction: for the levels c and f. What acts on the command
    has the command's direction, as in a run (`acting_command`).
    """
    n = len(signals["t"])
    q = np.zeros(MAX_PARAMS)
    for i, p in enumerate(effect.params):
        q[i] = values.get(p.name, p.default if p.default is not None else 0.0)
    way = np.where(signals["u"] >= 0.0, 1, -1) if effect.place.on_command else signals["d"]
    d = way.astype(np.int64, copy=False)
    up = friction.F_cp, friction.F_vp, friction.F_sp
    down = friction.F_cn, friction.F_vn, -friction.F_sn
    s = np.zeros((n, max(1, len(effect.signals))))
    for j, name in enumerate(effect.signals):
        if name in signals:
            s[:, j] = signals[name]
    out = np.empty(n)
    t, y, v, F, u = (read_only(np.ascontiguousarray(signals[k])) for k in ("t", "y", "v", "F", "u"))
    addresses = np.array(effect.addresses, dtype=np.int64)
    along_kernel(addresses, q, h, t, y, v, F, u, d, up, down, s, out)
    return out


@compiled
def bristle_kernel(
    addresses: IntArray, q: Array, h: float, t: Array, y: Array, v: Array, F: Array, u: Array,
    c: Array, s: Array, count: int, out: Array,
) -> None:  # fmt: skip
    """Elastic friction z of a bristle along a motion into out (n,), from rest at 0."""
    z = 0.0
    dt = h / count
    for k in range(len(out)):
        out[k] = z
        following = min(k + 1, len(out) - 1)
        for j in range(count):
            speed = v[k] + (v[following] - v[k]) * (j + 0.5) / count
            way = 1.0 if speed >= 0.0 else -1.0
            x = (t[k], y[k], speed, F[k], u[k], way, z, c[k], c[k])
            slope = call_value(addresses[VALUE], x, s[k].ctypes.data, q.ctypes.data)
            z = min(max(z + slope * speed * dt, -c[k]), c[k])


def elastic_share(
    effect: Effect, values: Mapping[str, float], signals: Mapping[str, Array], h: float,
    friction: Karnopp,
) -> Array:  # fmt: skip
    """Elastic friction of a bristle over the Coulomb level along a motion, (n,), in [-1, 1]."""
    q = np.zeros(MAX_PARAMS)
    for i, p in enumerate(effect.params):
        q[i] = values.get(p.name, p.default if p.default is not None else 0.0)
    c = np.where(signals["v"] >= 0, friction.F_cp, friction.F_cn)
    out = np.empty(len(c))
    y, v, F, u = (read_only(np.ascontiguousarray(signals[k])) for k in ("y", "v", "F", "u"))
    addresses = np.array(effect.addresses, dtype=np.int64)
    t, s = signals["t"] - signals["t"][0], np.zeros((len(c), 1))
    bristle_kernel(addresses, q, h, t, y, v, F, u, c, s, BRISTLE_PIECES, out)
    return np.asarray(out / np.maximum(c, 1e-300))


@compiled
def displacement_kernel(
    addresses: IntArray, q: Array, t: Array, y: Array, F: Array, c_p: float, c_n: float, s: Array,
    out: Array,
) -> None:  # fmt: skip
    """Elastic displacement under a slowly changing force F into out (n,): dx = dF/slope."""
    x_now, z = 0.0, 0.0
    for k in range(len(out)):
        to = min(max(F[k], -0.98 * c_n), 0.98 * c_p)
        way = 1.0 if to >= z else -1.0
        c = c_p if way > 0.0 else c_n
        x = (t[k], y[k], 0.0, F[k], 0.0, way, 0.5 * (z + to), c, c)
        slope = call_value(addresses[VALUE], x, s[k].ctypes.data, q.ctypes.data)
        x_now += (to - z) / slope
        z = to
        out[k] = x_now


def elastic_displacement(
    effect: Effect, values: Mapping[str, float], signals: Mapping[str, Array], h: float,
    friction: Karnopp,
) -> Array:  # fmt: skip
    """What a bristle gives way under the applied force [m], (n,), but for its sliding.

    The force is smoothed as a body's inertia does: along its raw noise the bristle, softer in
    loading than in unloading, would creep.
    """
    q = np.zeros(MAX_PARAMS)
    for i, p in enumerate(effect.params):
        q[i] = values.get(p.name, p.default if p.default is not None else 0.0)
    width = samples(SMOOTH, h)
    smoothed = uniform_filter1d(uniform_filter1d(signals["F"], width), width)
    out = np.empty(len(signals["t"]))
    displacement_kernel(
        np.array(effect.addresses, dtype=np.int64), q, signals["t"] - signals["t"][0],
        np.ascontiguousarray(signals["y"]), smoothed,
        friction.F_cp * 1.3, friction.F_cn * 1.3, np.zeros((len(out), 1)), out,
    )  # fmt: skip
    return out
