"""Refusals: what a log cannot be if it is to say anything on friction, each with its own error.

Rows in the messages count as in the file: the caller says which row the first sample has.
"""

from collections.abc import Sequence

import numpy as np

from identification.arrays import Array
from identification.errors import BadLog, NotIdentifiable, ShortLog
from identification.log import Log, Rig
from identification.signals.frozen import noise_shows, within
from identification.signals.jumps import Jumps, jumps

SHORTEST_LOG = 100
"""Samples that a run needs at least; below that no parameter of nine is better than a guess."""
ABSURD = 1e30
"""In SI, what no machine reaches: products of such values overflow."""

# Share of the exchanged work below which F is refused. The shipped sets and simulated loops lie
# above +0.4; sensor delays in motion that springs or inertia rule stay within 0.15.
_WRONG_SIGN = -0.3
# Swapped logs lie below -0.02, with an F less than 0.8 times as rough as y (true ones: 0.9 to 13).
_SWAPPED = -0.01
_MUCH_SMOOTHER = 0.7
_TRUE = 0.1  # share above which force and position go together
_BLOCKS = 10_000
_STEADY = 0.01  # of the force, below which its changes move nothing that the rest does not
_PERIODS = (1e-9, 1e6)  # s between samples; no logger is faster or slower
# A noisy sensor does not repeat one value; a quantised one, or one without noise at rest, does.
_STUCK_RUN = 50  # samples
_STUCK_ELSEWHERE = 1e-3  # share of repeats outside such runs, below which they are a fault
_NOISE_LIKE = 0.3  # share of samples at which the second difference of noise changes its sign
# Times the card's limit that a command may reach: noise and an amplifier's reserve stay within it,
# a slip of unit (mV for V, % for a share) does not.
_BEYOND_LIMIT = 1.5
# What gives a rig's force, and what to turn where its sign is wrong.
_OF_KIND = {
    "force": ("F", "give the column of F or of y gain = -1"),
    "motor": ("u", "turn the sign of force_per_command, or give the column of y gain = -1"),
    "electro-pneumatic": (
        "p_p and p_n",
        "exchange the columns of p_p and p_n, or give that of y gain = -1",
    ),
}
JUMPS_ALIKE = 0.3  # spread of jumps that count as of one size, as those of a counter do


def check(log: Log, rig: Rig, first_row: int = 1) -> None:
    """Pass a log that can be what its card says.

    Raises BadLog, one line each, where the log is too short, time repeats or goes back, a value
    is not finite, the position is constant, jumps, wraps, sticks or is beyond the stroke, the
    command is far beyond its limit, the force has the wrong sign, or is swapped with the position.
    """
    check_time(log, first_row)
    _check_finite(log, first_row)
    if "u" in log:
        _check_command(log, rig, first_row)
    if "y" in log:
        _check_moved(log, rig, first_row)


def _check_moved(log: Log, rig: Rig, first_row: int) -> None:
    """Refuse a position that is no body's, or does not go with its force."""
    _check_constant(log)
    found = jumps(log, rig.motion == "rotary")
    y = found.undone(log["y"]) if found else log["y"]
    _check_stroke(log.name, y, rig)
    _check_stuck(log, first_row)
    # Jumps spoil the work too; where it is right without them, they are what is wrong.
    if "F" in log and not (found and (work_share(y, log["F"]) or 0.0) > _TRUE):
        _check_work(log, rig)
    if found:
        raise BadLog(_jumping(log, rig, found, first_row))


def no_force(log: Log) -> BadLog:
    """What to say of a log of which no applied force is known."""
    return BadLog(
        f"{log.name}: no applied force; give the card F or both pressures, or, of a motor,"
        " force_per_command in [rig] (1 where it is not known: forces are then in units of the"
        " command)"
    )


def check_driven(logs: Sequence[Log]) -> None:
    """Pass logs of one machine of which the applied force is known and changes, in a log or from
    one to the next.

    Raises BadLog, one line, where no force is logged, NotIdentifiable where there is only one of it
    in each direction of motion: friction is then whatever that force is, and the mass nothing.
    """
    for log in logs:
        if "F" not in log:
            raise no_force(log)
    if are_steps(logs):
        _check_steps(logs)
    for log in logs:
        if "y" in log and np.ptp(log["F"]) > 0.0:
            _check_moving_force(log)


def are_steps(logs: Sequence[Log]) -> bool:
    """Whether the applied force is constant in each log."""
    return all(np.ptp(log["F"]) == 0.0 for log in logs)


def _check_steps(logs: Sequence[Log]) -> None:
    """Refuse constant forces (steps) of which there is no second one in any direction."""
    ways = [float(np.sign(log["y"][-1] - log["y"][0])) if "y" in log else 0.0 for log in logs]
    levels = [float(log["F"][0]) for log in logs]
    if len(set(zip(ways, levels, strict=True))) > len(set(ways)):
        return
    said = " and ".join(f"{level:g}" for level in dict.fromkeys(levels))
    raise NotIdentifiable(
        f"{logs[0].name}: the applied force is constant ({said}), so friction and mass are not"
        " distinguishable from it; log a force that changes, or steps of several sizes in each"
        " direction, and name all their logs together; check the force's columns in the card"
    )


def _check_moving_force(log: Log) -> None:
    """Refuse a force that hardly changes while the body goes both ways: a search for the friction
    that explains it would not end."""
    way = np.diff(_blocks(log["y"]))
    back = min(float(way[way > 0].sum()), float(-way[way < 0].sum()))
    low, high = float(log["F"].min()), float(log["F"].max())
    if back > 0.1 * float(np.ptp(log["y"])) and high - low < _STEADY * max(abs(low), abs(high)):
        raise BadLog(
            f"{log.name}: the applied force stays between {low:.6g} and {high:.6g} while the body"
            " goes both ways, so something else drives it; check the units of the force's columns"
            " (bar and Pa mixed up?), the areas and the supply pressure in the card"
        )


def check_time(log: Log, first_row: int = 1) -> None:
    """Pass a log of at least `SHORTEST_LOG` samples whose time is finite and increases."""
    if len(log) < SHORTEST_LOG:
        raise ShortLog(
            f"{log.name}: {len(log)} samples, at least {SHORTEST_LOG} needed; give a longer run"
        )
    t = log["t"]
    if not np.all(np.isfinite(t)):
        row = first_row + int(np.flatnonzero(~np.isfinite(t))[0])
        raise BadLog(f"{log.name}: time in row {row} is not a number; remove the row")
    period = float(t[-1] - t[0]) / (len(t) - 1)
    if 0.0 < period < _PERIODS[0] or period > _PERIODS[1]:
        raise BadLog(
            f"{log.name}: sampled every {period:.3g} s, {_PERIODS[0]:g} to {_PERIODS[1]:g} s"
            " needed; check the unit of t in the card"
        )
    wrong = np.flatnonzero(np.diff(t) <= 0)
    if wrong.size:
        k = int(wrong[0])
        what = "repeats" if t[k + 1] == t[k] else "goes back"
        raise BadLog(
            f"{log.name}: time {what} in row {first_row + k + 1} ({t[k]:.9g} s, then "
            f"{t[k + 1]:.9g} s; {wrong.size} such rows), it must increase; give one run a file"
        )


def _check_finite(log: Log, first_row: int) -> None:
    for name, values in log.signals.items():
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise BadLog(
                f"{log.name}: signal {name!r} is NaN or infinite in {bad.size} rows, first in row "
                f"{first_row + int(bad[0])}; cut the log there or repair the column"
            )


def _check_command(log: Log, rig: Rig, first_row: int) -> None:
    """Refuse a command that the card's own limit rules out."""
    limit, u = rig.control_limit, log["u"]
    beyond = np.flatnonzero(np.abs(u) > _BEYOND_LIMIT * limit) if limit else np.array([])
    if beyond.size:
        raise BadLog(
            f"{log.name}: the command u runs from {u.min():g} to {u.max():g}, in {beyond.size} rows"
            f" beyond {_BEYOND_LIMIT:g} times the card's control_limit_v = {limit:g},"
            f" first in row {first_row + int(beyond[0])}; check unit, gain and offset of u (mV for"
            " V?), or correct the limit, which is in the unit of u"
        )


def _jumping(log: Log, rig: Rig, found: Jumps, first_row: int) -> str:
    """What jumps, where, and what to do."""
    unit = "rad" if rig.motion == "rotary" else "m"
    rows, size = first_row + found.at, found.size
    said = (
        f"{log.name}: the position jumps by {size[0]:.4g} {unit} from row {rows[0]} to"
        f" {rows[0] + 1}, which no body does"
    )
    if len(rows) > 1:
        alike = np.ptp(np.abs(size)) < JUMPS_ALIKE * np.max(np.abs(size))
        said += f" ({len(rows)} such jumps{', all about as large' if alike else ''})"
    if found.wraps and len(rows) > 1:
        return (
            f"{said}: a counter or an angle that wraps at the end of its range; unwrap the column"
            f" (numpy.unwrap with its range as period), or, where a counter goes below zero, give y"
            " its bits and signed = true in the card"
        )
    return (
        f"{said}: a slip of the counter, or one that wraps; cut the log there and give each part a"
        " file, or unwrap the column (where the body did move there, check the units of y and t)"
    )


def _check_constant(log: Log) -> None:
    y = log["y"]
    if np.ptp(y) == 0.0:
        raise BadLog(
            f"{log.name}: position is constant ({y[0]:g} m in all {len(log)} rows), motion needed; "
            "check the column of y and the sensor"
        )


def _check_stroke(name: str, y: Array, rig: Rig) -> None:
    if rig.stroke is None:
        return
    low, high = rig.stroke
    slack = 0.2 * (high - low)
    if y.min() < low - slack or y.max() > high + slack:
        raise BadLog(
            f"{name}: position runs from {y.min():g} to {y.max():g} m, the card's stroke is "
            f"{low:g} to {high:g} m; check unit and gain of y, and that y and F are not swapped"
        )


def _check_stuck(log: Log, first_row: int) -> None:
    """Refuse a noisy position that now and then repeats one value for long: the sensor's fault."""
    y = log["y"]
    same = np.concatenate(([False], np.diff(y) == 0.0, [False]))
    edges = np.flatnonzero(np.diff(same.astype(np.int8)))
    starts, lengths = edges[0::2], edges[1::2] - edges[0::2]
    long = lengths >= _STUCK_RUN
    if not np.any(long):
        return
    others = len(y) - int(lengths[long].sum())
    if int(lengths[~long].sum()) > _STUCK_ELSEWHERE * others:
        return
    bend = np.diff(y, 2)
    bend = bend[bend != 0.0]
    if bend.size < SHORTEST_LOG or np.mean(bend[1:] * bend[:-1] < 0.0) < _NOISE_LIKE:
        return
    if not noise_shows(y, within(starts[long], starts[long] + lengths[long] + 1, len(y))):
        return
    worst = int(np.argmax(lengths))
    raise BadLog(
        f"{log.name}: position repeats {y[starts[worst]]:.6g} for {int(lengths[worst]) + 1} samples"
        f" from row {first_row + int(starts[worst])} ({int(np.count_nonzero(long))} such stretches)"
        " and never elsewhere: the sensor sticks; cut the log there or repair the sensor"
    )


def _check_work(log: Log, rig: Rig) -> None:
    work = work_share(log["y"], log["F"])
    if work is None or work > _SWAPPED:
        return
    found = f"{log.name}: the applied force takes out {-work:.0%} of the work it exchanges"
    roughness = _path(log["F"]) / max(_path(log["y"]), 1e-12)
    if roughness < (1.0 if work < _WRONG_SIGN else _MUCH_SMOOTHER):
        own = _OF_KIND[rig.kind][0]
        raise BadLog(
            f"{found} and the force is smoother than y, so force and position look swapped; "
            f"exchange the columns of {own} and y in the card"
        )
    if work < _WRONG_SIGN:
        raise BadLog(
            f"{found}, which friction can only consume: a force or position of the wrong sign;"
            f" {_OF_KIND[rig.kind][1]}"
        )


def work_share(y: Array, F: Array) -> float | None:
    """Work of `F` as a share of the work exchanged: +1 for friction alone, 0 without any.

    The larger of two shares: over the whole log, where kinetic energy drops out if it begins and
    ends at rest, and between the first and the last passage of mid-stroke, where every force of
    position alone (spring, weight) does. `None` where the motion does not come back. White noise
    of the sensors does not bias it, since it is uncorrelated between y and F.
    """
    y, F = _blocks(y), _blocks(F)
    above = y > 0.5 * (y.min() + y.max())
    passages = np.flatnonzero(above[1:] != above[:-1])
    if passages.size < 2:
        return None
    last = passages[0::2][-1] if passages.size > 2 else passages[1]
    closed = slice(int(passages[0]), int(last) + 2)
    return max(_share(y, F), _share(y[closed], F[closed]))


def _share(y: Array, F: Array) -> float:
    step = np.diff(y)
    force = 0.5 * (F[1:] + F[:-1])
    force = force - force.mean()
    exchanged = float(np.sum(np.abs(force * step)))
    return float(np.sum(force * step)) / exchanged if exchanged > 0 else 0.0


def _path(values: Array) -> float:
    """Length of the way that a signal goes, in units of its range: how rough it is."""
    values = _blocks(values)
    width = float(np.ptp(values))
    return float(np.sum(np.abs(np.diff(values)))) / width if width > 0 else 0.0


def _blocks(values: Array) -> Array:
    """Means of equal blocks, at most `_BLOCKS` of them, which takes out most sensor noise."""
    size = max(1, len(values) // _BLOCKS)
    count = len(values) // size
    return np.asarray(values[: count * size].reshape(count, size).mean(axis=1), dtype=np.float64)
