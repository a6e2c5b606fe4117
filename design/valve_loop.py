"""Position control of a valve and cylinder: P or PI, speed feedforward, dead zones compensated.

The command is the inverse of the valve's characteristic at the wanted speed
v = k_p e + k_i int(e) + dr/dt, so that what is left of the plant is a delay, a lag and an integral.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from design.margins import margins
from design.polynomial import add, multiply
from design.rst import RST
from identification.arrays import Array
from identification.errors import BadSpecification
from identification.velocity.model import SHORTEST_LAG, Valve, flows

INTEGRAL_OVER_LOOP = 6.0  # k_p T_i: the integral's time over the loop's
HALVINGS = 40
BOTH_GAINS = ("g_p", "g_n")
SLOW_END = "delay, lag, gains high"
SETTLING_CONSTANTS, LONGEST_RESPONSE = 8.0, 20_000  # time constants and periods of a step response
NEAR = 10.0  # bands from the target, within which the integral works


@dataclass(frozen=True)
class ValveController:
    """u from the error e = r - y [m]: k_p [1/s], k_i [1/s²], period h [s].

    g_p, g_n, d_p, d_n: the valve as the law has it, as in `Valve`. smooth [m/s]: wanted speed up to
    which the dead zone's offset grows in proportion; band [m]: error below which the integral
    rests, as it does beyond `NEAR` of them; limit: of the command's size, in its unit.
    """

    k_p: float
    k_i: float
    h: float
    g_p: float
    g_n: float
    d_p: float
    d_n: float
    smooth: float
    band: float
    limit: float

    def command(self, v: float) -> float:
        """The command that gives the speed v [m/s], within the limit."""
        share = min(abs(v) / self.smooth, 1.0) if self.smooth > 0.0 else float(v != 0.0)
        if v * self.g_p >= 0.0:
            u = v / self.g_p + share * self.d_p
        else:
            u = v / self.g_n - share * self.d_n
        return min(max(u, -self.limit), self.limit)

    @property
    def fastest(self) -> float:
        """The least of the speeds that the limit allows either way [m/s]."""
        ways = ((self.g_p, self.d_p), (self.g_n, self.d_n))
        return min(abs(g) * (self.limit - d) for g, d in ways)


@dataclass(frozen=True, eq=False)
class ValveLoopRun:
    """Reference, position and command of a simulated loop, each (n,), every h [s]."""

    r: Array
    y: Array
    u: Array
    h: float


def valve_plant(delay: float, lag: float, h: float) -> tuple[Array, Array]:
    """A, B of the position over the wanted speed, which a zero-order hold gives every h [s], behind
    a delay and a lag [s]."""
    whole = int(np.floor(delay / h))
    early = delay - whole * h
    late, lag = h - early, max(lag, SHORTEST_LAG)
    decay, decay_late = np.exp(-h / lag), np.exp(-late / lag)
    A = multiply(np.array([1.0, -1.0]), np.array([1.0, -decay]))
    flow = multiply(np.array([late, early]), np.array([1.0, -decay]))
    lagging = -lag * multiply(
        np.array([1.0, -1.0]), np.array([1.0 - decay_late, decay_late - decay])
    )
    return A, np.concatenate([np.zeros(whole + 1), add(flow, lagging)])


def valve_rst(k_p: float, k_i: float, h: float) -> RST:
    """The law's linear part as an RST controller."""
    if k_i == 0.0:
        R, S = np.array([k_p]), np.ones(1)
    else:
        R, S = np.array([k_p + k_i * h, -k_p]), np.array([1.0, -1.0])
    return RST(R=R, S=S, T=R, h=h)


def tuned(
    valve: Valve, h: float, *, gain: float = 1.0, modulus: float, delay_samples: float,
    overshoot: float, integrator: bool,
) -> tuple[float, float]:  # fmt: skip
    """k_p [1/s] and k_i [1/s²] of the fastest loop of period h [s] that keeps the goals.

    gain: the plant's over the law's; modulus: least modulus margin [-]; delay_samples: least delay
    margin in periods; overshoot: largest of a step, relative to it, without the integral, which
    rests then. Raises BadSpecification where no gain keeps them.
    """
    A, B = valve_plant(valve.delay, valve.lag, h)
    B = gain * B

    def meets_goals(k_p: float) -> bool:
        try:
            found = margins(
                A, B, valve_rst(k_p, k_p**2 / INTEGRAL_OVER_LOOP if integrator else 0.0, h)
            )
        except BadSpecification:
            return False
        slow = found.delay_s is None or found.delay_s >= delay_samples * h
        return bool(found.modulus >= modulus and slow and step_overshoot(A, B, k_p) <= overshoot)

    low, high = 1e-3 / (valve.delay + valve.lag + h), 2.0 / h
    if not meets_goals(low):
        raise BadSpecification(
            f"no gain gives a modulus margin of {modulus:g} and a delay margin of"
            f" {delay_samples:g} periods of {h:g} s behind a delay of {valve.delay:.3g} s and a lag"
            f" of {valve.lag:.3g} s; ask for less, by --modulus or --delay"
        )
    for _ in range(HALVINGS):
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if meets_goals(middle) else (low, middle)
    return low, low**2 / INTEGRAL_OVER_LOOP if integrator else 0.0


def step_overshoot(A: Array, B: Array, k_p: float) -> float:
    """Overshoot of the position's step, relative to it, under k_p [1/s] alone."""
    dies = int(
        np.ceil(SETTLING_CONSTANTS / (1.0 - float(np.max(np.abs(np.roots(add(A, k_p * B)))))))
    )
    y = lfilter(k_p * B, add(A, k_p * B), np.ones(min(dies, LONGEST_RESPONSE)))
    return float(np.max(y)) - 1.0


class _Plant:
    """The valve and cylinder a period at a time, each way through its lags in parallel."""

    def __init__(self, valve: Valve, h: float, u_max: float, travel: tuple[float, float]) -> None:
        self.valve, self.h, self.u_max, self.travel = valve, h, u_max, travel
        whole = int(np.floor(valve.delay / h))
        self.early = valve.delay - whole * h
        self.past = [(0.0, 0.0)] * (whole + 1)  # of both ways, the oldest first
        share = valve.second_lag
        self.parts = [
            (way, sign * factor / (1.0 - share), max(lag * ratio, SHORTEST_LAG))
            for way, sign, lag in ((0, 1.0, valve.lag),
                                   (1, -1.0, valve.lag * (1.0 + valve.lag_other)))
            for factor, ratio in ((1.0, 1.0), (-share, share)) if factor
        ]  # fmt: skip
        self.v = [0.0] * len(self.parts)
        self.y = 0.0

    def step(self, u: float) -> None:
        """Moves on by a period under the command u."""
        low, high = self.travel
        z = np.array([self.y / max(high - low, 1e-12)])
        w = flows(np.array([u]), self.valve, self.u_max, z)
        self.past.append((float(w[0][0]), float(w[1][0])))
        first, second = self.past[0], self.past[1]
        late = self.h - self.early
        for i, (way, factor, lag) in enumerate(self.parts):
            decay, decay_late = np.exp(-self.h / lag), np.exp(-late / lag)
            v = (
                decay * self.v[i]
                + (decay_late - decay) * first[way]
                + (1.0 - decay_late) * second[way]
            )
            flow = self.early * first[way] + late * second[way]
            self.y += factor * (flow - lag * (v - self.v[i]))
            self.v[i] = float(v)
        self.y += self.valve.creep * self.h
        self.past.pop(0)


def run_valve_loop(
    law: ValveController, valve: Valve, r: Array, noise: Array, u_max: float,
    travel: tuple[float, float] = (-0.5, 0.5),
) -> ValveLoopRun:  # fmt: skip
    """The loop of the law around the valve from rest at 0, along r (n,) [m].

    noise (n,): of the measured position [m]; u_max, travel [m]: to which the valve's curves and
    place are relative (`identification.velocity.model`); 0 is the middle of the travel.
    """
    plant, n = _Plant(valve, law.h, u_max, travel), len(r)
    y, u = np.empty(n), np.empty(n)
    whole, before = 0.0, float(r[0])
    for k in range(n):
        y[k] = plant.y
        e = float(r[k]) - plant.y - float(noise[k])
        wanted = law.k_p * e + (float(r[k]) - before) / law.h
        u[k] = law.command(wanted + whole)
        # Over a large step it would only overshoot; in the band it would hunt.
        if law.band < abs(e) < NEAR * law.band:
            whole += law.k_i * law.h * e
        before = float(r[k])
        plant.step(float(u[k]))
    return ValveLoopRun(r, y, u, law.h)


def at_edges(valve: Valve, low: Valve, high: Valve) -> dict[str, Valve]:
    """The valve with its dead zones, then delay, lag and gains, at the ends of their intervals."""
    largest = {name: max((getattr(x, name) for x in (low, high)), key=abs) for name in BOTH_GAINS}
    return {
        "dead zones narrow": replace(valve, d_p=low.d_p, d_n=low.d_n),
        "dead zones wide": replace(valve, d_p=high.d_p, d_n=high.d_n),
        SLOW_END: replace(valve, delay=high.delay, lag=high.lag, **largest),
    }
