"""What is hardly identifiable from the motion in a log, said before a fit.

Quick, and of the motion and the work alone: `init` says it with the first card, doctor with the
rest of what it sees.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from design.machine.readable import Display
from identification.arrays import Array, BoolArray
from identification.errors import BadLog
from identification.estimation.regression.motion_log import SURE_OF_DIRECTION
from identification.log import Log, Rig
from identification.signals.check import work_share
from identification.signals.differentiate import Motion, differentiate, low_pass, resolution
from identification.signals.one_way import ONE_WAY_WHY, is_one_way
from identification.signals.relations import FEWEST_MOVING, derivative, moving
from identification.signals.steps import white_noise
from identification.thresholds import ASTRAY, HALF

INFORMATIVE_RATE = 50.0  # Hz, below which starts and stops lie between two samples
NEARLY_ONE_WAY = 0.05  # of the motion, that goes the other way at most
NO_WORK = 0.03  # of the work that a force exchanges with a body, that it does on the whole at least
ALL_OF_PLACE = 0.97  # of a force, that place explains where it only bears a weight or a spring
NO_FRICTION_IN_IT = 0.03  # of such a force's spread, that friction is at most
ALL_FOLLOWED = 0.8  # of a command, that is the velocity
SPEED_LEFT = 0.7  # of its speed at first, that a body which slows down keeps at most
GOES_WITH_NEITHER = 0.3  # correlation with velocity and acceleration, of a drive that is idle
AT_AN_END = 0.02  # of the travel, within which a body is at its end
BRAKED = (
    "F_vp and F_vn hold, beside friction, the braking by the voltage that the motor makes itself,"
    " k_t k_e / R = k_e force_per_command; log its current to identify friction alone"
)
DRIVE_IT = "log quick strokes that a command drives"
FEWEST_TURNS = 10  # of a position, from which it counts how many of them its step hides
MORE_THAN_ONE = 1.5  # counts of an encoder, that a stroke has at least
ENDS = 0.1  # of the motion, over which its first and last speed are taken


def hardly_identifiable(runs: Sequence[Log], rig: Rig) -> tuple[str, ...]:
    """A line for each thing that the runs will hardly identify; nothing where there is no run."""
    if not runs:
        return ()
    log = max(runs, key=len)
    rate = 1.0 / log.h
    slow = (
        f"sampled at {rate:.3g} Hz, slower than {INFORMATIVE_RATE:g} Hz: starts and stops lie"
        " between two samples, so bands and breakaway forces are hardly identifiable; log faster",
    )
    others = [one for one in runs if one is not log]
    return (*(slow if rate < 0.999 * INFORMATIVE_RATE else ()), *_of_motion(log, rig, others))


def _of_motion(log: Log, rig: Rig, others: Sequence[Log]) -> Iterator[str]:
    """Of a log's motion, and the ways of other runs."""
    try:
        motion = differentiate(log["y"], log.h)
    except BadLog:
        return
    sure = moving(motion)
    y, v, a = log["y"][sure], motion.v[sure], motion.a[sure]
    count = int(np.sum(sure))
    if count < FEWEST_MOVING:
        yield (
            f"hardly anything moves: {count} of {len(log)} samples are surely in motion, so"
            " friction is not identifiable; log a run with strokes in both directions"
        )
        return
    yield from _turns_hidden(log["y"], motion, Display.of(rig))
    up = float(np.mean(v > 0.0))
    one_way = min(up, 1.0 - up) < NEARLY_ONE_WAY
    ends = (one["y"][-1] - one["y"][0] for one in others)
    if one_way and not any(end * (0.5 - up) > 0.0 for end in ends):  # none goes back
        yield _said_of_one_way(up)
    of_command = rig.kind in ("motor", "velocity") and "u" in log
    name, logged = ("command", log["u"]) if of_command else ("force", log.signals.get("F"))
    if logged is None:
        return
    if of_command and (rig.force_per_command or 0.0) < 0.0:
        logged = -logged
    whole = low_pass(logged, log.h, motion.cutoff) if np.ptp(logged) > 0.0 else logged
    drive = whole[sure]
    yield from _against_stops(log["y"], whole, sure, name, Display.of(rig))
    if one_way and _is_idle(drive, v, a):
        yield _said_of_coasting(name, np.abs(v))
        return
    work = None if one_way else work_share(log["y"], logged)
    if work is not None and of_command and rig.force_per_command is None:
        work = abs(work)  # which way the command acts is not known
    if _bears_place_alone(drive, y, v, a, rotary=rig.motion == "rotary"):
        yield (
            f"the {name} depends on position alone, as a weight's or a spring's, and does not"
            " drive the motion: something else moves the body, perhaps by hand; then friction is"
            " not identifiable; log a run in which the machine moves itself"
        )
    elif work is not None and work < NO_WORK:
        yield (
            f"the {name} does hardly any work on the body in all ({work:.0%} of what the two"
            " exchange): no friction takes it up, or something else moves the body, by hand or by a"
            " load; friction is hardly identifiable"
        )
        return
    if rig.kind == "motor" and (share := derivative(motion, logged).share) > ALL_FOLLOWED:
        yield _said_of_followed(name, share, rig.command_unit)


def _turns_hidden(y: Array, motion: Motion, display: Display) -> Iterator[str]:
    """A line where most of the way of a position that a sensor counts is too short for its step:
    the noise of the velocity, which that makes, hides it."""
    count, step = resolution(y), np.diff(y)
    if not 0.0 < white_noise(y) <= count:
        return
    hidden = np.abs(motion.v[1:]) < SURE_OF_DIRECTION * motion.v_noise
    step, way = step[step != 0.0], np.abs(step)
    strokes = np.add.reduceat(step, np.flatnonzero(np.diff(np.sign(step), prepend=0.0)))
    turns = int(np.sum(np.abs(strokes) > MORE_THAN_ONE * count)) - 1
    if turns > FEWEST_TURNS and np.sum(way[hidden]) > HALF * np.sum(way):
        yield (
            f"the position turns {turns} times by more than its step of"
            f" {display.length_text(count)}, and goes most of its way too slowly to stand out of"
            " it: so much counts as rest; log longer strokes, or use a finer encoder"
        )


def _against_stops(
    y: Array, drive: Array, sure: BoolArray, name: str, display: Display
) -> Iterator[str]:
    """Lines on an end of the travel at which a body rests though the drive (n,) pushes it on with
    far more than what moves it elsewhere; sure (n,): samples in motion."""
    usual, travel = float(np.median(np.abs(drive[sure]))), float(np.ptp(y))
    for end, way in ((float(np.max(y)), 1.0), (float(np.min(y)), -1.0)):
        pushed = way * drive[~sure & (np.abs(y - end) < AT_AN_END * travel)]
        hard = pushed > ASTRAY * usual
        if len(pushed) >= FEWEST_MOVING and np.mean(hard) > HALF:
            times = f"{np.median(pushed[hard]) / usual:.2g} times"
            yield (
                f"the body rests at {display.length_text(end)} though the {name} pushes it on with"
                f" {times} what moves it elsewhere: an end stop (leave those rows out, or log"
                " strokes that stay off it), or a strong spring"
            )


def without_direction(runs: Sequence[Log], rig: Rig) -> tuple[str, ...]:
    """A line where a motor's command is never negative, though the body moves both ways."""
    commands = [one["u"] for one in runs if "u" in one] if rig.kind == "motor" else []
    if not commands or min(map(np.min, commands)) < 0.0:
        return ()
    try:
        motions = [differentiate(one["y"], one.h) for one in runs]
    except BadLog:
        return ()
    v = np.concatenate([one.v[moving(one)] for one in motions])
    back = float(np.mean(v < 0.0)) if len(v) >= FEWEST_MOVING else 0.0
    both = NEARLY_ONE_WAY < back < 1.0 - NEARLY_ONE_WAY
    return (said_without_sign("the command u", "the motion"),) if both else ()


def said_without_sign(command: str, motion: str) -> str:
    """What is said of a command without a sign beside a motion that goes both ways."""
    return (
        f"{command} is never negative, though {motion} goes both ways: where the motor pushes both"
        " ways its direction is missing, so log the command with its sign"
    )


def braked_by_its_voltage(logs: Sequence[Log], rig: Rig) -> tuple[str, ...]:
    """A line where a motor's command is a voltage that mostly is the velocity, as that which the
    motor makes itself is."""
    if rig.kind != "motor" or rig.command_unit != "V":
        return ()
    log = max(logs, key=len)
    try:
        share = derivative(differentiate(log["y"], log.h), log["u"]).share
    except BadLog:
        return ()
    if not share > ALL_FOLLOWED:
        return ()
    return (f"{share:.0%} of the command is the velocity; if it is the motor's voltage, {BRAKED}",)


def _said_of_followed(name: str, share: float, unit: str) -> str:
    said = f"the velocity follows the {name} ({share:.0%} of it is the velocity alone)"
    if unit == "A":  # which is a force: no valve's
        return (
            f"{said}: inertia is hardly identifiable, and a motor that the body turns makes such a"
            f" current by itself; {DRIVE_IT}"
        )
    hardly = f"{said}, as of a valve and cylinder: inertia is hardly identifiable;"
    if unit == "V":
        return f'{hardly} use kind = "velocity"; of a motor by its voltage, {BRAKED}'
    return f'{hardly} of a valve, use kind = "velocity"; of a motor by its current, {DRIVE_IT}'


def _said_of_one_way(up: float) -> str:
    side = "+" if up > 0.5 else "-"
    share = max(up, 1.0 - up)
    if is_one_way(up):
        return f"{ONE_WAY_WHY} ({share:.0%} of it goes towards {side}); log both ways"
    return (
        f"motion nearly one way ({share:.0%} of it goes towards {side}): friction is hardly"
        " distinguishable from a constant force; log both directions"
    )


def _said_of_coasting(name: str, speed: Array) -> str:
    few = max(2, int(ENDS * len(speed)))
    slower = speed[-few:].mean() < SPEED_LEFT * speed[:few].mean()
    how = "coasts" if slower else "coasts or is carried on at one speed"
    return (
        f"the body {how}: the {name} correlates with neither its speed nor its acceleration,"
        " so the driving force is not identifiable; log a run that is driven"
    )


def _is_idle(drive: Array, v: Array, a: Array) -> bool:
    """Whether the drive goes with neither the body's speed nor its change: a constant one is a step
    where the speed comes up to it."""
    if np.ptp(drive) == 0.0:
        few = max(2, int(ENDS * len(v)))
        return not np.min(np.abs(v)) < SPEED_LEFT * abs(v[-few:].mean())
    return all(abs(float(np.corrcoef(drive, x)[0, 1])) < GOES_WITH_NEITHER for x in (v, a))


def _bears_place_alone(drive: Array, y: Array, v: Array, a: Array, *, rotary: bool) -> bool:
    """Whether the drive is a weight's or a spring's force at each place, and none of friction."""
    spread = float(np.std(drive))
    if spread == 0.0:
        return False
    one = np.ones(len(y))
    place = np.column_stack([one, np.sin(y), np.cos(y)] if rotary else [one, y])
    left = drive - place @ np.linalg.lstsq(place, drive, rcond=None)[0]
    X = np.column_stack([np.sign(v), v / np.std(v), a / np.std(a), place])
    friction = float(np.linalg.lstsq(X, drive, rcond=None)[0][0])
    of_place = 1.0 - float(np.var(left)) / spread**2
    return of_place > ALL_OF_PLACE and friction < NO_FRICTION_IN_IT * spread
