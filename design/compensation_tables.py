"""A model as the tables that controls hold: friction against speed, cogging by its orders."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from identification.arrays import Array
from identification.effects._base import Acting
from identification.errors import BadModel
from identification.model.plant import Plant
from identification.simulation.effect_along_motion import contribution

TABLE_ERROR = 2e-3  # largest relative error between the points of a table with room for them
CURVE_POINTS = 1500  # in which a curve is compared with the straight lines of a table
TURN_POINTS = 720  # of one turn
LOWEST_OF_TABLE = 1e-3  # lowest speed of a table, of its highest, where no stick band is identified
NO_SLOPE = 1e-12  # of the largest, below which an amplitude is none


@dataclass(frozen=True)
class SlidingFriction:
    """Friction of a plant while it slides steadily, by its nine parameters and effects of speed.

    Both ways as sizes: `positive` and `negative` take speeds v > 0 [m/s], (n,), and give N, (n,).
    low, high: speeds between which it is asked for.
    """

    plant: Plant
    low: float
    high: float

    def __post_init__(self) -> None:
        if not 0.0 < self.low < self.high:
            raise BadModel(
                f"a table from {self.low:g} to {self.high:g} m/s; a lowest speed above 0 and a"
                " higher one needed"
            )

    def positive(self, v: Array) -> Array:
        """Friction in positive direction [N], shape of v."""
        return self._one(v, 1)

    def negative(self, v: Array) -> Array:
        """Size of the friction in negative direction [N], shape of v."""
        return self._one(v, -1)

    def mean(self, v: Array) -> Array:
        """The mean of both ways [N], which a table without sign holds."""
        return np.asarray(0.5 * (self.positive(v) + self.negative(v)))

    @cached_property
    def speeds(self) -> Array:
        """Speeds at which tables are compared with it, close together where they are low."""
        share = np.linspace(0.0, 1.0, CURVE_POINTS)
        low = np.geomspace(self.low, self.high, CURVE_POINTS)
        return np.unique(np.concatenate([low, self.low + share * (self.high - self.low)]))

    @property
    def asymmetry(self) -> float:
        """Largest half difference of the two ways [N]: what a table without sign errs by."""
        v = self.speeds
        return float(np.max(np.abs(self.positive(v) - self.negative(v)))) / 2.0

    @property
    def constant_share(self) -> float:
        """The constant force [N] that leaves the least of half the difference of the two ways."""
        half = 0.5 * (self.positive(self.speeds) - self.negative(self.speeds))
        return 0.5 * float(np.max(half) + np.min(half))

    def _one(self, v: Array, way: int) -> Array:
        v = np.abs(np.asarray(v, dtype=np.float64))
        p = self.plant.friction
        level, viscous = (p.F_cp, p.F_vp) if way > 0 else (p.F_cn, p.F_vn)
        added = [along(one, v=way * v, way=way, plant=self.plant) for one in self._of_speed]
        return np.asarray(level + viscous * v + sum(added, np.zeros_like(v)))

    @cached_property
    def _of_speed(self) -> tuple[Acting, ...]:
        return tuple(one for one in self.plant.effects if is_of_speed(one))


def is_of_speed(one: Acting) -> bool:
    """Whether an effect is friction that depends on the speed alone, as a table can hold it."""
    effect = one.effect
    return effect.place.rubs and effect.evolve is None and set(effect.depends_on) <= {"v"}


def is_of_place(one: Acting) -> bool:
    """Whether an effect is a force that depends on the place alone, or is constant."""
    effect = one.effect
    return effect.place.drives and effect.evolve is None and set(effect.depends_on) <= {"y"}


def along(
    one: Acting, *, plant: Plant, way: int = 1, v: Array | None = None, y: Array | None = None
) -> Array:
    """What an effect without memory gives at these velocities or places, in its unit, (n,)."""
    n = len(v) if v is not None else len(y) if y is not None else 0
    blank = np.zeros(n)
    signals = {
        "t": np.arange(n, dtype=np.float64),
        "y": blank if y is None else np.asarray(y, dtype=np.float64),
        "v": blank if v is None else np.asarray(v, dtype=np.float64),
        "F": blank,
        "u": blank,
        "d": np.full(n, float(way)),
    }
    return contribution(one.effect, one.values, signals, 1.0, plant.friction)


@dataclass(frozen=True)
class Points:
    """A table: x (n,) rising, y (n,), straight lines between; error: the largest that they make,
    relative to the curve, at the speeds that were asked for."""

    x: Array
    y: Array
    error: float


def table_points(
    curve: Callable[[Array], Array], x: Array, most: int, tolerance: float = TABLE_ERROR
) -> Points:
    """At most `most` points of the curve, ends included, whose straight lines follow it.

    x: (m,) rising, where it is followed. As few points as keep the tolerance, relative; where more
    are needed than there is room for, as many as there are and the least tolerance that they keep.
    """
    if most < 2:
        raise BadModel(f"a table of {most} points; at least 2 needed")
    y = curve(x)
    at = _breaks(x, y, tolerance, most)
    if at is None:
        low, high = tolerance, 1e3
        for _ in range(60):
            middle = math.sqrt(low * high)
            found = _breaks(x, y, middle, most)
            low, high, at = (low, middle, found) if found else (middle, high, at)
        assert at is not None
    return Points(x[at], y[at], _error(x, y, at))


def spread_points(points: Points, curve: Callable[[Array], Array], count: int) -> Points:
    """The points with further ones of the curve between, in the widest gaps, so many in all."""
    x = list(points.x)
    while len(x) < count:
        gap = int(np.argmax(np.diff(x)))
        x.insert(gap + 1, 0.5 * (x[gap] + x[gap + 1]))
    return replace(points, x=np.array(x), y=curve(np.array(x)))


def _breaks(x: Array, y: Array, tolerance: float, most: int) -> list[int] | None:
    """Numbers of the points, each as far from the one before as the tolerance lets it."""
    at, last = [0], len(x) - 1
    while at[-1] < last:
        if len(at) == most:
            return None
        good, bad = at[-1] + 1, last + 1
        while bad - good > 1:
            middle = (good + bad) // 2
            inside = _error(x, y, [at[-1], middle]) <= tolerance
            good, bad = (middle, bad) if inside else (good, middle)
        at.append(good)
    return at


def _error(x: Array, y: Array, at: Sequence[int]) -> float:
    part = slice(at[0], at[-1] + 1)
    size = np.maximum(np.abs(y[part]), NO_SLOPE * float(np.max(np.abs(y))) + 1e-300)
    return float(np.max(np.abs(np.interp(x[part], x[at], y[at]) - y[part]) / size))


@dataclass(frozen=True)
class Harmonic:
    """A force amplitude * cos(2 pi y/period - phase) [N] on the body; period [m], phase [rad] in
    [0, 2 pi)."""

    period: float
    amplitude: float
    phase: float

    def at(self, y: Array) -> Array:
        """The force [N] at these places."""
        return np.asarray(self.amplitude * np.cos(2.0 * np.pi * y / self.period - self.phase))


def cogging_harmonics(effects: Iterable[Acting]) -> tuple[Harmonic, ...]:
    """The waves of every cogging among the effects, the largest first; one period, one wave."""
    waves: dict[float, complex] = {}
    for one in effects:
        if not is_cogging(one):
            continue
        p = one.values
        for period, a, b in ((p["period"], p["a"], p["b"]), (p["period"] / 2, p["a_2"], p["b_2"])):
            same = next((each for each in waves if abs(each / period - 1.0) < 1e-6), period)
            waves[same] = waves.get(same, 0j) + complex(b, a)
    most = max(map(abs, waves.values()), default=0.0)
    found = [
        Harmonic(period, abs(wave), math.atan2(wave.imag, wave.real) % (2.0 * math.pi))
        for period, wave in waves.items()
        if abs(wave) > NO_SLOPE * most
    ]
    return tuple(sorted(found, key=lambda one: -one.amplitude))


def is_cogging(one: Acting) -> bool:
    """Whether an effect is cogging, the first or a further one."""
    name, _, number = one.key.rpartition("_")
    return one.key == "cogging" or (name == "cogging" and number.isdigit())


def summed(harmonics: Iterable[Harmonic], y: Array) -> Array:
    """The force of all of them [N] at these places, shape of y."""
    return np.asarray(sum((one.at(y) for one in harmonics), np.zeros(len(y))))
