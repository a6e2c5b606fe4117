"""Poles chosen for a robust loop: a small search over dominant and auxiliary poles.

Ours. Stable, well damped plant poles are kept as closed-loop poles (moving them costs robustness
and buys nothing; Landau & Zito, section 3.6), the other poles lie on the real axis, faster than
the dominant ones. Of the loops that keep the margins, the fastest is taken; `design.tracking`
then chooses T.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import cache, partial

import numpy as np

from design.dominant_pid import DominantPID
from design.drawn_loops import DrawnPlants, loop_margins
from design.margins import Margins, margins, modulus_margin
from design.pid import PID, design_pid, pid_gains
from design.polynomial import ComplexArray, frequency_and_damping, roots, trim
from design.rst import RST, design_rst
from design.specification import (
    RSTSpecification,
    dominant_polynomial,
    normalised_plant,
    pole_pair,
)
from design.tracking import (
    Demand,
    Followed,
    Plants,
    followed,
    integrates,
    pid_candidates,
    rst_candidates,
)
from identification.arrays import Array
from identification.errors import BadSpecification

FREQUENCIES_TRIED = 20  # dominant w_n tried, evenly spaced in log
SLOWEST, FASTEST = 0.005, 0.6  # w_n h [rad]
DAMPINGS = (1.0, 0.8)
RATIOS = (3.0, 6.0, 1.5)  # auxiliary poles, in units of w_n
UNMOVED_POLE = 0.9  # |z| of a plant pole up to which it may stay a closed-loop pole
DAMPED, LEAST_DAMPED = 0.5, 0.3  # damping from which it may; the second beside slow zeros
LAGGARD = 0.5  # decay of the slowest pole, in units of the dominant ones', below which they are not
SLOWEST_ZERO = 0.9995  # a plant zero nearer to 1 would never decay
SAME_AS_ZERO = 1e-4  # between a pole and the zero it was placed on
SURELY = 0.97  # of a goal, below which a quick check of the margins decides that it is missed
NEAREST = 12  # loops that miss a goal, of which the margins are known where none keeps all
SWINGING = 0.15  # damping below which a pole or zero of a plant is that of an elastic part
SWINGS_ON = 0.5  # of its decay without a loop, that an elastic part may decay with in one
USUAL_DEMAND = Demand()


@dataclass(frozen=True)
class Goals:
    """What a loop must keep: modulus margin [-], delay margin in samples, largest |S_up| [dB].

    effort bounds the force that measurement noise may ask for; None for no bound. fastest: largest
    dominant w_n [rad/s] of a search, None for any.
    """

    modulus: float = 0.5
    delay: float = 2.0
    effort: float | None = None
    fastest: float | None = None


@dataclass(frozen=True)
class Asked:
    """A specification by hand: dominant (w_n [rad/s], zeta), auxiliary poles z; None: searched.

    whole: the machine's plant (A, B), whose margins count, where poles are placed on its body
    alone.
    """

    dominant: tuple[float, float] | None = None
    auxiliary: tuple[complex, ...] | None = None
    integrator: bool = True
    whole: tuple[Array, Array] | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, eq=False)
class Placed:
    """A controller with its margins, the poles it was asked for, and what it misses, if so.

    worst: least modulus margin over all plants, None: unstable on one. missed: goals not kept, in
    words; () where all are. pid: the PID's own form.
    """

    rst: RST
    margins: Margins
    worst: float | None
    dominant: tuple[float, float]
    auxiliary: tuple[complex, ...]
    missed: tuple[str, ...]
    pid: PID | None


@dataclass(frozen=True, eq=False)
class Tuned(Placed):
    """A placed controller and how it takes its reference."""

    followed: Followed


# The least modulus margin inside the parameters' intervals, of which that of the nominal plant is
# given, and the goals that are missed there.
Inside = Callable[[RST, float], tuple[float | None, tuple[str, ...]]]
Design = Callable[[tuple[float, float], tuple[complex, ...]], tuple[RST, PID | None]]


def tune_rst(
    A: Array,
    B: Array,
    h: float,
    asked: Asked,
    goals: Goals,
    corners: Plants = (),
    demand: Demand = USUAL_DEMAND,
    drawn: DrawnPlants | None = None,
) -> Tuned:
    """The fastest RST within the goals, or the one asked for; A, B in z^-1, h [s].

    corners: other plants (A, B) on which the modulus margin must hold too; drawn: where given, the
    goals must hold on so many of these instead. R holds 1 + z^-1, so that noise at half the
    sampling rate does not reach the force. T: see `design.tracking`.
    Raises BadSpecification with the first reason where no poles of the search give a stable loop.
    """
    A, B = normalised_plant(A, B)
    H_S = [1.0, -1.0] if asked.integrator else [1.0]

    def design(
        dominant: tuple[float, float], auxiliary: tuple[complex, ...]
    ) -> tuple[RST, PID | None]:
        wanted = RSTSpecification(dominant, auxiliary, H_R=[1.0, 1.0], H_S=H_S, T="unit-static")
        return design_rst(A, B, h, wanted), None

    free = A.size - 1 + B.size - 1 + len(H_S) - 1 - 2
    others = _auxiliary(A, h, max(free, 0))
    plants = (asked.whole or (A, B), *corners)
    holds = _inside(plants, goals, drawn)
    found = _best(plants, h, asked, goals, design, others, holds)
    slow = _slow_zeros(B)[:free]
    if found.missed and slow and asked.auxiliary is None:
        beside = _auxiliary(A, h, free, slow)
        again = _best(plants, h, asked, goals, design, beside, holds, slow)
        found = found if again.missed else again
    moving = [z for z in found.auxiliary if z not in slow]  # y/r has no pole at a plant zero
    poles = np.append(np.array(moving, dtype=np.complex128), pole_pair(*found.dominant, h))
    candidates = rst_candidates(A, B, found.rst, poles, len(poles))
    return _following(plants, found, candidates, demand)


def tune_pid(
    A: Array,
    B: Array,
    h: float,
    asked: Asked,
    goals: Goals,
    corners: Plants = (),
    demand: Demand = USUAL_DEMAND,
    drawn: DrawnPlants | None = None,
) -> Tuned:
    """The fastest digital PID within the goals, or the one asked for; see `tune_rst`.

    T has two degrees, which are set-point weights. Raises BadSpecification with the first reason
    where none gives a stable loop.
    """
    A, B = normalised_plant(A, B)

    @cache
    def freedom(dominant: tuple[float, float]) -> DominantPID:
        return DominantPID.of(A, B, dominant_polynomial(dominant, h), h)

    def design(
        dominant: tuple[float, float], auxiliary: tuple[complex, ...]
    ) -> tuple[RST, PID | None]:
        found = design_pid(
            A, B, h, dominant=dominant, auxiliary=auxiliary, freedom=partial(freedom, dominant)
        )
        return found.rst, found

    others = _auxiliary(A, h, min(A.size - 1, 2))
    plants = (asked.whole or (A, B), *corners)
    found = _best(plants, h, asked, goals, design, others, _inside(plants, goals, drawn))
    if found.pid is not None and found.pid.gains is not None:
        candidates = pid_candidates(found.pid.gains, h)
    else:
        candidates = rst_candidates(A, B, found.rst, found.margins.poles, 2)
    return _following(plants, found, candidates, demand)


def _following(plants: Plants, found: Placed, candidates: Iterable[Array], demand: Demand) -> Tuned:
    """The controller with the best T of the candidates, and the overshoot where it has too much."""
    chosen = followed(plants, found.rst, candidates, demand)
    rst, pid, missed = replace(found.rst, T=chosen.T), found.pid, found.missed
    if chosen.overshoot > demand.overshoot:
        missed = (
            *missed,
            f"a step overshoots by {100 * chosen.overshoot:.1f} %, at most"
            f" {100 * demand.overshoot:g} % allowed",
        )
    if pid is not None:
        gains = None if pid.gains is None else pid_gains(rst)
        pid = replace(pid, rst=rst, gains=gains)
    return Tuned(
        rst=rst,
        margins=found.margins,
        worst=found.worst,
        dominant=found.dominant,
        auxiliary=found.auxiliary,
        missed=missed,
        pid=pid,
        followed=chosen,
    )


def _slow_zeros(B: Array) -> tuple[complex, ...]:
    """Real plant zeros between KEPT_POLE and 1, the slowest first: a slow loop inside the plant.

    Beside such a zero lies a plant pole as slow, which a fast closed loop would have to move by
    brute force. Kept as closed-loop poles, they leave y/r alone and decay after a disturbance.
    """
    real = [z.real for z in roots(trim(B[np.flatnonzero(B)[0] :])) if abs(z.imag) < 1e-9]
    return tuple(complex(z) for z in sorted(real, reverse=True) if UNMOVED_POLE < z < SLOWEST_ZERO)


def _auxiliary(
    A: Array, h: float, count: int, first: tuple[complex, ...] = ()
) -> Callable[[float], tuple[complex, ...]]:
    """Auxiliary poles for a given speed [rad/s]: `first`, kept plant poles, equal real ones."""
    count -= len(first)
    unmoved = _unmoved(roots(A), h, LEAST_DAMPED if first else DAMPED)[:count]
    unmoved = unmoved[:-1] if len(unmoved) and unmoved[-1].imag > 0 else unmoved

    def poles(speed: float) -> tuple[complex, ...]:
        real = complex(math.exp(-speed * h))
        return (*first, *(complex(z) for z in unmoved), *[real] * (count - len(unmoved)))

    return poles


def _unmoved(poles: ComplexArray, h: float, damped: float) -> ComplexArray:
    """Plant poles that may stay: fast and damped; conjugates side by side, positive one first."""
    fit = [
        complex(z)
        for z in poles
        if 1e-6 < abs(z) <= UNMOVED_POLE
        and (z.real > 0 and frequency_and_damping(complex(z), h)[1] > damped)
    ]
    return np.array(sorted(fit, key=lambda z: (abs(z), z.real, -z.imag)), dtype=np.complex128)


def _best(
    plants: Plants,
    h: float,
    asked: Asked,
    goals: Goals,
    design: Design,
    auxiliary: Callable[[float], tuple[complex, ...]],
    inside: Inside,
    slow: tuple[complex, ...] = (),
) -> Placed:
    """The fastest that keeps every goal, or what comes nearest; slow: poles left where they are."""
    refusal: BadSpecification | None = None
    found: list[Placed] = []
    hopeless: list[tuple[float, Callable[[], Placed]]] = []
    for dominant, candidates in _grid(h, asked, goals.fastest, auxiliary):
        for others in candidates:
            try:
                controller, pid = design(dominant, others)
                judge: Callable[[], Placed] = partial(
                    _judged, plants, goals, controller, pid, (dominant, others),
                    slow, inside,
                    search=asked.auxiliary is None,
                )  # fmt: skip
                modulus, far_off = _quick_check(plants[0], controller, goals)
                if far_off:
                    hopeless.append((modulus, judge))
                else:
                    found.append(judge())
            except BadSpecification as error:
                refusal = refusal or error
        admissible = [one for one in found if not one.missed]
        if admissible:
            return max(admissible, key=lambda one: one.worst or 0.0)
    for _, judge in sorted(hopeless, key=lambda one: -one[0])[:NEAREST]:
        try:
            found.append(judge())
        except BadSpecification as error:
            refusal = refusal or error
    if not found:
        raise refusal or BadSpecification("no poles to try; give --poles w_n,zeta")
    # None keeps every goal: the one nearest to it on all plants.
    taken = max(found, key=lambda one: (one.rst.stable, len(one.missed) <= 1, one.worst or 0.0))
    return replace(taken, worst=worst_modulus(plants, taken.rst))


def _quick_check(plant: tuple[Array, Array], controller: RST, goals: Goals) -> tuple[float, bool]:
    """A loop's modulus margin, and whether it misses a goal by too much to look any closer."""
    A, B = plant
    quick = loop_margins(A[np.newaxis], B[np.newaxis], controller)
    effort = np.inf if goals.effort is None else 10.0 ** (goals.effort / 20.0)
    modulus = float(quick.modulus[0])
    return modulus, bool(
        modulus < SURELY * goals.modulus
        or quick.delay[0] < SURELY * goals.delay
        or SURELY * quick.effort[0] > effort
    )


def _judged(
    plants: Plants, goals: Goals, controller: RST, pid: PID | None,
    poles: tuple[tuple[float, float], tuple[complex, ...]], slow: tuple[complex, ...],
    inside: Inside, *, search: bool,
) -> Placed:  # fmt: skip
    """A placed controller with its margins and what it misses.

    Raises BadSpecification where it has no margins.
    """
    A, B = plants[0]
    margin = margins(A, B, controller)
    missed = goals_missed(margin, goals, integrates(A, controller))
    if search:
        missed = (*missed, *_laggards(margin, poles[0], slow, swinging_decay(A, B, controller.h)))
    worst: float | None = margin.modulus
    if not missed:
        worst, missed = inside(controller, margin.modulus)
    if not controller.stable:
        missed = (*missed, "the controller itself has a pole outside the unit circle")
    return Placed(controller, margin, worst, *poles, missed, pid)


def worst_modulus(plants: Plants, controller: RST, least: float = math.inf) -> float | None:
    """Least modulus margin over the plants; None where one of the loops is unstable.

    least: that over other plants.
    """
    try:
        return min((least, *(modulus_margin(A, B, controller) for A, B in plants)))
    except BadSpecification:
        return None


def _inside(plants: Plants, goals: Goals, drawn: DrawnPlants | None) -> Inside:
    """What a controller misses on plants other than the first: on any of the corners, or on too
    many of those drawn."""

    def of(controller: RST, nominal: float) -> tuple[float | None, tuple[str, ...]]:
        if drawn is not None and (missed := drawn.missed(controller, goals)):
            return None, missed
        worst = worst_modulus(plants[1:], controller, nominal)
        return worst, () if drawn is not None else _worst_missed(worst, goals)

    return of


def _worst_missed(worst: float | None, goals: Goals) -> tuple[str, ...]:
    if worst is None:
        return ("unstable on a plant inside the parameters' intervals",)
    if worst < goals.modulus:
        return (f"modulus margin {worst:.3f} inside the parameters' intervals",)
    return ()


def swinging_decay(A: Array, B: Array, h: float) -> float:
    """How slowly a plant's own swinging decays [1/s]: the least of its poles and zeros that swing,
    which a loop moves from the ones to the others; infinite where none does."""
    every = [complex(z) for c in (A, trim(B[np.flatnonzero(B)[0] :])) for z in roots(c)]
    return min((-math.log(abs(z)) / h for z in every if _swings(z, h)), default=math.inf)


def _swings(z: complex, h: float) -> bool:
    """Whether a pole or zero is that of an elastic part."""
    if not (1e-6 < abs(z) < 1.0 and abs(z.imag) > 1e-9):
        return False
    return frequency_and_damping(z, h)[1] < SWINGING


def _laggards(
    found: Margins, dominant: tuple[float, float], slow: tuple[complex, ...], swinging: float
) -> tuple[str, ...]:
    """Whether a pole is so slow that the dominant ones do not dominate, in words.

    swinging: decay [1/s] of an elastic part, which no loop hastens that leaves it alone.
    """
    h = found.h

    def waited_for(z: complex) -> bool:
        if any(abs(z - one) <= SAME_AS_ZERO for one in slow):
            return False
        return not (_swings(z, h) and -math.log(abs(z)) / h > SWINGS_ON * swinging)

    moving = [abs(z) for z in found.poles.tolist() if waited_for(complex(z))]
    slowest = -math.log(max(*moving, 1e-12)) / found.h
    asked = -math.log(float(np.abs(pole_pair(*dominant, found.h)).max())) / found.h
    if slowest >= LAGGARD * asked:
        return ()
    return (f"a pole decays with {slowest:.3g} /s, the dominant ones with {asked:.3g} /s",)


def _grid(
    h: float,
    asked: Asked,
    fastest: float | None,
    auxiliary: Callable[[float], tuple[complex, ...]],
) -> Iterator[tuple[tuple[float, float], list[tuple[complex, ...]]]]:
    """Dominant poles, the fastest first, each with the auxiliary poles to try."""
    top = FASTEST / h if fastest is None else min(max(fastest, SLOWEST / h), FASTEST / h)
    frequencies: list[float] = np.geomspace(top, SLOWEST / h, FREQUENCIES_TRIED).tolist()
    pairs = [(w, zeta) for w in frequencies for zeta in DAMPINGS]
    for dominant in [asked.dominant] if asked.dominant else pairs:
        if asked.auxiliary is not None:
            yield dominant, [asked.auxiliary]
        else:
            yield dominant, [auxiliary(ratio * dominant[0]) for ratio in RATIOS]


def goals_missed(found: Margins, goals: Goals, integrates: bool) -> tuple[str, ...]:
    """The goals that a loop does not keep, in words; integrates: its gain is infinite at 0."""
    missed = []
    if integrates and found.delay_s is None:
        missed.append("the crossover is lost in rounding; sample more slowly")
    if found.modulus < goals.modulus:
        missed.append(f"modulus margin {found.modulus:.4g}, at least {goals.modulus:g} asked")
    if found.delay_s is not None and found.delay_s < goals.delay * found.h:
        samples = found.delay_s / found.h
        missed.append(f"delay margin {samples:.4g} samples, at least {goals.delay:g} asked")
    effort = found.S_up_max_db
    if goals.effort is not None and effort is not None and effort > goals.effort:
        missed.append(
            f"noise asks for {effort:.1f} dB of force, at most {goals.effort:.1f} allowed"
        )
    return tuple(missed)
