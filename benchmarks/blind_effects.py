"""How large an effect of strength s is: its parameters from the machine's run without effects.

F_c: mean Coulomb level; A: half the travel; v95: speed that 5 % of the sliding exceeds; k = 1e4 N/m
turns a force into a length; band: mean width of the Karnopp band. "Drawn" is from the case's seed.

| effect | strength s means |
|---|---|
| stribeck | F_s = s F_c; v_s drawn, 2 to 4 bands |
| nonlinear_viscous | k v95^n = s F_c; n drawn, 1.5 to 3 (linear friction absorbs a part) |
| presliding | F_c/sigma_0 = s 0.5 mm |
| position_dependent_friction | sine of peak s F_c, period 0.3 to 1 A; or slope, s F_c at A |
| tight_spot | peak 2 s F_c within 0.6 A of the middle, width 0.08 to 0.25 A |
| pressure_dependent_friction | s F_c from smallest to largest in the run; both chambers or one |
| load_dependent_friction | mu rms(F in sliding) = s F_c |
| spring | k A = s F_c |
| cogging | peak s F_c, period drawn, 0.1 to 0.3 A |
| warmup | a = -s; b drawn: 0, or -s/2 of the viscous coefficient; tau 8 to 25 s |
| frictional_lag | root mean square s F_c in sliding, tau at most 0.2 s |
| rising_stiction | F_r = 2 s F_c, tau 1 s |
| end_cushion | both ends: peak s F_c at the run's extremes; begins at the 90 % of |y| |
| backlash | k width = s F_c |
| compliance | k flexibility rms(F) = s F_c |
| sensor_nonlinearity | s 5 % of A shown too much at A; quadratic or cubic, drawn |
| valve_dead_zone | u_d = s rms(u) |
| input_delay | 1 + log2(s/0.05) samples: 1 to 4; the force loop is slowed to bear it |
| leakage | leak = 5 s per second |

Asymmetries are drawn for a third of the cases, up to 30 %, where the effect has one.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from benchmarks.blind_machines import H, Machine, Run
from identification.arrays import Array
from identification.effects._base import Acting
from identification.effects._library import Library, built_in
from identification.simulation.effect_along_motion import contribution

REFERENCE_STIFFNESS = 1e4  # N/m
ABSORBED = frozenset({"constant_force", "gravity"})
# Effects that a log of this kind of machine cannot show: no command, no pressures, no leak.
HIDDEN: Mapping[str, frozenset[str]] = {
    "force": frozenset(
        {"leakage", "valve_dead_zone", "input_delay", "pressure_dependent_friction"}
    ),
    "motor": frozenset({"leakage", "pressure_dependent_friction"}),
    "electro-pneumatic": frozenset(),
}
PLACE: Mapping[str, str] = {
    "slip": "friction", "friction": "friction", "stiction": "stiction", "bristle": "rest",
    "force": "force", "actuator": "actuator", "command": "actuator", "delay": "actuator",
    "sensor": "sensor",
}  # fmt: skip
# An effect that holds another as a special case is taken out of the library together with it.
HOLDS: Mapping[str, tuple[str, ...]] = {"spring": ("end_cushion",)}
# Signals that stand for one another: chamber pressures follow the force, a motor's force its
# command; a body at rest has reversed or not; a delay shows where the command changes.
EQUIVALENT: Mapping[str, frozenset[str]] = {
    "F": frozenset({"F", "p_p", "p_n", "u"}),
    "u": frozenset({"u", "du", "F"}),
    "p_p": frozenset({"p_p", "p_n"}),
    "p_n": frozenset({"p_p", "p_n"}),
    "reversal": frozenset({"reversal", "rest"}),
    "rest": frozenset({"rest", "reversal"}),
}


@dataclass(frozen=True, eq=False)
class Place:
    """A machine's run without effects, as sizes need it."""

    machine: Machine
    signals: Mapping[str, Array]
    sliding: Array

    @property
    def coulomb(self) -> float:
        """F_c [N]."""
        return self.machine.coulomb

    @property
    def reach(self) -> float:
        """A [m]."""
        return 0.5 * float(np.ptp(self.signals["y"]))

    @property
    def v95(self) -> float:
        """Speed that 5 % of the sliding exceeds [m/s]."""
        return float(np.quantile(np.abs(self.signals["v"][self.sliding > 0]), 0.95))

    def rms(self, x: Array) -> float:
        """Root mean square of a signal in sliding."""
        return float(np.sqrt(np.mean(x[self.sliding > 0] ** 2)))


Values = dict[str, float]
Size = Callable[[float, Place, np.random.Generator], Values]


def place_of(one: Machine, run: Run) -> Place:
    """What sizes need of a run without effects."""
    true, nine = run.true, one.friction
    d = np.sign(true.v)
    signals = {"t": true.t, "y": true.y, "v": true.v, "F": true.F, "u": true.u, "d": d}
    moving = (true.v > nine.dv_p) | (true.v < nine.dv_n)
    return Place(one, {**signals, **run.pressures}, moving.astype(np.float64))


def stribeck(s: float, at: Place, rng: np.random.Generator) -> Values:
    nine = at.machine.friction
    return {"F_s": s * at.coulomb, "v_s": rng.uniform(2, 4) * 0.5 * (nine.dv_p - nine.dv_n)}


def nonlinear_viscous(s: float, at: Place, rng: np.random.Generator) -> Values:
    n = rng.uniform(1.5, 3.0)
    return {"k": s * at.coulomb / at.v95**n, "n": n}


def presliding(s: float, at: Place, rng: np.random.Generator) -> Values:
    return {"sigma_0": at.coulomb / (s * 5e-4)}


def position_dependent_friction(s: float, at: Place, rng: np.random.Generator) -> Values:
    period, phase = at.reach * rng.uniform(0.3, 1.0), rng.uniform(0.0, 2 * np.pi)
    size = s * at.coulomb
    if rng.random() < 0.5:
        a, b = size * np.cos(phase), size * np.sin(phase)
        return {"a": a, "b": b, "c1": 0.0, "c2": 0.0, "period": period}
    slope = float(rng.choice([-1.0, 1.0])) * size / at.reach
    return {"a": 0.0, "b": 0.0, "c1": slope, "c2": 0.0, "period": period}


def tight_spot(s: float, at: Place, rng: np.random.Generator) -> Values:
    place, width = at.reach * rng.uniform(-0.6, 0.6), at.reach * rng.uniform(0.08, 0.25)
    return {"size": 2.0 * s * at.coulomb, "y_0": place, "width": width}


def pressure_dependent_friction(s: float, at: Place, rng: np.random.Generator) -> Values:
    p_p, p_n = at.signals["p_p"], at.signals["p_n"]
    if rng.random() < 0.5:
        mu = s * at.coulomb / float(np.ptp(p_p + p_n))
        return {"mu_p": mu, "mu_n": mu}
    return {"mu_p": s * at.coulomb / float(np.ptp(p_p)), "mu_n": 0.0}


def load_dependent_friction(s: float, at: Place, rng: np.random.Generator) -> Values:
    return {"mu": s * at.coulomb / at.rms(at.signals["F"])}


def spring(s: float, at: Place, rng: np.random.Generator) -> Values:
    return {"k": s * at.coulomb / at.reach}


def cogging(s: float, at: Place, rng: np.random.Generator) -> Values:
    period, phase = at.reach * rng.uniform(0.1, 0.3), rng.uniform(0.0, 2 * np.pi)
    size = s * at.coulomb
    return {"a": size * np.cos(phase), "b": size * np.sin(phase), "period": period}


def warmup(s: float, at: Place, rng: np.random.Generator) -> Values:
    nine = at.machine.friction
    b = -0.5 * s * 0.5 * (nine.F_vp + nine.F_vn) if rng.random() < 0.5 else 0.0
    return {"a": -s, "b": b, "tau": rng.uniform(8.0, 25.0)}


def frictional_lag(s: float, at: Place, rng: np.random.Generator) -> Values:
    effect = built_in()["frictional_lag"]
    low, high = 1e-4, 0.2
    for _ in range(25):
        tau = float(np.sqrt(low * high))
        x = contribution(effect, {"tau": tau}, at.signals, H, at.machine.friction)
        low, high = (tau, high) if at.rms(x) < s * at.coulomb else (low, tau)
    return {"tau": float(np.sqrt(low * high))}


def rising_stiction(s: float, at: Place, rng: np.random.Generator) -> Values:
    return {"F_r": 2.0 * s * at.coulomb, "tau": 1.0}


def end_cushion(s: float, at: Place, rng: np.random.Generator) -> Values:
    y = at.signals["y"]
    high, low = float(np.max(y)), float(np.min(y))
    middle, begins = 0.5 * (high + low), float(np.quantile(np.abs(y - 0.5 * (high + low)), 0.9))
    begins = min(begins, 0.9 * at.reach)
    k = s * at.coulomb / (at.reach - begins)
    return {"k_p": k, "k_n": k, "y_p": middle + begins, "y_n": middle - begins}


def backlash(s: float, at: Place, rng: np.random.Generator) -> Values:
    return {"width": s * at.coulomb / REFERENCE_STIFFNESS}


def compliance(s: float, at: Place, rng: np.random.Generator) -> Values:
    return {"flexibility": s * at.coulomb / REFERENCE_STIFFNESS / at.rms(at.signals["F"])}


def sensor_nonlinearity(s: float, at: Place, rng: np.random.Generator) -> Values:
    bend = 0.05 * s
    if rng.random() < 0.5:
        return {"a": bend / at.reach, "b": 0.0}
    return {"a": 0.0, "b": bend / at.reach**2}


def valve_dead_zone(s: float, at: Place, rng: np.random.Generator) -> Values:
    return {"u_d": s * float(np.sqrt(np.mean(at.signals["u"] ** 2)))}


def input_delay(s: float, at: Place, rng: np.random.Generator) -> Values:
    return {"tau": H * max(0.5, 1.0 + float(np.log2(s / 0.05)))}


def leakage(s: float, at: Place, rng: np.random.Generator) -> Values:
    return {"leak": 5.0 * s}


SIZES: Mapping[str, Size] = {
    one.__name__: one
    for one in (
        stribeck, nonlinear_viscous, presliding, position_dependent_friction,
        pressure_dependent_friction, load_dependent_friction, spring, cogging, warmup,
        frictional_lag, rising_stiction, end_cushion, backlash, compliance, sensor_nonlinearity,
        valve_dead_zone, input_delay, leakage, tight_spot,
    )
}  # fmt: skip


def acting(key: str, s: float, at: Place, library: Library, rng: np.random.Generator) -> Acting:
    """The effect at strength s on this machine."""
    effect, values = library[key], SIZES[key](s, at, rng)
    uneven = "asymmetry" in effect.names and rng.random() < 1 / 3
    if uneven:
        values["asymmetry"] = rng.uniform(-0.3, 0.3)
    return effect.acting(values)


def shows(key: str, one: Machine) -> bool:
    """Whether the machine's logs can show the effect."""
    return key not in HIDDEN[one.kind]


def right_signals(depends_on: tuple[str, ...]) -> frozenset[str]:
    """Signals any of which is a right answer where an effect that depends on these is unknown."""
    return frozenset().union(*(EQUIVALENT.get(name, frozenset({name})) for name in depends_on))
