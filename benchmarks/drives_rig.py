"""Machines of `drives` as their drives log them: loops, trajectories, sensors, effects, truths."""

import zlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import cache

import numpy as np

from benchmarks.drives_kernel import ALGEBRAIC, LAGGING, PNEUMATIC, RATE, SIZES, run
from identification.arrays import Array
from identification.log import Log, Rig
from identification.model.karnopp import Karnopp

FAMILIES = ("motor", "pneumatic", "force")
PATHS = ("trapezoid", "s-curve", "sweep", "multisine", "mixed")
AREA_P, AREA_N, SUPPLY, MEAN = 12.6e-4, 10e-4, 6e5, 3e5
TRIES = 60  # draws of a machine until it moves and rests as it should
# Effects, and the keys of the library's that have to be named for them.
EFFECTS: Mapping[str, str] = {
    "stribeck": "stribeck", "presliding": "presliding", "cogging": "cogging", "spring": "spring",
    "position": "position_dependent_friction", "load": "load_dependent_friction",
    "warmup": "warmup", "backlash": "backlash", "dead_zone": "valve_dead_zone",
    "delay": "input_delay", "leakage": "leakage",
}  # fmt: skip
PAIRS = (("stribeck", "cogging"), ("presliding", "stribeck"), ("load", "spring"))
# Effects that no library has.
STRANGE = ("acceleration", "resonance", "bouc-wen", "since-reversal", "shake", "cable")
HIDDEN: Mapping[str, tuple[str, ...]] = {
    "motor": ("leakage",),
    "force": ("leakage", "dead_zone", "delay"),
    "pneumatic": (),
}


@dataclass(frozen=True)
class Recording:
    """How a machine is logged: rates of the loop and of the log [Hz], length [s], noise of y [m],
    share of the force's range and of the command's, bits of the command, count [m], jitter as a
    share of a sample."""

    loop_rate: int
    log_rate: int
    seconds: float
    noise_y: float
    noise_force: float
    noise_u: float
    bits: int
    count: float
    jitter: float


@dataclass(frozen=True)
class Machine:
    """A plain machine: its nine, actuator, loop, and how far, fast and hard it is moved."""

    family: str
    nine: Karnopp
    actuator: tuple[float, float, float]  # k_a, or k1, k2; lag [s]
    cascade: bool
    bandwidth: float  # of the speed loop [rad/s]
    travel: float
    speed: float
    acceleration: float
    limit: float
    paths: tuple[str, str]
    how: Recording

    @property
    def coulomb(self) -> float:
        """Mean of both directions' Coulomb levels [N]."""
        return 0.5 * (self.nine.F_cp + self.nine.F_cn)

    @property
    def most(self) -> float:
        """Largest force that its loop asks for [N]."""
        p = self.nine
        viscous = max(p.F_vp, p.F_vn) * self.speed
        return 2.0 * (max(p.F_sp, -p.F_sn) + viscous + p.m * self.acceleration)

    @property
    def act(self) -> Array:
        """The actuator as the kernel takes it."""
        first, second, lag = self.actuator
        if self.family == "pneumatic":
            return np.array([PNEUMATIC, first, second, 0.0])
        return np.array([LAGGING if lag > 0.0 else ALGEBRAIC, first, 0.0, lag])

    @property
    def force_loop(self) -> float:
        """Bandwidth of the force loop of a pneumatic machine [rad/s]."""
        return 5.0 * self.bandwidth

    @property
    def loop(self) -> Array:
        """The loop as the kernel takes it: P-PI, or PID with the same damping."""
        m, w = self.nine.m, self.bandwidth
        if self.cascade:
            gains = [m * w * w / 5.0, m * w, m * w * w / 5.0 * (w / 6.0), m * w * w / 6.0]
        else:
            gains = [m * w * w / 4.0, m * w, m * w * w / 4.0 * (w / 10.0), 0.0]
        low_pass = 1.0 - float(np.exp(-10.0 * w / self.how.loop_rate))
        return np.array([*gains, low_pass, self.limit, self.force_loop, self.how.count, self.most])

    @property
    def rig(self) -> Rig:
        """What its card says."""
        if self.family == "motor":
            return Rig("motor", force_per_command=self.actuator[0])
        if self.family == "force":
            return Rig("force")
        return Rig("electro-pneumatic", area_p=AREA_P, area_n=AREA_N, supply_pressure=SUPPLY)

    @property
    def words(self) -> str:
        """How it is moved and logged, in short."""
        h = self.how
        return (
            f"{'P-PI' if self.cascade else 'PID'} {h.loop_rate}/{h.log_rate} Hz {h.seconds:.0f} s"
            f" {self.paths[0]}, enc {1e6 * h.count:.2g}+{1e6 * h.noise_y:.1g} um,"
            f" F {100 * h.noise_force:.2g} %, u {h.bits} bit {100 * h.noise_u:.1g} %,"
            f" jit {100 * h.jitter:.1g} %"
        )


@dataclass(frozen=True, eq=False)
class Made:
    """A machine's two logs, and what only their maker knows."""

    machine: Machine
    train: Log
    test: Log
    effects: Mapping[str, float]
    motion: Array  # of the training log: position shown, speed, force, command, without noise


def stream(seed: int, *names: str) -> np.random.Generator:
    """Random numbers of a seed for one purpose."""
    return np.random.default_rng([seed, *(zlib.crc32(name.encode()) for name in names)])


def recording(rng: np.random.Generator, family: str) -> Recording:
    """Rates, lengths and sensors drawn for one machine."""

    def between(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    loop = int(rng.choice([1000, 2000, 4000, 8000]))
    log = int(rng.choice([250, 500, 1000, 2000, 4000]))
    count = between(1e-7, 2e-5)
    noise_u = between(1e-5, 1e-3)
    if family == "pneumatic":  # 0.1 to 1 mV of 5 V
        noise_u = between(2e-5, 2e-4)
    return Recording(
        loop_rate=loop,
        log_rate=min(log, loop),
        seconds=float(rng.choice([20.0, 40.0, 60.0, 120.0])),
        noise_y=float(rng.choice([0.0, 0.3])) * count,
        noise_force=between(5e-4, 5e-3),
        noise_u=noise_u,
        bits=int(rng.choice([12, 14, 16] if family == "pneumatic" else [10, 12, 14, 16])),
        count=count,
        jitter=float(rng.choice([0.0, 0.002, 0.02])),
    )


def drawn(family: str, seed: int, rng: np.random.Generator) -> Machine:
    """One draw of a machine."""

    def between(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    speed, travel = between(0.1, 0.5), between(0.03, 0.15)
    m, coulomb = between(1.0, 15.0), between(5.0, 40.0)
    f_c = coulomb * rng.uniform(0.8, 1.2, 2)
    f_v = coulomb * between(0.2, 1.0) / speed * rng.uniform(0.8, 1.2, 2)
    band = speed * between(0.01, 0.06) * rng.uniform(0.8, 1.25, 2)
    f_s = (f_c + f_v * band) * rng.uniform(1.25, 1.6, 2)  # above Coulomb with its dip
    nine = Karnopp(m, f_c[0], f_c[1], f_v[0], f_v[1], band[0], -band[1], f_s[0], -f_s[1])
    acceleration = max(between(1.0, 6.0), 4.0 * speed**2 / travel)
    lag = between(2e-4, 1e-3) if family == "force" else 0.0
    actuator = (between(10.0, 50.0), 0.0, lag)
    if family == "pneumatic":
        actuator = (between(2e3, 2e4), between(3e3, 1.2e4), 0.0)
    first = int(rng.integers(len(PATHS)))
    one = Machine(
        family, nine, actuator, bool(rng.random() < 0.7),
        between(30.0, 60.0) if family == "pneumatic" else between(50.0, 150.0),
        travel, speed, acceleration, 5.0 if family == "pneumatic" else 10.0,
        (PATHS[first], PATHS[(first + int(rng.integers(1, len(PATHS)))) % len(PATHS)]),
        recording(rng, family),
    )  # fmt: skip
    if family != "pneumatic":  # the amplifier fits the machine
        one = replace(one, actuator=(one.most / one.limit, 0.0, lag))
    return one


@cache
def machine(family: str, seed: int) -> Machine:
    """The first draw of the seed that moves, rests and follows without effects."""
    rng = stream(seed, family, "machine")
    for _ in range(TRIES):
        one = drawn(family, seed, rng)
        y, v, _, _ = simulated(replace(one, how=replace(one.how, seconds=20.0)), seed, "train", {})[
            1
        ]
        moves, rests = np.mean(np.abs(v) > 2.0 * one.nine.dv_p), np.mean(v == 0.0)
        if moves > 0.3 and rests > 0.01 and np.ptp(y) < 3.0 * one.travel:
            return one
    raise RuntimeError(f"{family} {seed}: no machine in {TRIES} draws moves and rests")


def profile(distance: float, speed: float, hard: float, soft: float, h: float) -> Array:
    """A move over a distance [m] from 0: trapezoid of speed, rounded over `soft` [s]."""
    speed = min(speed, float(np.sqrt(abs(distance) * hard)))
    rise, whole = speed / hard, abs(distance) / speed
    t = h * np.arange(int((whole + rise) / h) + 2)
    rates = np.clip(np.minimum(t / rise, (whole + rise - t) / rise), 0.0, 1.0)
    if soft > h:
        window = np.ones(round(soft / h))
        rates = np.convolve(rates, window / len(window))
    place = np.cumsum(rates)
    return np.asarray(distance * place / place[-1])


def waves(one: Machine, sweep: bool, rng: np.random.Generator, h: float) -> Array:
    """A sine sweep at the machine's speed, or five sines, faded in and out."""
    length = rng.uniform(8.0, 14.0) if sweep else rng.uniform(4.0, 7.0)
    t = h * np.arange(round(length / h))
    if sweep:
        f = 0.1 * (rng.uniform(4.0, 8.0) / 0.1) ** (t / t[-1])
        w = 2.0 * np.pi * f[:: 1 if rng.random() < 0.5 else -1]
        size = np.minimum(one.speed / w, one.acceleration / w**2)
        x = np.minimum(one.travel, size) * np.sin(h * np.cumsum(w))
    else:
        w = 2.0 * np.pi * np.exp(rng.uniform(np.log(0.15), np.log(3.0), 5))
        x = np.sum(np.sin(np.outer(t, w) + rng.uniform(0.0, 6.3, 5)) / w, axis=1)
        speed = np.gradient(x, h)
        x *= min(
            one.travel / np.max(np.abs(x)),
            one.speed / np.max(np.abs(speed)),
            one.acceleration / np.max(np.abs(np.gradient(speed, h))),
        )
    fade = np.clip(np.minimum(t, t[-1] - t) / 0.3, 0.0, 1.0)
    return np.asarray(x * fade**2 * (3.0 - 2.0 * fade))


def trajectory(one: Machine, kind: str, rng: np.random.Generator) -> Array:
    """Reference at the loop's ticks [m]: moves and waves, with dwells."""
    h, here = 1.0 / one.how.loop_rate, 0.0
    n = round(one.how.seconds / h)
    parts, count = [np.zeros(round(0.2 / h))], 0
    while count < n:
        what = str(rng.choice(PATHS[:4])) if kind == "mixed" else kind
        if what in ("sweep", "multisine"):
            part = waves(one, what == "sweep", rng, h)
            if here != 0.0:
                parts.append(here + profile(-here, one.speed, one.acceleration, 0.0, h))
                here = 0.0
        else:
            there = float(rng.uniform(-one.travel, one.travel))
            speed = one.speed * np.exp(rng.uniform(np.log(0.08), 0.0))
            hard = one.acceleration * rng.uniform(0.3, 1.0)
            soft = rng.uniform(0.02, 0.1) if what == "s-curve" else 0.0
            part = here + profile(there - here, float(speed), float(hard), float(soft), h)
            here = there
        dwell = np.full(round(np.exp(rng.uniform(np.log(0.1), np.log(1.5))) / h), here)
        parts += [part, dwell]
        count = sum(map(len, parts))
    return np.concatenate(parts)[:n]


def simulated(
    one: Machine, seed: int, part: str, e: Mapping[str, float], path: str | None = None
) -> tuple[Log, Array]:
    """The log of one run, and its motion (4, n) without the log's noise."""
    how, rng = one.how, stream(seed, one.family, part)
    r = trajectory(one, path or one.paths[0], rng)
    dr = np.gradient(r, 1.0 / how.loop_rate)
    n = round(how.seconds * how.log_rate)
    every, tick = RATE // how.log_rate, RATE // how.loop_rate
    noise = rng.standard_normal((2, len(r))) * [[how.noise_y], [how.noise_force * one.most]]
    late = np.clip(how.jitter * rng.standard_normal(n), -0.3, 0.3)
    at = np.clip((np.arange(n) + late) * every, 0.0, None)
    whole = np.floor(at + 1e-6).astype(np.int64)
    sizes = np.array([e.get(name, 0.0) for name in SIZES])
    motion = run(
        one.nine.array, one.act, sizes, one.loop, r, dr, noise, tick, whole, at - whole, every
    )
    return recorded(one, part, motion, rng), motion


def recorded(one: Machine, part: str, motion: Array, rng: np.random.Generator) -> Log:
    """The run behind its sensors."""
    how, n = one.how, motion.shape[1]
    y = motion[0] + how.noise_y * rng.standard_normal(n)
    y = how.count * np.round(y / how.count) if how.count > 0.0 else y
    step = 2.0 * one.limit / 2**how.bits if how.bits > 0 else 0.0
    u = motion[3] + how.noise_u * one.limit * rng.standard_normal(n)
    u = step * np.round(u / step) if step > 0.0 else u
    signals = {"t": np.arange(n) / how.log_rate, "y": y}
    if one.family == "motor":
        signals |= {"u": u, "F": one.actuator[0] * u}
    elif one.family == "force":
        signals["F"] = motion[2] + how.noise_force * one.most * rng.standard_normal(n)
    else:  # eq. (7): F = S_p P_p - S_n P_n - (S_p - S_n) P_s; both sensors make the force's noise
        both = motion[2] + (AREA_P - AREA_N) * SUPPLY
        p_n = (2.0 * AREA_P * MEAN - both) / (AREA_P + AREA_N)
        p_p = (both + AREA_N * p_n) / AREA_P
        noise = how.noise_force * one.most / np.hypot(AREA_P, AREA_N)
        p_p, p_n = (p + noise * rng.standard_normal(n) for p in (p_p, p_n))
        force = AREA_P * p_p - AREA_N * p_n - (AREA_P - AREA_N) * SUPPLY
        signals |= {"u": u, "p_p": p_p, "p_n": p_n, "F": force}
    return Log(part, signals)


def shown(effect: str, family: str) -> bool:
    """Whether a log of this family can show the effect."""
    return effect not in HIDDEN[family]


def sizes(one: Machine, effect: str, s: float, motion: Array) -> dict[str, float]:
    """Sizes of an effect that makes a share s of the Coulomb level; motion: without effects."""
    rng = stream(round(1e6 * one.coulomb), effect)
    share, reach = s * one.coulomb, one.travel
    slides = np.abs(motion[1]) > one.nine.dv_p
    band = 0.5 * (one.nine.dv_p - one.nine.dv_n)
    rms = [float(np.sqrt(np.mean(x[slides] ** 2))) for x in motion[2:]]
    late = 0.4 / one.force_loop if one.family == "pneumatic" else 3e-3
    second = s * one.nine.m
    full: dict[str, dict[str, float]] = {
        "none": {},
        "stribeck": {"dip": share, "dip_speed": rng.uniform(2.0, 4.0) * band},
        "presliding": {"sigma_0": one.coulomb / (s * 5e-4), "sigma_1": 0.0},
        "cogging": {"cog": share, "cog_period": rng.uniform(0.1, 0.3) * reach},
        "spring": {"k": share / reach},
        "position": {"slope": share / reach},
        "load": {"mu": share / rms[0]},
        "warmup": {"warm": -s, "warm_tau": 0.15 * one.how.seconds},
        "backlash": {"play": 1e-3 * s},
        "dead_zone": {"dead": s * rms[1]},
        "delay": {"late": late * s / 0.2},
        "leakage": {"leak": 1.5 * s / 0.2},
        "acceleration": {"by_acceleration": 2.0 * s / one.acceleration},
        "resonance": {"second_mass": second, "second_k": second * (80.0 * np.pi) ** 2,
                      "second_c": 0.06 * second * 80.0 * np.pi},
        "bouc-wen": {"bouc": share, "bouc_length": 0.15 * reach},
        "since-reversal": {"since_reversal": share},
        "shake": {"shake": share, "shake_rate": rng.uniform(1.0, 7.0)},
        "cable": {"cable": share / reach**2},
    }  # fmt: skip
    return full[effect]


def make(family: str, effects: tuple[str, ...], seed: int, s: float) -> Made:
    """Both logs of a machine with these effects."""
    one = machine(family, seed)
    plain = simulated(one, seed, "train", {})[1]
    e: dict[str, float] = {}
    for effect in effects:
        e |= sizes(one, effect, s, plain)
    if "sigma_0" in e:  # LuGre's micro-damping: half of critical for the body on its bristles
        e["sigma_1"] = float(np.sqrt(e["sigma_0"] * one.nine.m))
    elif "stribeck" in effects:  # the dip ends where the stick limit begins
        more = e["dip"] * np.exp(-((one.nine.dv_p / e["dip_speed"]) ** 2))
        p = one.nine
        one = replace(one, nine=replace(p, F_sp=p.F_sp + more, F_sn=p.F_sn - more))
    train, motion = simulated(one, seed, "train", e)
    test, _ = simulated(one, seed, "test", e, one.paths[1])
    return Made(one, train, test, e, motion)


def truth(made: Made) -> dict[str, float | None]:
    """The nine, None where the machine has no such thing: bristles know no band and no stick."""
    nine: dict[str, float | None] = dict(asdict(made.machine.nine))
    if made.effects.get("sigma_0"):
        nine |= {key: None for key in ("dv_p", "dv_n", "F_sp", "F_sn")}
    return nine
