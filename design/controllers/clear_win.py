"""Does one loop clearly win over another, on the machines that the model's errors allow?

Both follow strokes over the travel, at the speed and with the acceleration that the logs have shown
and slowly, and then a sine, on the same machines, with the noise of the logs: drawn by what the
model is not sure of, each with a lag that no log would have shown.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from design.closed_loop.drawn_plants import drawn_plants, in_loop
from design.closed_loop.driven_loop import DrivenLoop, run_plant
from design.closed_loop.loop_figures import risen_sine, speed_seen
from design.controllers.cascade import feed_forward, reference_limits, unseen_lag
from design.machine.drive import ForceLoop
from design.machine.model import Model
from design.servo import ServoRun
from identification.arrays import Array, BoolArray
from identification.effects._library import built_in
from identification.errors import UserError
from identification.model.plant import Plant

CLEARLY_LESS = 0.8  # of the other's root mean square error
SURELY_SHARE = 0.9  # of the machines drawn
NO_HARDER = 1.2  # times the other's largest force, or that of the logs
MACHINES_DRAWN = 8
STROKE_SHARE = 0.9  # of the travel
SLOW_STROKE = 0.25  # of the speed
LONGEST_STROKE = 10.0  # s
STROKE_DWELL = 0.3  # s
SINE_PERIODS = 2.5
LEAST_ERROR_RATIO = 1e-6  # that counts of an error
CORNER_SHARE = 0.5  # of the time in which a stroke comes to its speed, that its jerk takes
CONTEST_SEED = 50


@dataclass(frozen=True, eq=False)
class Contest:
    """Root mean square error (of strokes and of a sine, their geometric mean) and largest force of
    a loop over those of another, and whether it needs no more force, on each machine drawn, (k,).
    """

    error: Array
    force: Array
    borne: BoolArray

    @property
    def clear(self) -> bool:
        """Whether the loop wins clearly: on nearly all machines by much less error, on none by more
        force than is known of the machine."""
        wins = float(np.mean(self.error <= CLEARLY_LESS))
        return wins >= SURELY_SHARE and bool(np.all(self.borne))

    @property
    def words(self) -> str:
        """What came out, in words."""
        low, high = f"{np.min(self.error):.2g}", f"{np.max(self.error):.2g}"
        error = low if low == high else f"{low} to {high}"
        return (
            f"{error} times its error along strokes and a sine,"
            f" {np.max(self.force):.2g} times its force at most, on {len(self.error)} machines that"
            " the model's errors allow"
        )


def contest(model: Model, force: ForceLoop | None, one: DrivenLoop, other: DrivenLoop) -> Contest:
    """The first loop against the other."""
    machines = that_may_be(model, np.random.default_rng(CONTEST_SEED), MACHINES_DRAWN)
    paths = [tuple(path(model, force, each.h) for each in (one, other)) for path in (strokes, sine)]
    rows = []
    for seed, plant in enumerate(machines):
        each = [_compared(model, plant, (one, other), path, seed) for path in paths]
        error, most, borne = np.array(each).T
        rows.append((float(np.exp(np.mean(np.log(error)))), float(np.max(most)), np.all(borne)))
    found = np.array(rows, dtype=np.float64).T
    return Contest(found[0], found[1], found[2] > 0.0)


def that_may_be(model: Model, rng: np.random.Generator, count: int) -> tuple[Plant, ...]:
    """Machines drawn from a model's errors, each with a part of the lag that no log would show."""
    try:
        plants = drawn_plants(model, rng, count)
    except (UserError, np.linalg.LinAlgError):  # errors that make no machine
        plants = (in_loop(model),)
    late, delay = unseen_lag(model), built_in()["input_delay"]
    if not late:
        return plants
    lags = rng.uniform(0.0, late, len(plants)).tolist()
    return tuple(
        replace(plant, effects=(*plant.effects, delay.acting({"tau": lag})))
        for plant, lag in zip(plants, lags, strict=True)
    )


def strokes(model: Model, force: ForceLoop | None, h: float) -> Array:
    """Strokes over the travel as the logs have shown them, and slow ones [m], every h [s], (n,)."""
    middle, half, speed = _reach(model)
    _, hard = reference_limits(model, force, feed_forward(model, force))
    places = [(-half, 1.0), (half, 1.0), (-half, 1.0), (half, SLOW_STROKE), (-half, SLOW_STROKE)]
    here, parts = 0.0, [np.zeros(round(STROKE_DWELL / h))]
    for there, share in places:
        parts.append(here + _stroke(there - here, share * speed, hard, h))
        parts.append(np.full(round(STROKE_DWELL / h), there))
        here = there
    return np.asarray(middle + np.concatenate(parts), dtype=np.float64)


def sine(model: Model, _: ForceLoop | None, h: float) -> Array:
    """A sine over the travel [m], (n,), at most as fast as the logs, come to in half of its first
    period."""
    middle, half, speed = _reach(model)
    return np.asarray(middle + risen_sine(half, speed / half, h, SINE_PERIODS))


def _reach(model: Model) -> tuple[float, float, float]:
    """Middle of the travel and half of what is gone of it [m], and the speed of the logs [m/s]."""
    low, high = model.travel
    speed = speed_seen(model)
    half = min(0.5 * STROKE_SHARE * (high - low), 0.5 * LONGEST_STROKE * SLOW_STROKE * speed)
    return 0.5 * (low + high), half, speed


def _stroke(distance: float, speed: float, hard: float, h: float) -> Array:
    """A move over a distance [m] within speed and acceleration, from rest to rest, its corners
    rounded as those of a drive's set point are, (n,)."""
    speed = min(speed, float(np.sqrt(abs(distance) * hard)))
    rise, whole = speed / hard, abs(distance) / speed
    t = h * np.arange(int((whole + rise) / h) + 2)
    rates = np.clip(np.minimum(t / rise, (whole + rise - t) / rise), 0.0, 1.0)
    round_off = np.ones(max(round(CORNER_SHARE * rise / h), 1))
    place = np.cumsum(np.convolve(rates, round_off / len(round_off)))
    return np.asarray(distance * place / place[-1], dtype=np.float64)


def _compared(
    model: Model, plant: Plant, loops: Sequence[DrivenLoop], paths: Sequence[Array], seed: int
) -> tuple[float, float, bool]:
    """Error and largest force of the first loop over those of the other, each along its path, and
    whether it takes hardly more force than that one, or than the logs have shown."""
    ours, theirs = (_run(model, plant, *each, seed) for each in zip(loops, paths, strict=True))
    if ours is None:
        return np.inf, np.inf, False
    if theirs is None:
        return LEAST_ERROR_RATIO, LEAST_ERROR_RATIO, True
    error, other = (float(np.sqrt(np.mean((run.r - run.y) ** 2))) for run in (ours, theirs))
    most, its = (float(np.max(np.abs(run.F))) for run in (ours, theirs))
    borne = most <= NO_HARDER * max(model.force_peak, its)
    return max(error / other, LEAST_ERROR_RATIO), most / its, borne


def _run(model: Model, plant: Plant, loop: DrivenLoop, r: Array, seed: int) -> ServoRun | None:
    """The run of a loop on one machine; None where it runs away."""
    try:
        return run_plant(model, plant, loop, r, np.random.default_rng(seed))
    except UserError:
        return None
