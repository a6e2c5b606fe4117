"""Stages Log -> Log: missing samples, spikes; and F_e (7).

`prepare` runs them in order and says in `remarks`, and sample by sample in `bad`, what it changed.
A longer run of missing values is never invented: the log is cut there.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.errors import BadLog
from identification.log import Log, Rig
from identification.remarks import LeftOut
from identification.signals.bad_samples import BadSamples, Done, Kind, lines
from identification.signals.check import SHORTEST_LOG, check_time
from identification.signals.check import check as check
from identification.signals.clock_jitter import beside_their_time
from identification.signals.differentiate import resolution
from identification.signals.even_clock import (
    LONGEST_GAP,
    even_clock,
    gaps_in,
    hours_in_words,
    in_counts,
)
from identification.signals.frozen import clipped, frozen
from identification.signals.jumps import LONGEST_SPIKE, Mask, spikes
from identification.signals.offsets import unwrapped, without_jumps
from identification.signals.steps import beside_gaps, small_spikes, white_noise

LONGEST_REPAIR = 3
"""Missing samples in a row that are put back, by interpolation or as lost rows; at a longer run
the log is cut."""

_SHORT_OR_STILL = f"of under {SHORTEST_LOG} rows or at rest left out"  # of runs

_MANY = 0.01  # share of missing samples in a column above which the sensor is not to be trusted
_TAILS = 0.05  # the same of small spikes, which a sensor with heavy tails has
_LARGE = 0.05  # of a signal's range, from which a spike is no small one
_MOST_CUT = 0.1  # share of a log that may be left out
_SHORTEST_CUT = 6  # samples that are cut out at least, so that the gap is one
_SMALL = ("y", "p_p", "p_n")  # what no machine changes for a sample or two
# A smooth crest has no more samples at its last count than at the three before, a limit has most.
_BESIDE_LIMIT, _AT_LIMIT = 3.5, 2.0
_LEVELS = 10  # values that a command takes at least where its limits are looked for
_ROUNDS = 4  # in which small spikes are looked for beside those found
_MOVED = 20.0  # times its noise, that the position of a piece spans where it is not left out
_SPIKING = ("y", "F", "p_p", "p_n")  # what sensors measure; a command may do anything


class Repaired(NamedTuple):
    """A log without missing samples, and what was filled in."""

    log: Log
    remarks: tuple[str, ...]
    bad: tuple[BadSamples, ...] = ()


@dataclass(frozen=True)
class Prepared:
    """Runs on an even clock, in `remarks` what had to be done for it, a line each, and in `bad`
    which samples were excluded; period: of the samples in the file [s], where it is known."""

    runs: tuple[Log, ...]
    remarks: tuple[str, ...]
    bad: tuple[BadSamples, ...] = ()
    period: float | None = None


def prepare(log: Log, rig: Rig, first_row: int = 1) -> Prepared:
    """The log repaired, checked and on an even clock; its runs have one sampling period.

    Raises BadLog as `repair`, `check` and `even_clock` do.
    """
    log, remarks, bad = repair(log, first_row, rotary=rig.motion == "rotary")
    check(log, rig, first_row)
    runs = even_clock(log)
    if len(runs) == 1 and runs[0] is log:
        return Prepared(runs, remarks, bad)
    runs = _moving(runs)
    lost = log.duration - sum(run.duration for run in runs)
    said = list[str]()
    filled = [run.lost for run in runs if run.lost is not None and np.any(run.lost)]
    if filled:
        share = float(np.mean(np.concatenate(filled)))
        said.append(f"{log.name}: {100 * share:.2g} % of its rows are lost, interpolated")
    elif not all(np.all(np.isin(run["t"], log["t"])) for run in runs):
        holes = 0 if np.isclose(runs[0].h, log.h) else len(gaps_in(log["t"], log.h))
        clock = f"rows in bursts, {holes} holes between them" if holes else "uneven clock"
        said.append(f"{log.name}: {clock}, resampled every {1e3 * runs[0].h:.3g} ms")
    if len(runs) > 1 or lost > LONGEST_GAP * runs[0].h:
        hours = hours_in_words(gaps_in(log["t"], log.h), log.h)
        away = len(gaps_in(log["t"], runs[0].h)) + 1 - len(runs)
        short = f" and {away} run{'s' * (away > 1)} {_SHORT_OR_STILL}" if away else " left out"
        kept = f"in {len(runs)} run{'s' * (len(runs) > 1)}"
        line = f"{log.name}: {kept}; {lost:.4g} s in gaps{short}{hours}"
        said.append(LeftOut(line) if away else line)
    return Prepared(runs, (*remarks, *said), bad)


def _moving(runs: tuple[Log, ...]) -> tuple[Log, ...]:
    """The runs in which the position moves, if there are any."""
    found = tuple(
        run for run in runs
        if "y" not in run or np.ptp(run["y"]) > _MOVED * white_noise(run["y"])
    )  # fmt: skip
    return found or runs


def repair(log: Log, first_row: int = 1, *, rotary: bool = False) -> Repaired:
    """The log without bad samples, and what they were.

    Isolated missing samples (NaN or infinite) and spikes are filled by linear interpolation in
    time; where a command or more than 1 % of a signal is missing, the rows count as lost, as those
    at an end of the log; where more than `LONGEST_REPAIR` are missing in a row or a value stands
    still, the log is cut; a position that jumps or wraps goes on from where it was.

    first_row: the file's row of the first sample, for the messages; rotary: positions are angles.
    Raises BadLog where a tenth of the log would have to be left out, or a column has large spikes
    in more than 1 %, or any in more than 5 %.
    """
    check_time(log, first_row)
    (log, said, bad_ones), lost, away = _without_missing(log, first_row)
    remarks, bad = list(said), list(bad_ones)
    if "y" in log:
        log, found = unwrapped(log, rotary)
        bad += found
    for name in ("y", "F", "p_p", "p_n", "u"):
        if name == "F" and _commanded(log):
            continue
        if name in log and name not in {one.signal for one in bad if one.done == "cut out"}:
            still = frozen(log[name], at_limits=name == "u")
            bad += _found(log, name, "frozen", still, "cut out")
            away |= still
    log = _left_out(log, lost, away, first_row)
    for name in _SPIKING:
        if name in log:
            log, said, spiked = _without_spikes(log, name, first_row, rotary)
            remarks.extend(said)
            bad.extend(spiked)
    if "y" in log:
        log, jumped = without_jumps(log, rotary)
        bad.extend(jumped)
    log, ends = _within_range(log, first_row)
    bad += ends
    reported = [one for one in bad if one.done != "interpolated"]
    return Repaired(log, (*remarks, *lines(reported)), tuple(bad))


def _without_ends(log: Log, first_row: int) -> tuple[Repaired, int]:
    """The log from its first to its last row without a missing sample, and the row of the first.

    Raises BadLog where more than a tenth of a signal is missing.
    """
    known: Mask = np.ones(len(log), dtype=bool)
    for name, values in log.signals.items():
        missing = ~np.isfinite(values)
        if missing.mean() > _MOST_CUT:
            raise BadLog(
                f"{log.name}: signal {name!r} is NaN or infinite in {missing.mean():.0%} of the"
                f" rows, first in row {first_row + int(np.argmax(missing))}, at most"
                f" {_MOST_CUT:.0%} are left out; check the sensor"
            )
        known &= ~missing
    rows = np.flatnonzero(known)
    if len(rows) in (0, len(log)) or (rows[0], rows[-1]) == (0, len(log) - 1):
        return Repaired(log, ()), first_row
    ends = len(log) - 1 - int(rows[-1] - rows[0])
    remark = f"{log.name}: {ends} rows at the log's ends, in which a signal is missing, left out"
    return Repaired(log.part(int(rows[0]), int(rows[-1]) + 1), (remark,)), first_row + int(rows[0])


def _without_missing(log: Log, first_row: int) -> tuple[Repaired, Mask, Mask]:
    """The log with its missing samples filled, and which rows are to be left out none the less: as
    lost ones, and where the log is to be cut."""
    (log, said, _), first_row = _without_ends(log, first_row)
    lost: Mask = np.zeros(len(log), dtype=bool)
    away = lost.copy()
    remarks, bad = list(said), list[BadSamples]()
    for name, values in log.signals.items():
        missing = ~np.isfinite(values)
        if not np.any(missing):
            continue
        long = _long_runs(missing)
        isolated = missing & ~long
        away |= long
        filled = _bridged(log["t"], values, missing)
        count = int(isolated.sum())
        if count and (name == "u" or isolated.mean() > _MANY):
            lost |= isolated
            remarks.append(f"{log.name}: {count} rows without a value of {name!r} left out")
        elif count:
            remarks.append(f"{log.name}: {count} isolated missing samples of {name!r} interpolated")
            bad += _found(log, name, "missing", isolated, "interpolated")
        bad += _found(log, name, "missing", long, "cut out")
        log = log.with_signals(**{name: filled})
    return Repaired(log, tuple(remarks), tuple(bad)), lost, away


def _long_runs(missing: Mask) -> Mask:
    """Where more than `LONGEST_REPAIR` samples in a row are missing, (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], missing.astype(np.int8), [0]))))
    long = np.zeros_like(missing)
    for a, b in zip(edges[0::2].tolist(), edges[1::2].tolist(), strict=True):
        long[a:b] = b - a > LONGEST_REPAIR
    return long


def _commanded(log: Log) -> bool:
    """Whether the force is the command times a constant, and no measured one."""
    if "F" not in log or "u" not in log:
        return False
    F, u = log["F"], log["u"]
    largest = int(np.argmax(np.abs(u)))
    return bool(u[largest] != 0.0 and np.allclose(F, u * (F[largest] / u[largest]), rtol=1e-9))


def _left_out(log: Log, lost: Mask, away: Mask, first_row: int) -> Log:
    """The log without these rows; where it is to be cut (away), without their neighbours too where
    they are few."""
    if not np.any(lost | away):
        return log
    wide = _widened(away)
    if (wide | lost).mean() > _MOST_CUT:
        faulty = lost | away
        raise BadLog(
            f"{log.name}: in {faulty.mean():.0%} of the rows, first in row"
            f" {first_row + int(np.argmax(faulty))}, a signal is missing or stands still; at most"
            f" {_MOST_CUT:.0%} are left out; check the sensor and its cable"
        )
    return Log(log.name, {key: x[~(wide | lost)] for key, x in log.signals.items()})


def _widened(away: Mask) -> Mask:
    """These rows with their neighbours, so that what is cut out is a gap of the clock, (n,)."""
    return np.convolve(away, np.ones(_SHORTEST_CUT // 2 + 1), mode="same") > 0.5


def _found(
    log: Log, name: str, kind: Kind, where: Mask, done: Done, size: float | None = None
) -> list[BadSamples]:
    """The stretches of a mask as findings; many isolated ones as one."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], where.astype(np.int8), [0]))))
    starts, stops = edges[0::2], edges[1::2]
    if done == "interpolated" and len(starts) > 1:
        starts, stops = starts[:1], stops[-1:]
    t = log["t"]
    return [
        BadSamples(
            log.name, name, kind, float(t[a]), float(t[b - 1]), int(where[a:b].sum()), size, done
        )
        for a, b in zip(starts.tolist(), stops.tolist(), strict=True)
    ]


def _within_range(log: Log, first_row: int) -> tuple[Log, list[BadSamples]]:
    """The log without the rows in which its force sensor is at an end of its range, and where that
    is; where its command is at its limit, which is kept.

    Raises BadLog where no run is left.
    """
    ends = limits(log, "u") if "u" in log else []
    if "F" not in log or _commanded(log) or not np.any(at := clipped(log["F"])):
        return log, ends
    # Beside these rows, those are left whose noise was not up to the end.
    kept = np.flatnonzero(np.convolve(at, np.ones(2 * _SHORTEST_CUT + 1), mode="same") < 0.5)
    if max(map(len, np.split(kept, np.flatnonzero(np.diff(kept) > 1) + 1))) < SHORTEST_LOG:
        raise BadLog(
            f"{log.name}: the sensor of F is at an end of its range ({log['F'].min():g} or"
            f" {log['F'].max():g}) in {at.mean():.0%} of the rows, first in row"
            f" {first_row + int(np.argmax(at))}, and no {SHORTEST_LOG} rows in a row are without;"
            " log gentler motion, or use a sensor of a larger range"
        )
    left = Log(log.name, {key: x[kept] for key, x in log.signals.items()})
    return left, ends + limits(log, "F", "cut out")


def limits(log: Log, name: str, done: Done = "kept") -> list[BadSamples]:
    """Where a signal stands at its largest or smallest value for several samples, a finding each.

    Of a sensor of a force or pressure that is its range's end; a position may rest there. Of a
    signal that the logger holds a value counts as often as it stays for longer than the usual one.
    """
    x = log[name]
    low, high = float(x.min()), float(x.max())
    if low == high or len(np.unique(x)) < _LEVELS:
        return []
    starts = np.flatnonzero(np.diff(x, prepend=np.nan) != 0.0)
    held = np.diff(starts, append=len(x))  # samples, of each value
    again = held / np.median(held) - 1.0
    out, beside = [], _BESIDE_LIMIT * resolution(x[np.isfinite(x)])
    for limit in (low, high):
        at = x == limit
        count = int(at.sum())
        near = int(np.count_nonzero(np.abs(x - limit) <= beside))  # the limit itself among them
        piled = count > _AT_LIMIT * (near - count)
        if piled and np.sum(again[x[starts] == limit]) >= LONGEST_REPAIR:
            t = log["t"][at]
            first, last = float(t[0]), float(t[-1])
            out.append(BadSamples(log.name, name, "saturated", first, last, count, None, done))
    return out


def _without_spikes(log: Log, name: str, first_row: int, rotary: bool) -> Repaired:
    """The signal where no sensor's spike is, interpolated where one is."""
    t, raw = log["t"], log[name]
    spiking: Mask = np.zeros(len(log), dtype=bool)
    while np.any(new := spikes(log, name, rotary) & ~spiking):  # one may hide another beside it
        spiking |= new
        log = log.with_signals(**{name: _bridged(t, raw, spiking)})
    clearly, of_clock = spiking, list[str]()
    sound = ~beside_gaps(t)  # over a gap of the clock any motion is a step
    for _ in range(_ROUNDS if name in _SMALL else 0):
        new = small_spikes(log[name]) & sound & ~spiking
        if not np.any(new):
            break
        spiking = spiking | new
        log = log.with_signals(**{name: _bridged(t, raw, spiking)})
    many = float(spiking.mean()) > _TAILS
    if many and name == "y" and (said := beside_their_time(t, raw, spiking & ~clearly)):
        spiking, of_clock = clearly, [f"{log.name}: {said}"]
        log = log.with_signals(y=_bridged(t, raw, spiking))
    if not np.any(spiking):
        return Repaired(log, tuple(of_clock))
    rows, height = np.flatnonzero(spiking), np.abs(raw - log[name])
    factor, unit = _shown(name, rotary)
    found = (
        f"{first_row + int(rows[0])}, the largest of {factor * np.max(height):.3g}"
        f" {unit} in row {first_row + int(np.argmax(height))}"
    )
    large: Mask = height > _LARGE * np.ptp(log[name])
    for which, those, most in (("large ", large, _MANY), ("", spiking, _TAILS)):
        if those.mean() > most:
            raise BadLog(
                f"{log.name}: signal {name!r} has {which}spikes in {those.mean():.1%} of the rows,"
                f" first in row {found}; at most {most:.0%} are interpolated; check the sensor and"
                " its cable"
            )
    said = f"{log.name}: isolated spikes of {name!r} in {len(rows)} samples interpolated"
    remark = (
        f"{said} (at most {LONGEST_SPIKE} in a row), first in row {found},"
        f" t = {t[int(np.argmax(height))]:.6g} s"
    )
    bad = _found(log, name, "spike", spiking, "interpolated", float(np.max(height)))
    return Repaired(log, (*of_clock, remark), tuple(bad))


def _bridged(t: Array, values: Array, bad: Mask) -> Array:
    """Values (n,) with the bad ones on the line between their neighbours, in whole counts of a
    sensor that counts."""
    good, out = values[~bad], values.copy()
    out[bad] = in_counts(np.interp(t[bad], t[~bad], good), good)
    return out


def _shown(name: str, rotary: bool) -> tuple[float, str]:
    """Factor and unit in which a signal is reported."""
    if name in ("y", "F"):
        linear, turning = (
            {"y": (1e3, "mm"), "F": (1.0, "N")},
            {"y": (1.0, "rad"), "F": (1.0, "N m")},
        )
        return (turning if rotary else linear)[name]
    return 1e-5, "bar"


def applied_force(log: Log, rig: Rig) -> Array | None:
    """The applied force F_e [N] by the rig's kind, shape (n,); `None` where the rig does not give
    it.

    "electro-pneumatic": S_p P_p - S_n P_n - (S_p - S_n) P_s. "force": F, plus S_p P_p and minus
    S_n P_n for each chamber whose area and pressure are known. "motor": k_a u. "velocity": none.
    Source: eq. (7).
    """
    if rig.kind == "velocity":
        return None
    if rig.kind == "motor":
        return None if rig.force_per_command is None else rig.force_per_command * log["u"]
    S_p, S_n = rig.area_p or 0.0, rig.area_n or 0.0
    if rig.kind == "force":
        F = log["F"]
        F = F + S_p * log["p_p"] if S_p and "p_p" in log else F
        return F - S_n * log["p_n"] if S_n and "p_n" in log else F
    return S_p * log["p_p"] - S_n * log["p_n"] - (S_p - S_n) * (rig.supply_pressure or 0.0)
