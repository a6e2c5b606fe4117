"""Log files read by their card: canonical signals in SI, the applied force F_e among them."""

import os
import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.arrays import Array, frozen
from identification.errors import BadCard, BadLog
from identification.log import Log
from identification.signals.bad_samples import BadSamples
from identification.signals.check import ABSURD
from identification.signals.clean import Prepared, Repaired, applied_force, check, prepare, repair
from identification.signals.one_clock import on_one_clock
from identification.signals.renewal import renewed, zoh_remarks
from identification.signals.stamps import (
    at_rows,
    even_stamps,
    sound_rows,
    starts_in_words,
    stretches,
)
from identification.signals.summed import summed
from identification.signals.thin import LONGEST_UNTHINNED, thinned
from workbench.cards.card import Card
from workbench.cards.card_tables import SignalSpec
from workbench.logs.table import Table, number_of, text_of
from workbench.logs.tables import read_table
from workbench.logs.times import numbers_in, seconds

_CANONICAL = frozenset({"t", "r", "y", "p_p", "p_n", "F", "u"})
_CLOCK = re.compile(r"\d+:\d\d|\d{4}[-/]\d\d?[-/]\d\d?")


def read_log(path: Path, card: Card) -> Log:
    """The run in the file, in SI, on its own clock, checked; `F` is the applied force F_e.

    Isolated missing samples and spikes are interpolated, other bad ones left out. A `kind =
    "force"` rig with pressures keeps the force as logged in `F_logged`. Raises BadLog or BadCard in
    one line where the file or its content is not what the card says.
    """
    raw, first_row = read_signals(path, card)
    log = with_force(_repaired(raw, first_row, path, card).log, path, card)
    check(log, card.rig(path.name), first_row)
    return log


def read_runs(path: Path, card: Card) -> Prepared:
    """The file's runs on an even clock, and remarks on what was repaired, resampled or cut."""
    return runs_of(table_of(path, card), path, card)


def runs_of(table: Table, path: Path, card: Card) -> Prepared:
    """As `read_runs`, of a table; path: what the run and the messages are called by."""
    log, first_row, remarks = _signals_of(table, path, card)
    parts = stretches(log["t"])
    if len(parts) == 1:
        made = prepared(log, first_row, path, card)
        return replace(made, remarks=tuple(dict.fromkeys((*remarks, *made.remarks))))
    said = [*remarks, f"{log.name}: its {starts_in_words(log['t'], parts)}"]
    runs, bad = list[Log](), list[BadSamples]()
    for number, rows in enumerate(parts, 1):
        part = Log(f"{log.name} (run {number})", at_rows(log.signals, rows))
        made = prepared(part, first_row + rows.start, path, card)
        runs, bad, said = [*runs, *made.runs], [*bad, *made.bad], [*said, *made.remarks]
    return Prepared(tuple(runs), tuple(said), tuple(bad), made.period)


def prepared(log: Log, first_row: int, path: Path, card: Card) -> Prepared:
    """The runs on an even clock of one log as it stands in a file from this row on."""
    fresh = renewed(log)
    period, read = log.h if fresh.remarks else None, (*zoh_remarks(log), *fresh.remarks)
    repaired = _repaired(fresh.log, first_row, path, card)
    del log, fresh  # of a long log a gigabyte
    rig = card.rig(path.name)
    if len(repaired.log) > LONGEST_UNTHINNED:  # here, where rows still count as in the file
        check(repaired.log, rig, first_row)
    thin = thinned(repaired.log)
    made = prepare(with_force(thin.log, path, card), rig, first_row)
    remarks = (*read, *repaired.remarks, *thin.remarks, *made.remarks)
    bad = (*repaired.bad, *made.bad)  # a command's limits are seen twice
    remarks, bad = tuple(dict.fromkeys(remarks)), tuple(dict.fromkeys(bad))
    return Prepared(made.runs, remarks, bad, period or repaired.log.h)


def _repaired(log: Log, first_row: int, path: Path, card: Card) -> Repaired:
    return repair(log, first_row, rotary=card.rig(path.name).motion == "rotary")


def shown_name(path: Path) -> str:
    """The file's name as text; bytes that are not UTF-8 as "\\xff"."""
    return os.fsencode(path.name).decode("utf-8", "backslashreplace")


def with_force(log: Log, path: Path, card: Card) -> Log:
    """The log with the applied force F_e in `F`, by the card's rig, where it is known."""
    rig = card.rig(path.name)
    F = applied_force(log, rig)
    if F is None:
        return log
    if "F" in log and F is not log["F"]:
        log = log.with_signals(F_logged=log["F"])
    return log.with_signals(F=F)


def read_signals(path: Path, card: Card) -> tuple[Log, int]:
    """The card's signals in SI as in the file, of its longest run, and the first row's number."""
    return longest_run(table_of(path, card), path, card)


def longest_run(table: Table, path: Path, card: Card) -> tuple[Log, int]:
    """As `read_signals`, of a table."""
    log, first_row, _ = _signals_of(table, path, card)
    rows = max(stretches(log["t"]), key=lambda one: one.stop - one.start)
    return Log(log.name, at_rows(log.signals, rows)), first_row + rows.start


def table_of(path: Path, card: Card) -> Table:
    """The file as the card says that it is laid out; raises BadCard where it names no signals."""
    if not card.signals:
        raise BadCard(f"{card.path}: has no [signals]; name the column of each signal")
    return read_table(path, card.file)


def _signals_of(table: Table, path: Path, card: Card) -> tuple[Log, int, tuple[str, ...]]:
    """The card's signals in SI as they stand in the table, on the clock of `t`, the number of their
    first row, and what was done to them."""
    signals, groups = dict[str, Array](), dict[str, str]()
    called, remarks = shown_name(path), list(table.remarks)
    for name, spec in card.signals.items():
        number = table.number(spec.column, f"{path}, signals.{name}")
        signals[name], said = _signal(table, number, name, card, path)
        remarks += said
        _refuse_absurd(signals[name], name, path, table.first_row)
        if table.groups:
            groups[name] = table.groups[number]
    if not groups:
        whole = _same_length(signals, path)
        if card.signals["t"].summed:
            whole["t"] = summed(whole["t"])
        rows, said = sound_rows(whole["t"], [x for key, x in whole.items() if key != "t"])
        whole = at_rows(whole, rows) if said else whole
        whole["t"], late = even_stamps(whole["t"])
        said = (*said, late) if late else said
        whole, of_speeds = _with_sums(whole, card.signals)
        remarked = tuple(f"{called}: {one}" for one in (*remarks, *said, *of_speeds))
        return Log(called, whole), table.first_row, remarked

    def clock(group: str) -> Array:
        number = table.clocks.get(group)
        if number is None:
            wanted = table.names[table.number(card.signals["t"].column, f"{path}, signals.t")]
            number = table.number(f"{group}/{wanted}", f"{path}, the clock of group {group!r}")
        return _signal(table, number, "t", card, path)[0]

    found = on_one_clock(signals, groups, clock, called)
    whole, of_speeds = _with_sums(_same_length(found.signals, path), card.signals)
    remarked = tuple(f"{called}: {one}" for one in (*remarks, *of_speeds))
    return Log(called, whole), table.first_row + found.first, (*remarked, *found.remarks)


def _signal(
    table: Table, number: int, name: str, card: Card, path: Path
) -> tuple[Array, tuple[str, ...]]:
    """A column of the table in SI, as the signal `name` of the card, and what was done to it."""
    spec = card.signals[name]
    raw = table.fetch(number)
    where = f"{path}: column {spec.column!r}"
    numbers = seconds(raw, where, table.first_row) if name == "t" else None
    said = tuple[str, ...]()
    if numbers is None:
        numbers, said = _numbers(raw, where, table.first_row)
    elif spec.unit != "s":
        raise BadLog(
            f"{where} holds times of day, dates or durations, which are read in seconds; write"
            f' unit = "s" for signals.t, not {spec.unit!r}'
        )
    with np.errstate(over="ignore", invalid="ignore"):  # infinite values are refused later
        return frozen(_to_si(numbers, name, spec, card, path)), said


def _numbers(raw: NDArray[Any], where: str, first_row: int) -> tuple[Array, tuple[str, ...]]:
    """Raw values as float64, text in a few cells as missing, and what is said of it; raises BadLog
    naming the row of the first that is no number where they are many."""
    if raw.dtype.kind not in "fiubOUS":
        what = "dates" if raw.dtype.kind in "Mm" else f"of type {raw.dtype}"
        raise BadLog(f"{where} is {what}, numbers needed; log numbers (time in seconds)")
    found = numbers_in(raw)
    count = int(np.sum(found.is_text))
    if not count:
        return found.values, ()
    row, shown = int(np.argmax(found.is_text)), repr(found.first_text)[:40]
    if found.few:
        cells = f"{count} cells that hold text" if count > 1 else "a cell that holds text"
        column = where.rpartition(": ")[2]
        return found.values, (f"{column}: {cells} ({shown}, row {first_row + row}) left out",)
    advice = _advice(raw, row)
    raise BadLog(f"{where}, row {first_row + row}: {shown} is not a number; {advice}")


def _advice(raw: NDArray[Any], k: int) -> str:
    """What to do about the text in row `k` of a column."""
    if _CLOCK.search(str(text_of(raw[k]))):
        return "log times in seconds, not as dates or clock times"
    with suppress(TypeError, ValueError, IndexError):
        if k == 0:
            number_of(raw[1])
            return (
                "if it is a row of units, take it out, or set skip_rows = 1 in the card's [file]"
                " and give the columns by number"
            )
    return "correct it or leave the field empty"


def _to_si(values: Array, name: str, spec: SignalSpec, card: Card, path: Path) -> Array:
    rig = card.rig(path.name)
    if spec.bits is not None and spec.signed:
        values = np.where(values >= 2.0 ** (spec.bits - 1), values - 2.0**spec.bits, values)
    if spec.offset != 0.0:
        values = values - spec.offset
    try:
        factor, shift = spec.scale(name, rig)
    except BadCard as error:
        raise BadCard(f"{card.path}: {error}") from None
    if factor != 1.0:
        values = values * factor
    return values + shift if shift != 0.0 else values


def _refuse_absurd(values: Array, name: str, path: Path, first_row: int) -> None:
    absurd = np.flatnonzero(np.isfinite(values) & (np.abs(values) > ABSURD))
    if name in _CANONICAL and absurd.size:
        raise BadLog(
            f"{path}: signal {name!r} is {values[absurd[0]]:g} in row {first_row + absurd[0]}, "
            "which no machine reaches; check the file and the column's unit"
        )


def _same_length(signals: Mapping[str, Array], path: Path) -> dict[str, Array]:
    """The signals at the length of `t`, single values spread, a row more or less of one cut off;
    others raise BadLog."""
    lengths = {len(values) for values in signals.values() if len(values) > 1}
    if lengths and max(lengths) - min(lengths) == 1:  # vectors of a file, not rows
        signals = {k: v[: min(lengths)] if len(v) > 1 else v for k, v in signals.items()}
    length = len(signals["t"]) if len(signals["t"]) > 1 else max(lengths, default=1)
    for name, values in signals.items():
        if len(values) not in (1, length):
            raise BadLog(
                f"{path}: signal {name!r} has {len(values)} values and t {length}; "
                "all signals of a run need one length"
            )
    return {k: v if len(v) == length else np.full(length, v[0]) for k, v in signals.items()}


def _with_sums(
    signals: dict[str, Array], specs: Mapping[str, SignalSpec]
) -> tuple[dict[str, Array], list[str]]:
    """The signals, positions summed where the log has their speed, and what is said of that."""
    said = list[str]()
    for name in (name for name, spec in specs.items() if spec.summed and name != "t"):
        with np.errstate(invalid="ignore"):  # of times that are none, which are refused later
            step = np.diff(signals["t"], prepend=signals["t"][:1])
        signals = {**signals, name: summed(signals[name], step)}
        said.append(
            f"{name!r} is the speed {specs[name].column!r} summed over time: so is its noise, which"
            " makes part of what a run leaves of the position, and of what seems missing"
        )
    return signals, said
