"""Forces that repeat a whole number of times in a turn: cogging of magnets and teeth, by orders.

The equation of motion in weak form, over windows of sliding in one direction (N m):
    F = m y'' + (+-)F_c + F_v y' + sum over the orders n of A_n sin(n y) + B_n cos(n y).
The first order is gravity's and there from the start; the others join one by one, the one first
that explains most. On a slow motor they are larger than friction: no run follows its log, and no
friction shows, before they are known.
Sources: harmonics of cogging torque, Hanselman, Brushless Permanent Magnet Motor Design, 2nd ed.,
chapter 4; forward selection by orthogonal least squares, Chen, Billings, Luo, Int. J. Control 50
(1989) 1873.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array, BoolArray
from identification.errors import NotIdentifiable, UserError
from identification.estimation.regression.equation_rows import (
    NOTHING_KNOWN,
    MotionLog,
    mechanical,
)
from identification.estimation.regression.motion_log import (
    LEAST_SAMPLES,
    WINDOW_SECONDS,
    motion_log,
)
from identification.estimation.regression.weighted_rows import (
    OVERLAP,
    Rows,
    least_squares,
    left_out,
    spread_of_left_out,
    stacked,
)
from identification.log import Log, Rig
from identification.model.size import Size
from identification.model.surroundings import Order, Surroundings
from identification.signals.weak_form import WeakWindows, sliding_windows
from identification.thresholds import BEYOND_CHANCE, CHANCE_LEVEL, HALF, MATERIAL

HIGHEST = 100  # order that the windows are made short enough for
THINNED_TO = 3000
FEWEST_WINDOWS_OF_A_TURN = 60
OUTLYING_ROW = 6.0  # times the median left, beyond which a row is of a start or a stop


@dataclass(frozen=True, eq=False)
class _Turning:
    """Rows of the equation of all logs, with a spring's and gravity's columns beside inertia's and
    friction's; windows and angles [rad] of each log, and which of their rows count; highest order
    that they show."""

    rows: Rows
    angles: tuple[tuple[WeakWindows, Array], ...]
    counts: BoolArray
    highest: int

    def pair(self, order: float) -> Array:
        """The columns of an order, (r, 2): weighted means of its sine and cosine."""
        each = [
            np.column_stack([w.mean @ np.sin(order * y), w.mean @ np.cos(order * y)])
            for w, y in self.angles
        ]
        return np.asarray(np.vstack(each)[self.counts])

    def without_outliers(self, chosen: Sequence[int]) -> "_Turning":
        """The rows that a model of these orders does not leave far outside."""
        columns, b = self.with_pairs(chosen), self.rows.b
        rest = np.abs(b - columns @ least_squares(columns, b))
        kept: BoolArray = rest <= OUTLYING_ROW * float(np.median(rest))
        counts = self.counts.copy()
        counts[counts] = kept
        return replace(self, rows=self.rows.at(kept), counts=counts)

    def with_pairs(self, chosen: Sequence[int]) -> Array:
        """All columns with those of these orders."""
        return np.column_stack([self.rows.X, *(self.pair(n) for n in chosen)])


def turn_orders(logs: Sequence[Log], rig: Rig) -> tuple[Order, ...]:
    """Orders of the turn whose forces explain most of what friction and inertia leave, each
    significant and material beside the largest.

    None where a machine does not turn, too little of its motion slides, or the whole of what is
    left is not mostly theirs: a small one is an effect as any other, for a trace to find. Sources:
    harmonics of cogging, Hanselman, chapter 4; forward selection, Chen, Billings, Luo (1989).
    """
    if rig.motion != "rotary" or not turns(max(float(np.ptp(log["y"])) for log in logs)):
        return ()
    found = _turning(logs, zoh=rig.kind == "motor")
    if found is None:
        return ()
    found = found.without_outliers(_chosen(found))
    chosen = _chosen(found)
    if not chosen:
        return ()
    columns, b = found.with_pairs(chosen), found.rows.b
    if not are_most(_left(found.rows.X, b), _left(columns, b)):
        return ()
    theta = least_squares(columns, b)
    each = left_out(found.rows.block, lambda kept: least_squares(columns[kept], b[kept]))
    sd = spread_of_left_out(each)
    first = found.rows.X.shape[1]
    sizes = [
        Size(-float(value), float(s)) for value, s in zip(theta[first:], sd[first:], strict=True)
    ]
    made = [Order(n, sizes[2 * i], sizes[2 * i + 1]) for i, n in enumerate(chosen)]
    least = MATERIAL * max(one.size for one in made)
    named = (one for one in made if is_significant(one.size, one.sd) and one.size > least)
    return tuple(sorted(named, key=lambda one: -one.size))


def orders_explain(logs: Sequence[Log], rig: Rig, around: Surroundings) -> tuple[float, float]:
    """What the equation leaves of the force without the orders and with them [N m], root mean
    squares; the orders as they are, friction and inertia of these logs.

    Raises NotIdentifiable where too little of them slides. By (2) of `README.md` (Hanselman;
    Gautier, Khalil 1988).
    """
    zoh = rig.kind == "motor"
    without, left = (
        _turning(some, zoh) for some in (logs, [around.of_place.taken_out(log) for log in logs])
    )
    if without is None or left is None:
        raise NotIdentifiable(
            f"{logs[0].name}: fewer than {FEWEST_WINDOWS_OF_A_TURN} windows of sliding"
        )
    before, after = (
        float(np.sqrt(_left(one.rows.X, one.rows.b) / len(one.rows.b))) for one in (without, left)
    )
    return before, after


def are_most(without: float, left: float) -> bool:
    """Whether orders that leave this of a square are most of what is left without them."""
    return left <= HALF * without


def is_significant(size: float, sd: float) -> bool:
    """Whether the size of an order is beyond chance among all the orders that were tried."""
    return size > BEYOND_CHANCE * sd


def turns(angle: float) -> bool:
    """Whether motion over an angle [rad] separates neighbouring orders."""
    return angle >= HALF * 2.0 * np.pi


def _chosen(found: _Turning) -> tuple[int, ...]:
    """Orders in the order in which they join, each with more of what the others leave than the best
    of all would have by chance."""
    orders = np.arange(2, found.highest + 1)
    pairs = np.stack([found.pair(float(n)) for n in orders])  # (orders, r, 2)
    base, b = np.linalg.qr(_kept(found.rows.X))[0], found.rows.b
    chosen: list[int] = []
    while True:
        left = b - base @ (base.T @ b)
        explained = np.array([_explained(pair, base, left) for pair in pairs])
        best, before = int(np.argmax(explained)), float(left @ left)
        n = int(orders[best])
        free = len(b) / OVERLAP - base.shape[1]
        if n in chosen or explained[best] <= _by_chance(len(orders), free) * before:
            break
        chosen.append(n)
        base = np.linalg.qr(np.column_stack([base, pairs[best]]))[0]
    return tuple(chosen)


def _by_chance(orders: int, free: float) -> float:
    """Share of the square of so many free rows of noise that the best of the orders explains with
    the chance CHANCE_LEVEL: of a pair of columns it is exponential, of mean 2 / free."""
    return 2.0 * float(np.log(orders / CHANCE_LEVEL)) / max(free, 1.0)


def _explained(pair: Array, base: Array, left: Array) -> float:
    """Square of what is left (r,) that a pair of columns takes beside an orthonormal base."""
    own = np.linalg.qr(pair - base @ (base.T @ pair))[0]
    return float(np.sum((own.T @ left) ** 2))


def _left(X: Array, b: Array) -> float:
    """Square that least squares leave."""
    rest = b - X @ least_squares(X, b)
    return float(rest @ rest)


def _kept(X: Array) -> Array:
    """Columns in which anything is."""
    return np.asarray(X[:, np.any(X != 0.0, axis=0)])


def _turning(logs: Sequence[Log], zoh: bool) -> _Turning | None:
    """Rows of the equation, thinned to so many; None where too few slide."""
    moved: list[MotionLog] = []
    for log in logs:
        try:  # slow motion is smoothed until its direction is significant
            moved.append(motion_log(log, zoh=zoh, by_command=False, prescribed=True))
        except UserError:
            continue
    rates = [np.abs(one.signals["v"][one.signals["d"] != 0]) for one in moved]
    if not any(len(rate) for rate in rates):
        return None
    speed = float(np.median(np.concatenate(rates)))
    made = [(one, _windows(one, speed)) for one in moved]
    made = [(one, w) for one, w in made if len(w.start)]
    rows = sum(len(w.start) for _, w in made)
    if rows < FEWEST_WINDOWS_OF_A_TURN:
        return None
    parts, angles = [], []
    for one, every in made:
        w, y = every.every(max(1, rows // THINNED_TO)), np.asarray(one.log["y"])
        up = np.asarray(one.signals["d"][w.middle] > 0)
        own = replace(one, sliding=w, up=up, speed=np.abs(w.first @ y))
        plain = mechanical(own, NOTHING_KNOWN)
        of_angle = (w.mean @ y, w.mean @ np.sin(y), w.mean @ np.cos(y))
        parts.append(replace(plain, X=np.column_stack([plain.X, *of_angle])))
        angles.append((w, y))
    longest = max(w.length * one.log.h for one, w in made)
    highest = int(min(2.0 * HIGHEST, 2.0 * np.pi / (speed * longest)))
    if highest < 2:
        return None
    found = stacked(parts)
    return _Turning(found, tuple(angles), np.ones(len(found.b), dtype=np.bool_), highest)


def _windows(one: MotionLog, speed: float) -> WeakWindows:
    """Windows of sliding, short enough for the highest order at that speed."""
    h = one.log.h
    seconds = min(WINDOW_SECONDS, 2.0 * np.pi / (HIGHEST * speed))
    length = max(LEAST_SAMPLES, 2 * round(seconds / h / 2))
    return sliding_windows(one.signals["d"], length, h)
