"""Sensitivity functions and stability margins of the loop A, B under an RST controller."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from design.polynomial import ComplexArray, describe_root, evaluate, roots
from design.rst import RST, closed_loop_poles
from design.specification import normalised_plant
from identification.arrays import Array
from identification.errors import BadSpecification

Curve = Callable[[Array], Array]
ROUNDING = 64 * float(np.finfo(np.float64).eps)
BRACKET_PASSES, BRACKET_POINTS = 10, 33  # each pass narrows a bracket 16 times


@dataclass(frozen=True, eq=False)
class Sensitivities:
    """The loop's frequency responses at w [rad/s], each of the shape of `w`.

    S_yp = A S/P: output disturbance to y [-]. S_up = -A R/P: the same to u. S_yb = -B R/P:
    measurement noise to y [-]. S_yv = B S/P: input disturbance to y. S_yr = B T B_m/(P A_m):
    reference to y [-]. Source: Landau & Zito, Digital Control Systems, section 2.6.
    """

    w: Array
    S_yp: ComplexArray
    S_up: ComplexArray
    S_yb: ComplexArray
    S_yv: ComplexArray
    S_yr: ComplexArray


@dataclass(frozen=True, eq=False)
class Margins:
    """How far a stable loop is from instability; frequencies in rad/s.

    modulus: least distance of L = B R/(A S) to -1, 1/max|S_yp|, at modulus_w.
    gain_up > 1, gain_down < 1: the loop stays stable for gains strictly between them, all
    crossings of the real axis counted; None: no larger (smaller, above 0) gain destabilises.
    phase_deg: least rotation [deg] that destabilises, at phase_w; None: |L| is never 1.
    delay_s: largest extra delay [s] under which, for every shorter one, the loop is stable, all
    crossings of |L| = 1 counted, at delay_w; None: no delay destabilises.
    S_yp_max_db, S_up_max_db: largest |S_yp|, |S_up| [dB]; S_up_max_db is None for R = 0.
    poles: closed-loop poles z, largest first.
    """

    modulus: float
    modulus_w: float
    gain_up: float | None
    gain_up_w: float | None
    gain_down: float | None
    gain_down_w: float | None
    phase_deg: float | None
    phase_w: float | None
    delay_s: float | None
    delay_w: float | None
    S_yp_max_db: float
    S_up_max_db: float | None
    S_up_max_w: float | None
    poles: ComplexArray
    h: float


@dataclass(frozen=True, eq=False)
class _Loop:
    """The factors of L = B R/(A S), evaluated at theta = w h in [0, pi]."""

    A: Array
    B: Array
    R: Array
    S: Array

    def both(self, theta: Array) -> tuple[ComplexArray, ComplexArray]:
        """B R and A S at theta."""
        z = np.exp(1j * theta)
        b, r, a, s = (evaluate(c, z) for c in (self.B, self.R, self.A, self.S))
        return b * r, a * s

    def output_sensitivity(self, theta: Array) -> Array:
        """|S_yp| at theta."""
        forward, back = self.both(theta)
        return np.abs(back / (back + forward))

    def input_sensitivity(self, theta: Array) -> Array:
        """|S_up| at theta."""
        z = np.exp(1j * theta)
        a, r = evaluate(self.A, z), evaluate(self.R, z)
        p = a * evaluate(self.S, z) + evaluate(self.B, z) * r
        return np.abs(a * r / p)

    def imaginary(self, theta: Array) -> Array:
        """Im L |A S|^2 at theta."""
        forward, back = self.both(theta)
        return np.imag(forward * np.conj(back))

    def excess(self, theta: Array) -> Array:
        """(|L|^2 - 1)|A S|^2 at theta."""
        forward, back = self.both(theta)
        return np.square(np.abs(forward)) - np.square(np.abs(back))

    def imaginary_noise(self, theta: Array) -> Array:
        """Rounding of `imaginary` at theta."""
        largest, largest_back = self.sizes()
        forward, back = self.both(theta)
        return ROUNDING * (largest * np.abs(back) + largest_back * np.abs(forward))

    def excess_noise(self, theta: Array) -> Array:
        """Rounding of `excess` at theta: far below its own size where both of its squares are."""
        largest, largest_back = self.sizes()
        forward, back = self.both(theta)
        return 2.0 * ROUNDING * (largest * np.abs(forward) + largest_back * np.abs(back))

    def sizes(self) -> tuple[float, float]:
        """Bounds of |B R| and |A S| on the unit circle: what rounding is measured against."""
        norms = [float(np.abs(c).sum()) for c in (self.B, self.R, self.A, self.S)]
        return norms[0] * norms[1], norms[2] * norms[3]


def sensitivities(A: ArrayLike, B: ArrayLike, controller: RST, w: ArrayLike) -> Sensitivities:
    """The sensitivity functions at frequencies w [rad/s], 0 <= w <= pi/h, shape (n,).

    Raises BadSpecification where a frequency is outside that range.
    """
    a_, b_ = normalised_plant(A, B)
    w_ = np.atleast_1d(np.array(w, dtype=np.float64))
    limit = np.pi / controller.h
    if not np.all((w_ >= 0) & (w_ <= limit * (1 + 1e-12))):
        raise BadSpecification(f"frequencies must lie in 0 to pi/h = {limit:g} rad/s")
    z = np.exp(1j * w_ * controller.h)
    a, b = evaluate(a_, z), evaluate(b_, z)
    r, s, t = (evaluate(c, z) for c in (controller.R, controller.S, controller.T))
    p = a * s + b * r
    model = evaluate(controller.B_m, z) / evaluate(controller.A_m, z)
    return Sensitivities(w_, a * s / p, -a * r / p, -b * r / p, b * s / p, b * t / p * model)


def margins(A: ArrayLike, B: ArrayLike, controller: RST) -> Margins:
    """The margins of the closed loop; A, B: plant in ascending powers of z^-1.

    Raises BadSpecification where the loop is not stable, naming the pole: it has no margin then.
    Accurate to about 1e-10 relative: a grid refined around every pole and zero, then zoomed.
    """
    loop, poles, grid = _stable_loop(A, B, controller)
    h = controller.h
    peak, peak_theta = _maximum(loop.output_sensitivity, grid)
    effort, effort_theta = _maximum(loop.input_sensitivity, grid)
    up, up_w, down, down_w = _gain_margins(loop, grid)
    phase, phase_w, delay, delay_w = _phase_and_delay_margins(loop, grid)
    return Margins(
        modulus=1 / peak,
        modulus_w=peak_theta / h,
        gain_up=up,
        gain_up_w=None if up_w is None else up_w / h,
        gain_down=down,
        gain_down_w=None if down_w is None else down_w / h,
        phase_deg=None if phase is None else float(np.degrees(phase)),
        phase_w=None if phase_w is None else phase_w / h,
        delay_s=None if delay is None else delay * h,
        delay_w=None if delay_w is None else delay_w / h,
        S_yp_max_db=20 * float(np.log10(peak)),
        S_up_max_db=20 * float(np.log10(effort)) if effort > 0 else None,
        S_up_max_w=effort_theta / h if effort > 0 else None,
        poles=poles,
        h=h,
    )


def modulus_margin(A: ArrayLike, B: ArrayLike, controller: RST) -> float:
    """The modulus margin alone, and what is refused, as `margins` has them: a fifth of its work."""
    loop, _, grid = _stable_loop(A, B, controller)
    return 1 / _maximum(loop.output_sensitivity, grid)[0]


def _stable_loop(A: ArrayLike, B: ArrayLike, controller: RST) -> tuple[_Loop, ComplexArray, Array]:
    """The loop, its poles, theta to look at; raises BadSpecification where it is unstable."""
    A, B = normalised_plant(A, B)
    poles = closed_loop_poles(A, B, controller)
    if poles.size and abs(poles[0]) >= 1:
        raise BadSpecification(
            f"the loop is unstable: pole {describe_root(complex(poles[0]), controller.h)} with "
            f"|z| = {abs(poles[0]):.6g}; an unstable loop has no margins, design another controller"
        )
    loop = _Loop(A, B, controller.R, controller.S)
    grid = _grid(poles, *(roots(c) for c in (A, B, controller.R, controller.S)))
    if not np.all(sum(loop.both(grid))):
        # A S and B R both vanish there: that the computed pole lies inside is rounding alone.
        raise BadSpecification(
            "a closed-loop pole lies on the unit circle but for rounding: no margins are defined;"
            " ask for faster poles"
        )
    return loop, poles, grid


def _grid(*groups: ComplexArray) -> Array:
    """theta from 0 to pi, dense where a root near the unit circle makes a response turn fast."""
    z = np.concatenate(groups)
    z = z[np.abs(z) > 1e-3]
    angle, distance = np.abs(np.angle(z)), np.maximum(np.abs(np.log(np.abs(z))), 1e-9)
    steps = np.concatenate([np.linspace(0, 3, 13), np.geomspace(4, 1e4, 24)])
    offsets = distance[:, None] * np.concatenate([-steps, steps])
    near = (angle[:, None] + offsets).ravel()
    theta = np.concatenate(
        [np.linspace(0, np.pi, 1025), np.geomspace(1e-8, np.pi, 400), near[near > 0]]
    )
    return np.unique(theta[theta <= np.pi])


def _maximum(curve: Curve, grid: Array) -> tuple[float, float]:
    """The largest value of the curve on [0, pi] and its place: every high peak zoomed into."""
    value = curve(grid)
    padded = np.concatenate([[-np.inf], value, [-np.inf]])
    peaks = (value >= padded[:-2]) & (value >= padded[2:]) & (value >= 0.5 * value.max())
    index = np.flatnonzero(peaks)
    index = index[np.argsort(-value[index])][:32]
    low, high = grid[np.maximum(index - 1, 0)], grid[np.minimum(index + 1, grid.size - 1)]
    best, place = float(value.max()), float(grid[value.argmax()])
    for _ in range(BRACKET_PASSES):
        theta = np.linspace(low, high, BRACKET_POINTS, axis=1)
        values = curve(theta.ravel()).reshape(theta.shape)
        k = values.argmax(axis=1)
        rows = np.arange(k.size)
        low, high = (
            theta[rows, np.maximum(k - 1, 0)],
            theta[rows, np.minimum(k + 1, BRACKET_POINTS - 1)],
        )
        top = int(values.max(axis=1).argmax())
        if values[top, k[top]] > best:
            best, place = float(values[top, k[top]]), float(theta[top, k[top]])
    return best, place


def _zeros(curve: Curve, grid: Array, noise: Curve) -> Array:
    """Where the curve changes sign inside (0, pi); values below `noise` are taken as unknown.

    Dips that come near zero between grid points are zoomed into, so that a pair of crossings
    closer than the grid is found too.
    """
    theta = grid[(grid > 0) & (grid < np.pi)]
    value = curve(theta)
    known = np.abs(value) > noise(theta)
    theta, value = theta[known], value[known]
    if theta.size < 3:
        return np.zeros(0)
    size = np.abs(value)
    dip = (size[1:-1] < size[:-2]) & (size[1:-1] < size[2:])
    same = (np.sign(value[1:-1]) == np.sign(value[:-2])) & (
        np.sign(value[1:-1]) == np.sign(value[2:])
    )
    extra = [np.linspace(theta[k], theta[k + 2], 257) for k in np.flatnonzero(dip & same)]
    if extra:
        theta = np.unique(np.concatenate([theta, *extra]))
        value = curve(theta)
        known = np.abs(value) > noise(theta)
        theta, value = theta[known], value[known]
    change = np.flatnonzero(np.sign(value[:-1]) != np.sign(value[1:]))
    return _narrow(curve, theta[change], theta[change + 1], np.sign(value[change]))


def _narrow(curve: Curve, low: Array, high: Array, sign: Array) -> Array:
    """The zeros of the curve in the brackets low to high, `sign` being the sign at low."""
    rows = np.arange(low.size)
    for _ in range(BRACKET_PASSES if low.size else 0):
        theta = np.linspace(low, high, BRACKET_POINTS, axis=1)
        values = curve(theta.ravel()).reshape(theta.shape)
        other = np.sign(values) != sign[:, None]
        other[:, -1] = True
        k = np.maximum(other.argmax(axis=1), 1)
        low, high = theta[rows, k - 1], theta[rows, k]
    return (low + high) / 2


def _gain_margins(
    loop: _Loop, grid: Array
) -> tuple[float | None, float | None, float | None, float | None]:
    """Least destabilising gain above 1, greatest below 1, each with its theta."""
    forward, back = loop.sizes()
    theta = np.concatenate([[0.0], _zeros(loop.imaginary, grid, loop.imaginary_noise), [np.pi]])
    n, d = loop.both(theta)
    known = (np.abs(n) > ROUNDING * forward) & (np.abs(d) > ROUNDING * back)
    theta, gain = theta[known], -np.real(d[known] / n[known])
    up, down = gain > 1, (gain > 0) & (gain < 1)
    out: list[float | None] = [None] * 4
    if np.any(up):
        k = int(np.argmin(np.where(up, gain, np.inf)))
        out[:2] = [float(gain[k]), float(theta[k])]
    if np.any(down):
        k = int(np.argmax(np.where(down, gain, -np.inf)))
        out[2:] = [float(gain[k]), float(theta[k])]
    return out[0], out[1], out[2], out[3]


def _phase_and_delay_margins(
    loop: _Loop, grid: Array
) -> tuple[float | None, float | None, float | None, float | None]:
    """Least phase [rad] and least delay [samples] over all crossings of |L| = 1, with theta."""
    theta = _zeros(loop.excess, grid, loop.excess_noise)
    forward, back = loop.both(theta)
    lag = np.mod(np.angle(forward * np.conj(back)) + np.pi, 2 * np.pi)
    phase, phase_theta = _least(np.minimum(lag, 2 * np.pi - lag), theta)
    delay, delay_theta = _least(lag / theta, theta)
    n, d = (float(one[0].real) for one in loop.both(np.array([np.pi])))
    if abs(n) > abs(d):
        # |L| > 1 up to pi/h: the response's ends at +-pi/h pass -1 within one sample of delay.
        limit = float(np.arccos(-d / n)) / np.pi
        if delay is None or limit < delay:
            delay, delay_theta = limit, float(np.pi)
    return phase, phase_theta, delay, delay_theta


def _least(values: Array, theta: Array) -> tuple[float | None, float | None]:
    """The least value and its theta, None where there is none."""
    if values.size == 0:
        return None, None
    k = int(np.argmin(values))
    return float(values[k]), float(theta[k])
