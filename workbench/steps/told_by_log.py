"""What the motion in a log can tell of each parameter, by the thresholds of the estimates."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array
from identification.estimation.estimates import Events, silent_reason
from identification.estimation.imposed_motion import fit_imposed
from identification.estimation.recorded_logs import NO_NOISE, RecordedLogs
from identification.estimation.regression.equation_rows import FIVE, MotionLog, mechanical
from identification.estimation.regression.standstill import Breakaways
from identification.estimation.regression.weighted_rows import solve_rows, stacked
from identification.experiment.identifiability import Tellable, identifiability
from identification.model.karnopp import NAMES
from identification.thresholds import EVENTS_NEEDED, WIDEST_SD
from workbench.documents.model import Told

QUICK_SPEED, SLOW_SPEED = 0.95, 0.05  # quantiles of the speeds of a direction
# Starts and stops with which a fit surely has EVENTS_NEEDED (benchmarks/gate.py, seeds below 1500)
SURE_CROSSINGS = 4 * EVENTS_NEEDED
MEND = {
    "m": "add faster reversals, in which inertia matters",
    "F_c": "add slow strokes both ways",
    "F_v": "add strokes at other speeds, at least four times apart",
    "dv_": "add starts and stops, and log them faster",
    "F_s": "add slow reversals, each after a rest",
    "k": "log the command while it moves the body",
}


@dataclass(frozen=True)
class Way:
    """One direction: seconds of sure motion, slowest and fastest speed (5 and 95 %), starts from
    rest, and breakaways of which the force can be read."""

    seconds: float
    slow: float
    fast: float
    starts: int
    breakaways: int


@dataclass(frozen=True)
class Ways:
    """Both directions, reversals, rests and their seconds in all, and the events as the estimates
    count them."""

    positive: Way
    negative: Way
    reversals: int
    rests: int
    rested: float
    events: Events


def ways_of(
    logs: Sequence[MotionLog],
    events: Sequence[Breakaways],
    rests: Sequence[Sequence[tuple[int, int]]],
) -> Ways:
    """What moved, in which direction, from the measured motion."""
    sides = [_side(logs, events, rests, sign) for sign in (1.0, -1.0)]
    stretches = [b - a for own in rests for a, b in own]
    h = logs[0].log.h
    crossings = [2 * one.starts for one in sides]
    return Ways(
        positive=sides[0],
        negative=sides[1],
        reversals=sum(_reversals(one.signals["d"]) for one in logs),
        rests=len(stretches),
        rested=float(sum(stretches)) * h,
        events=Events(
            breakaways=(sides[0].breakaways, sides[1].breakaways),
            crossings=(crossings[0], crossings[1]),
            sliding=(round(sides[0].seconds / h), round(sides[1].seconds / h)),
            fastest=(sides[0].fast, sides[1].fast),
        ),
    )


def _side(
    logs: Sequence[MotionLog],
    events: Sequence[Breakaways],
    rests: Sequence[Sequence[tuple[int, int]]],
    sign: float,
) -> Way:
    speed = np.concatenate([np.abs(one.signals["v"])[one.signals["d"] == sign] for one in logs])
    starts = 0
    for one, own in zip(logs, rests, strict=True):
        after = [b for _, b in own if b < len(one.log)]
        starts += int(np.sum(one.signals["d"][after] == sign)) if after else 0
    slow, fast = np.quantile(speed, [SLOW_SPEED, QUICK_SPEED]) if len(speed) else (0.0, 0.0)
    told = sum(int(np.sum(one.direction == sign)) for one in events)
    return Way(len(speed) * logs[0].log.h, float(slow), float(fast), starts, told)


def _reversals(d: Array) -> int:
    sure = d[d != 0]
    return int(np.count_nonzero(sure[1:] != sure[:-1]))


def told_by(
    recorded: RecordedLogs, ways: Ways, *, imposed: bool, actuator: bool | None
) -> tuple[Told, ...]:
    """Whether each of the nine, and of the actuator's parameters, can be told.

    imposed: a rig leads the body; actuator: whether the force follows the command, None without.
    Raises NotIdentifiable where a rig leads the body and it does not slide in both directions.
    """
    if imposed:
        out = _along_a_path(recorded)
    else:
        spread, run = _spreads(recorded), identifiability(recorded)
        out = [_by_run(_of_nine(n, recorded, ways, spread), run.get(n)) for n in NAMES]
    if actuator is not None:
        why = (
            "the force follows the command as a linear actuator's"
            if actuator
            else "the force does not follow the command as a linear actuator's"
        )
        out += [Told(name, actuator, why) for name in ("k1", "k2")]
    elif not recorded.held:
        out += [Told(name, False, "no command is logged", MEND["k"]) for name in ("k1", "k2")]
    return tuple(out)


def _by_run(one: Told, run: Tellable | None) -> Told:
    """What the counts say, and how well the free run would tell it."""
    if run is None or not one.can:
        return one
    if not run.can:
        key = one.name if one.name in MEND else one.name[:3]
        size = "by more than its size" if not run.within < 1.0 else f"by {run.within:.0%}"
        return Told(one.name, False, f"its free run leaves it unsure {size}", MEND[key])
    return replace(one, why=f"{one.why}; within {run.within:.1%} of it by the free run",
                   within=run.within)  # fmt: skip


def _of_nine(name: str, recorded: RecordedLogs, ways: Ways, spread: Mapping[str, float]) -> Told:
    side = 1 if name.endswith("n") else 0
    silent = silent_reason(name, ways.events, recorded.name)
    if silent is not None:
        why, _, add = silent.removeprefix(f"{recorded.name}: ").partition("; ")
        return Told(name, False, why, add)
    if name in spread:
        relative = spread[name]
        if relative > WIDEST_SD:
            key = name if name == "m" else name[:3]
            size = "by more than its size" if relative > 1.0 else f"by {relative:.0%}"
            return Told(name, False, f"the equation of motion leaves it unsure {size}", MEND[key])
        return Told(name, True, f"to {relative:.1%} by the equation of motion alone")
    if name.startswith("F_s"):
        count = ways.events.breakaways[side]
        return Told(name, True, f"{count} breakaways ({EVENTS_NEEDED} needed)")
    count = ways.events.crossings[side]
    if count < SURE_CROSSINGS:
        why = (
            f"{count} starts and stops, of which a fit may lose some ({SURE_CROSSINGS} to be sure)"
        )
        return Told(name, False, why, MEND["dv_"])
    return Told(name, True, f"{count} starts and stops ({EVENTS_NEEDED} needed)")


def _along_a_path(recorded: RecordedLogs) -> list[Told]:
    """The nine of a body that a rig leads, as the fit of the force equation alone tells them."""
    found = fit_imposed(recorded, np.random.default_rng(0), "imposed")
    out = []
    for name, one in found.estimates.items():
        if one.value is not None and one.sd is not None:
            relative = abs(one.sd / one.value)
            out.append(Told(name, True, f"to {relative:.1%} by the force equation"))
        else:
            why, _, add = (one.reason or "").removeprefix(f"{recorded.name}: ").partition("; ")
            out.append(Told(name, False, why, "" if add.startswith("see ") else add))
    return out


def _spreads(recorded: RecordedLogs) -> dict[str, float]:
    """Relative deviation of mass and sliding friction by least squares of the equation of motion.

    Widened by what the equation leaves beyond noise; infinite where a value is 0 or not told.
    """
    out = dict.fromkeys(FIVE, np.inf)
    logs = [one for one in recorded.logs if len(one.sliding.start)]
    if not logs:
        return out
    first = solve_rows(stacked([mechanical(one, NO_NOISE) for one in logs])).theta
    rows = stacked([mechanical(one, first) for one in logs])
    X, b = rows.X / rows.sd[:, np.newaxis], rows.b / rows.sd
    size = np.maximum(np.sqrt(np.sum(X**2, axis=0)), 1e-300)
    theta = np.linalg.lstsq(X / size, b, rcond=1e-12)[0]
    left = max(1.0, float(np.sum((b - X / size @ theta) ** 2)) / max(len(b) - len(FIVE), 1))
    inverse = np.linalg.pinv((X / size).T @ (X / size), rcond=1e-12)
    sd = np.sqrt(left * np.maximum(np.diag(inverse), 0.0))
    for name, value, own in zip(FIVE, theta.tolist(), sd.tolist(), strict=True):
        if value != 0.0 and own > 0.0:
            out[name] = own / abs(value)
    return out
