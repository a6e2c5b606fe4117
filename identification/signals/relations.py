"""How two signals of one machine hang together: what distinguishes a position from a force without
words.

All times are in samples, so that the unit of the clock need not be known. A force accelerates the
body and is eaten up by friction; a velocity is the position's derivative; a command changes a force
or is one; a reference is ahead of the position.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from identification.arrays import Array, BoolArray
from identification.errors import BadLog
from identification.signals.check import work_share
from identification.signals.differentiate import (
    MOST_CUTOFF,
    Motion,
    differentiate,
    low_pass,
    spectrum,
)
from identification.thresholds import TWICE

SURE_OF_MOTION = 4.0  # times the velocity's noise, from which a sample counts as moving
LEAST_SPEED = 0.02  # of the speeds that are seldom exceeded, the same
FEWEST_MOVING, FEWEST_OF_A_WAY = 60, 6  # samples in all, and in each direction
ALIKE_CHANGES = 0.7  # correlation of two signals' changes, from which these give the lead
LONGEST_LEAD = 0.1  # of the log, that one signal may be ahead of another
AS_ALIKE = 0.1  # of a likeness, that another shift's is behind for the two to be as likely
GIVES_SIGN = 0.1  # share of the exchanged work, from which its sign is that of the force


class Derivative(NamedTuple):
    """How much of a signal (share of its square) is the velocity times `factor` a sample."""

    share: float
    factor: float


class ForceLaw(NamedTuple):
    """What of a signal is m a + F_v v + F_c sgn(v) + F_0 along the motion of a body.

    share: of its variance; friction: of it, what the step at the reversal alone explains, None of a
    motion that goes one way only; way: 1
    where friction takes energy up, -1 where the signal has the other sign; work: share of the
    exchanged work, 0 where the motion does not come back; balance: F_0, in the signal's unit;
    coulomb: F_c, the same; m: in the signal's unit over the position's a sample squared; inertia:
    share that the acceleration alone explains, beside place too (a weight's, a spring's force),
    with the sign of the mass.
    """

    share: float
    friction: float | None
    way: float
    work: float
    balance: float
    coulomb: float
    m: float
    inertia: float


class Lead(NamedTuple):
    """By how many samples one signal is ahead of another, and how alike they then are (-1 to 1);
    either: turned in sign, and about as alike unturned half a period on."""

    samples: float
    likeness: float
    either: bool = False


def motion_of(x: Array, renewed: float = 1.0) -> Motion | None:
    """The motion of a signal in samples; None where it is too short or does not change.

    renewed: samples from one new value to the next, between which it is interpolated.
    """
    if np.ptp(x) == 0.0:
        return None
    try:
        return differentiate(x, 1.0, min(spectrum(x, 1.0).cutoff, MOST_CUTOFF / renewed))
    except BadLog:
        return None


def moving(motion: Motion) -> BoolArray:
    """Samples (n,) in which the body surely moves."""
    speed = np.abs(motion.v)
    least = max(SURE_OF_MOTION * motion.v_noise, LEAST_SPEED * float(np.quantile(speed, 0.95)))
    sure = speed > least
    sure[: motion.edge] = False
    sure[len(sure) - motion.edge :] = False
    return np.asarray(sure)


def derivative(motion: Motion, x: Array) -> Derivative:
    """How far x (n,) is the derivative of a position; both smoothed alike."""
    smooth = low_pass(x, 1.0, motion.cutoff)
    inside = slice(motion.edge, len(x) - motion.edge)
    v, f = motion.v[inside], smooth[inside]
    spread, together = float(np.var(f)), float(np.mean((v - v.mean()) * (f - f.mean())))
    square = float(np.var(v))
    if spread == 0.0 or square == 0.0:
        return Derivative(0.0, 0.0)
    return Derivative(together**2 / (square * spread), together / square)


def force_law(motion: Motion, y: Array, f: Array) -> ForceLaw | None:
    """How far f (n,) is the force that moves a body at y (n,); None where too little moves."""
    smooth = low_pass(f, 1.0, motion.cutoff)
    return next(iter(force_laws(motion, y, f[:, None], smooth[:, None])), None)


def force_laws(motion: Motion, y: Array, f: Array, smooth: Array) -> list[ForceLaw]:
    """As `force_law`, of the columns of f (n, k) and the same as smooth as the motion is, (n, k).

    Empty where too little moves.
    """
    sure = moving(motion)
    if np.sum(sure) < FEWEST_MOVING:
        return []
    up = motion.v[sure] > 0
    both = min(np.sum(up), np.sum(~up)) >= FEWEST_OF_A_WAY
    step = np.sign(motion.v) if both else np.zeros(len(y))
    X = np.column_stack([motion.a, motion.v, step, np.ones(len(y))])[sure]
    b = smooth[sure]
    share, theta = _explained(X, b)
    without, _ = _explained(X[:, [0, 1, 3]], b)
    inertia = _by_inertia(np.column_stack([X, y[sure]]), b)
    work = [work_share(y, one) or 0.0 for one in f.T]
    onwards = np.zeros(f.shape[1]) if both else float(np.sign(motion.v[sure].mean())) * b.mean(0)
    return [
        _law(share[k], share[k] - without[k] if both else None, theta[:, k], work[k], onwards[k],
             inertia[k])
        for k in range(f.shape[1])
    ]  # fmt: skip


def of_a_weight(motion: Motion, y: Array, f: Array, turns: Mapping[str, float]) -> str | None:
    """The unit in which a position (n,) is the angle of an arm whose weight is in the force f (n,),
    of turns: units with what a turn is in them; None where none explains it clearly better than a
    force that is a parabola of the place."""
    sure = moving(motion)
    if np.sum(sure) < FEWEST_MOVING:
        return None
    own = np.column_stack([motion.a, motion.v, np.sign(motion.v), np.ones(len(y))])
    b = low_pass(f, 1.0, motion.cutoff)[sure]

    def left(*place: Array) -> float:
        return 1.0 - float(_explained(np.column_stack([own, *place])[sure], b)[0])

    size = (y - y.mean()) / np.ptp(y)
    rival = left(size, size**2)
    angles = {unit: 2.0 * np.pi * y / turn for unit, turn in turns.items()}
    lefts = {unit: left(np.sin(one), np.cos(one)) for unit, one in angles.items()}
    best = min(lefts, key=lambda unit: lefts[unit])
    return best if TWICE * lefts[best] < rival else None


def _by_inertia(X: Array, b: Array) -> Array:
    """Share of the signals b (r, k) that the acceleration, the first of the columns (r, 6), alone
    explains, with the sign of its factor, (k,)."""
    share, theta = _explained(X, b)
    return np.asarray(np.sign(theta[0]) * (share - _explained(X[:, 1:], b)[0]))


def _law(
    share: float, friction: float | None, theta: Array, work: float, onwards: float, inertia: float
) -> ForceLaw:
    """onwards: the mean of a signal along a motion that goes one way only, else 0."""
    if abs(work) > GIVES_SIGN or onwards != 0.0:
        way = float(np.sign(work if abs(work) > GIVES_SIGN else onwards))
    else:
        way = float(np.sign(theta[2])) or float(np.sign(theta[1])) or 1.0
    balance, coulomb, m = float(theta[3]), float(theta[2]), float(theta[0])
    step = None if friction is None else float(friction)
    law = ForceLaw(float(share), step, way, work, balance, coulomb, m, float(inertia))
    turns_back = step is not None and abs(work) <= GIVES_SIGN
    return law._replace(way=float(np.sign(inertia))) if turns_back and by_inertia(law) else law


def by_inertia(law: ForceLaw) -> bool:
    """Whether the sign of a force is that with which its mass is positive: what the acceleration
    alone explains is more than the step of friction does, and than all that the law leaves, as of
    a pendulum that turns far, whose weight is no force linear in place."""
    return abs(law.inertia) > max(law.friction or 0.0, 1.0 - law.share)


def lead(first: Array, second: Array) -> Lead:
    """By how many samples `first` is ahead of `second` (negative: behind).

    By the changes of both where these are alike, else, where noise hides the changes, by the
    signals themselves: the largest correlation over shifts, by a parabola between samples. Of a
    periodic motion every half period is a match: the nearest unturned one counts, a turned one only
    where `second` then follows by less.
    """
    by_change = _ahead(np.diff(first), np.diff(second))
    if by_change.likeness > ALIKE_CHANGES:
        return by_change
    return _ahead(first, second)


def _ahead(first: Array, second: Array) -> Lead:
    """The shift of the largest correlation, each over the samples that then overlap."""
    a, b = first - first.mean(), second - second.mean()
    n = len(a)
    if not np.any(a) or not np.any(b):
        return Lead(0.0, 0.0)
    length = 1 << int(np.ceil(np.log2(2 * n)))
    both = np.fft.irfft(np.conj(np.fft.rfft(a, length)) * np.fft.rfft(b, length), length)
    reach = max(1, int(LONGEST_LEAD * n))
    shift = np.arange(-reach, reach + 1)
    square_a, square_b = (np.concatenate([[0.0], np.cumsum(x**2)]) for x in (a, b))
    ahead, behind = np.maximum(shift, 0), np.maximum(-shift, 0)
    own = square_a[n - ahead] - square_a[behind]
    other = square_b[n - behind] - square_b[ahead]
    size = np.sqrt(np.maximum(own * other, 1e-300))
    likeness = np.concatenate([both[-reach:], both[: reach + 1]]) / size
    best, either = _nearest_match(likeness, reach)
    part = _vertex(np.abs(likeness), best)
    return Lead(best - reach + part, float(np.clip(likeness[best], -1.0, 1.0)), either)


def _nearest_match(likeness: Array, none: int) -> tuple[int, bool]:
    """The place of the match in likenesses over shifts (k,), of which `none` is that of no shift,
    and whether its sign is open. Between two matches the likeness changes its sign."""
    size = np.abs(likeness)
    cuts = np.flatnonzero(np.diff(np.sign(likeness))) + 1
    tops = [int(part[np.argmax(size[part])]) for part in np.split(np.arange(len(size)), cuts)]
    near = [at for at in tops if size[at] >= (1.0 - AS_ALIKE) * size.max()]
    near.sort(key=lambda at: abs(at - none))
    turned = next((at for at in near if likeness[at] < 0.0 and at >= none), None)
    plain = next((at for at in near if likeness[at] > 0.0), None)
    if plain is None:
        return int(np.argmax(size)), False
    if turned is not None and turned - none < abs(plain - none):
        return turned, True
    return plain, False


def _vertex(x: Array, at: int) -> float:
    """How far the parabola through three samples around the largest has its vertex beside it."""
    if not 0 < at < len(x) - 1:
        return 0.0
    left, here, right = x[at - 1 : at + 2]
    bend = left - 2.0 * here + right
    return 0.0 if bend == 0.0 else float(np.clip(0.5 * (left - right) / bend, -0.5, 0.5))


def actuator_share(F: Array, v: Array, u: Array, cutoff: float) -> tuple[float, float]:
    """How much of the change of a force (n,) is k1 u - k2 v + const, and the sign of k1.

    cutoff: of the smoothing that `v` has had, in samples.
    """
    F, u = low_pass(F, 1.0, cutoff), low_pass(u, 1.0, cutoff)
    share = changed_by(F[:, None], beside(u[:, None], v), v)[0, 0]
    return float(abs(share)), float(np.sign(share)) or 1.0


def beside(x: Array, v: Array) -> Array:
    """What of signals (n, k) is neither v (n,) nor constant."""
    base, _ = np.linalg.qr(np.column_stack([v, np.ones(len(v))]))
    return np.asarray(x - base @ (base.T @ x))


def changed_by(F: Array, u: Array, v: Array) -> Array:
    """How much of the change of each signal of F (n, j) is k1 u, with the sign of k1, (j, k).

    u (n, k): what of the commands is neither v (n,) nor constant; beside them k2 v + const.
    """
    rate = np.gradient(F, axis=0)
    spread = np.maximum(np.sum((rate - rate.mean(axis=0)) ** 2, axis=0), 1e-300)
    size = np.maximum(np.sum(u**2, axis=0), 1e-300)
    together = beside(rate, v).T @ u
    return np.asarray(np.sign(together) * together**2 / size / spread[:, None])


def _explained(X: Array, b: Array) -> tuple[Any, Array]:
    """Share of the variance of b (r,) or (r, j) that the columns (r, k) explain, and how."""
    size = np.sqrt(np.mean(X**2, axis=0))
    size[size == 0.0] = 1.0
    middle = b.mean(axis=0)
    theta = ((np.linalg.pinv(X / size, rcond=1e-10) @ b).T / size).T
    spread = np.mean((b - middle) ** 2, axis=0)
    # what is left of each, without making it: of many signals the longest part
    off = middle - X.mean(axis=0) @ theta
    square = np.mean(b**2, axis=0) - np.sum(theta * (X.T @ b), axis=0) / len(b)
    left = np.maximum(square - off**2, 0.0)
    share = np.maximum(0.0, 1.0 - left / np.where(spread > 0.0, spread, 1.0))
    return np.where(spread > 0.0, share, 0.0), theta


def command_lag(target: Array, others: Array, u: Array, longest: int) -> tuple[float, float]:
    """By how many samples a command acts late, and how much more of `target` it then explains.

    target (r,): the rest of the equation that the command drives, others (r, k): its other columns,
    u (r,): the command. The shift from 0 to `longest` samples that explains most, by a parabola
    between samples; rows at the start, which no shifted command reaches, are left out.
    """
    longest = min(longest, len(u) // 4)
    inside = slice(longest, len(u))
    shares = np.array([
        _explained(np.column_stack([u[longest - k : len(u) - k], others[inside]]),
                   target[inside])[0]
        for k in range(longest + 1)
    ])  # fmt: skip
    best = int(np.argmax(shares))
    return best + _vertex(shares, best), float(shares[best] - shares[0])
