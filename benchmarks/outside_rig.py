"""Machines of `outside`: plain Euler steps and effects written apart from the package's."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from identification.arrays import Array
from identification.compiled import compiled

EULER = 2e-5  # s
REACH, SPEED = 0.06, 0.1  # m, m/s, at which sizes are given
AREA_P, AREA_N, SUPPLY, MEAN, K_A = 12.6e-4, 10e-4, 6e5, 3e5, 20.0
REFERENCES = ("steps", "multisine", "triangle")
# Sizes of the effects, in the order in which `run` takes them; all of them 0 in a plain machine.
SIZES = (
    "play", "late", "dead", "leak", "k", "k_cube", "ripple", "pitch", "warm", "warm_time", "along",
    "by_load", "slow", "slow_speed", "square", "grown", "grown_time", "shake", "rate", "jump",
    "ramp", "curve", "thick", "elastic", "way", "worn", "ledge",
    "slow_tustin", "grown_rational", "harmonic", "spot", "worn_in",
)  # fmt: skip
LENGTHS = {"pitch": 0.012, "warm_time": 15.0, "slow_speed": 0.02, "grown_time": 1.0, "rate": 1.3,
           "way": 0.015}  # fmt: skip
NAMES = {"backlash": "play", "input_delay": "late", "valve_dead_zone": "dead", "leakage": "leak",
         "spring": "k", "stiff_spring": "k_cube", "cogging": "ripple", "warmup": "warm",
         "position_dependent_friction": "along", "load_dependent_friction": "by_load",
         "stribeck": "slow", "nonlinear_viscous": "square", "rising_stiction": "grown"}  # fmt: skip
IN_COMMAND = ("input_delay", "valve_dead_zone", "leakage")
EFFECTS = ("none", *NAMES)
# Known effects by other laws than the library's, and the keys that have to be named.
LAWS = {"stribeck_tustin": ("slow_tustin", "stribeck"),
        "rising_rational": ("grown_rational", "rising_stiction"),
        "cogging_harmonic": ("harmonic", "cogging"),
        "tight_spot": ("spot", "tight_spot"),
        "wearing_in": ("worn_in", "warmup")}  # fmt: skip
# Effects that the library does not have, and the signals of which one has to be named.
STRANGE = {"vibration": ("shake", {"t"}), "jump": ("jump", {"t"}), "ramp": ("ramp", {"t"}),
           "curved_actuator": ("curve", {"u", "F"}), "viscous_along": ("thick", {"y", "v"}),
           "hysteresis": ("elastic", {"y", "reversal"}), "seizure": ("worn", {"t"}),
           "ledge": ("ledge", {"y"})}  # fmt: skip


@dataclass(frozen=True)
class Recording:
    """How a machine is logged: every h [s], so long [s], noise of y [m], F [N] and the pressures
    [Pa], and the encoder's count [m], 0 where it has none."""

    h: float = 2e-3
    seconds: float = 60.0
    noise_y: float = 1e-5
    noise_F: float = 1e-2
    noise_p: float = 10.0
    count: float = 0.0


def recording(rng: np.random.Generator) -> Recording:
    """Another clock, length, noise and transducer than the usual one."""
    worse = 10.0 ** rng.uniform(-0.5, 0.7)
    return Recording(
        h=float(rng.choice([1e-3, 2e-3, 4e-3, 5e-3])),
        seconds=float(rng.choice([30.0, 60.0, 90.0])),
        noise_y=1e-5 * worse,
        noise_F=1e-2 * worse,
        noise_p=10.0 * worse,
        count=float(rng.choice([0.0, 1e-6, 2e-5])),
    )


@dataclass(frozen=True)
class Rig:
    """Nine parameters, gains of the loop (k_p, k_d, k_i), and the actuator (k1, k2)."""

    nine: tuple[float, ...]
    gains: tuple[float, float, float]
    k1: float
    k2: float
    limit: float


RIGS: Mapping[str, Rig] = {
    "pneumatic": Rig((2.2, 14, 11, 180, 210, 0.008, -0.008, 18, -15), (6, 0.12, 1), 9e3, 8e3, 5.0),
    "force": Rig((1.4, 9, 8, 90, 100, 0.008, -0.008, 12, -11), (6, 0.12, 1), 6e3, 5e3, 5.0),
    "motor": Rig((5, 14, 12, 80, 70, 0.006, -0.006, 17, -16), (60, 3, 60), K_A, 0.0, 10.0),
}


@compiled
def run(
    p: Array, gains: Array, k1: float, k2: float, limit: float, motor: bool, e: Array, r: Array,
    n_y: Array, h: float, count: float,
) -> Array:  # fmt: skip
    """Position shown, command and force (3, n) at every sample, every h [s], from rest."""
    m, f_cp, f_cn, f_vp, f_vn, dv_p, dv_n, f_sp, f_sn = p
    out = np.zeros((3, len(r)))
    sent = np.zeros(64)
    y, v, force, shown, rested = r[0], 0.0, 0.0, r[0], 0.0
    speed, before, total, hysteretic = 0.0, r[0], 0.0, 0.0
    sub = round(h / EULER)
    dt = h / sub
    smoothed = 1.0 - 0.7 ** (h / 2e-3)  # the loop's low-pass of the speed, of one bandwidth
    for i in range(len(r)):
        shown = min(max(shown, y - 0.5 * e[0]), y + 0.5 * e[0])
        seen = shown + n_y[i]
        if count > 0.0:
            seen = count * np.round(seen / count)
        speed += smoothed * ((seen - before) / h - speed)
        before = seen
        total = min(max(total + gains[2] * h * (r[i] - seen), -limit), limit)
        u = min(max(gains[0] * (r[i] - seen) - gains[1] * speed + total, -limit), limit)
        out[0, i], out[1, i], out[2, i] = seen, u, force
        sent[1:] = sent[:-1].copy()
        sent[0] = u
        given = sent[round(e[1] / h)]
        given = np.sign(given) * max(abs(given) - e[2], 0.0)
        if e[21] > 0.0:
            given = e[21] * np.tanh(given / e[21])
        late = i > 0.5 * len(r)
        outer = e[17] * np.sin(2.0 * np.pi * e[18] * i * h) + e[20] * i * h
        outer += e[19] if late else 0.0
        for j in range(sub):
            force = k1 * given if motor else force + dt * (k1 * given - k2 * v - e[3] * force)
            drive = (
                force
                + outer
                - hysteretic
                - (e[26] if y > 0.0 else 0.0)
                - e[4] * y
                - e[5] * y**3
                + e[6] * np.sin(2.0 * np.pi * y / e[7])
                + e[29] * (np.sin(2.0 * np.pi * y / e[7]) + 0.5 * np.cos(4.0 * np.pi * y / e[7]))
            )
            scale = 1.0 + e[8] * np.exp(-(i + j / sub) * h / e[9]) + e[10] * y
            scale += e[25] if late else 0.0
            scale += e[30] * np.exp(-0.5 * ((y - 0.015) / 0.008) ** 2) - e[31] * (i + j / sub) * h
            more, slow = e[11] * abs(force), e[12] + e[27]
            stuck = v == 0.0
            rested = rested + dt if stuck else 0.0
            grown = e[15] * (1.0 - np.exp(-rested / e[16])) if stuck else 0.0
            grown += e[28] * rested / (rested + e[16]) if stuck else 0.0
            if dv_n < v < dv_p:
                high, low = f_sp * scale + slow + more, f_sn * scale - slow - more
                if low - grown <= drive <= high + grown:
                    v = 0.0
                    continue
                friction = high + grown if drive > 0.0 else low - grown
            else:
                way = 1.0 if v > 0.0 else -1.0
                level = (f_cp if v > 0.0 else f_cn) * scale + more
                level += e[12] * np.exp(-((v / e[13]) ** 2)) + e[14] * v * v
                level += e[27] * np.exp(-abs(v) / e[13])
                friction = way * level + (f_vp if v > 0.0 else f_vn) * (1.0 + e[22] * y) * v
            after = v + dt * (drive - friction) / m
            v = 0.0 if after * v < 0.0 else after
            y += dt * v
            hysteretic += dt * (e[23] * v - abs(v) * hysteretic) / e[24]
    return out


def reference(kind: str, rng: np.random.Generator, h: float, seconds: float) -> Array:
    """Ramps to random places with dwells, five sines, or a triangle with a faster sine at times."""
    t = np.arange(round(seconds / h)) * h
    if kind == "multisine":
        sizes, rates = (0.6, 0.35, 0.2, 0.08, 0.03), (0.08, 0.21, 0.47, 0.9, 1.7)
        phases = rng.uniform(0.0, 2.0 * np.pi, 5)
        parts = [a * np.sin(2 * np.pi * f * t + q) for a, f, q in zip(sizes, rates, phases)]  # noqa: B905
        return np.asarray(REACH * np.sum(parts, axis=0))
    if kind == "triangle":
        turn = (0.12 * t + rng.uniform()) % 1.0
        swing = np.sin(2 * np.pi * 1.1 * t) * (np.sin(2 * np.pi * 0.05 * t) > 0.0)
        return np.asarray(REACH * (4.0 * np.abs(turn - 0.5) - 1.0 + 0.25 * swing))
    out, here = list[Array](), 0.0
    while sum(len(part) for part in out) < len(t):
        there = rng.uniform(-REACH, REACH)
        out.append(np.linspace(here, there, round(rng.uniform(0.1, 0.8) / h)))
        out.append(np.full(round(rng.uniform(0.7, 2.5) / h), there))
        here = there
    return np.asarray(np.concatenate(out)[: len(t)])


def sizes_of(effect: str, machine: str, coulomb: float) -> Array:
    """Sizes of the effects: this one at about a fifth of the Coulomb level, the others 0."""
    share = 0.2 * coulomb
    dead = share / K_A if machine == "motor" else 0.1
    full = {
        "play": 2e-4, "late": 8e-3, "dead": dead, "leak": 1.5, "k": share / REACH,
        "k_cube": share / REACH**3, "ripple": share, "warm": 0.3, "along": 0.25 / REACH,
        "by_load": 0.15, "slow": share, "square": share / SPEED**2, "grown": share,
        "shake": share, "jump": share, "ramp": share / 30.0, "curve": 0.15 if machine == "pneumatic"
        else 1.5 * coulomb / K_A, "thick": 0.5 / REACH, "elastic": share, "worn": 0.3,
        "ledge": share, "slow_tustin": share, "grown_rational": share, "harmonic": share,
        "spot": 0.4, "worn_in": 0.004,
    }  # fmt: skip
    own = {**STRANGE, **LAWS}[effect][0] if effect not in EFFECTS else NAMES.get(effect)
    one = {name: LENGTHS.get(name, 0.0) for name in SIZES} | ({own: full[own]} if own else {})
    return np.array([one[name] for name in SIZES])


def write(
    folder: Path, machine: str, effect: str, seed: int, place: int, varied: bool = False
) -> None:
    """Both logs and the card of one machine; varied: in a recording of its own."""
    rig, rng = RIGS[machine], np.random.default_rng([seed, place])
    how = recording(np.random.default_rng([seed, place, 1])) if varied else Recording()
    nine = np.array(rig.nine) * rng.uniform(0.75, 1.3, 9)
    nine[7:] = np.sign(nine[7:]) * np.maximum(np.abs(nine[7:]), 1.15 * nine[1:3])
    e = sizes_of(effect, machine, float(np.mean(nine[1:3])))
    for name in ("train", "test"):
        r = reference(REFERENCES[(seed + place) % 3], rng, how.h, how.seconds)
        noise = how.noise_y * rng.standard_normal(len(r))
        y, u, F = run(
            nine, np.array(rig.gains), rig.k1, rig.k2, rig.limit, machine == "motor", e, r, noise,
            how.h, how.count,
        )  # fmt: skip
        columns = {"time": np.arange(len(r)) * how.h, "pos": y}
        F = F + how.noise_F * rng.standard_normal(len(r))
        if machine != "force":
            columns["volt"] = u
        if machine == "force":
            columns["newton"] = F
        if machine == "pneumatic":  # eq. (7): F = S_p P_p - S_n P_n - (S_p - S_n) P_s
            both = F + (AREA_P - AREA_N) * SUPPLY
            p_n = (2.0 * AREA_P * MEAN - both) / (AREA_P + AREA_N)
            columns["pp"] = (both + AREA_N * p_n) / AREA_P + how.noise_p * rng.standard_normal(
                len(r)
            )
            columns["pn"] = p_n + how.noise_p * rng.standard_normal(len(r))
        table = np.column_stack(list(columns.values()))
        np.savetxt(
            folder / f"{name}.csv", table, "%.10g", ",", header=",".join(columns), comments=""
        )
    (folder / "card.toml").write_text(CARD[machine], encoding="utf-8")


HEAD = """[card]
name = "outside"
[signals]
t = { column = "time", unit = "s" }
y = { column = "pos", unit = "m" }
"""
CARD = {
    "pneumatic": HEAD + 'u = { column = "volt", unit = "V" }\n'
    'p_p = { column = "pp", unit = "Pa" }\np_n = { column = "pn", unit = "Pa" }\n'
    f'[rig]\nkind = "electro-pneumatic"\narea_p_m2 = {AREA_P}\narea_n_m2 = {AREA_N}\n'
    f"supply_pressure_pa = {SUPPLY}\n",
    "force": HEAD + 'F = { column = "newton", unit = "N" }\n[rig]\nkind = "force"\n',
    "motor": HEAD + 'u = { column = "volt", unit = "V" }\n[rig]\nkind = "motor"\n'
    f"force_per_command = {K_A}\n",
}
