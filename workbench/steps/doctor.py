"""A log checked before any fit, read by its card.

A log is repaired, refused and resampled as for `identify`.
"""

from pathlib import Path

from design.identified.examined import CheckedLog, Examined, examined, with_limits
from identification.errors import BadLog
from identification.log import Log
from identification.signals.check import check_time
from identification.signals.clean import Prepared
from identification.signals.even_clock import even_clock
from identification.signals.sensor_state import clock_of
from workbench.cards.card import Card
from workbench.cards.headers import contradicted_units, log_remarks
from workbench.cards.units import conversion
from workbench.logs.runs import longest_run, runs_of, table_of, with_force


def checked_log(path: Path, card: Card) -> CheckedLog:
    """The log in the file, read by its card, repaired and cut into runs.

    A log that `identify` would refuse is looked at as far as it goes. Raises BadLog or BadCard
    where the file cannot be read at all.
    """
    table = table_of(path, card)
    raw, _ = longest_run(table, path, card)
    clock = clock_of(raw["t"])
    spec = card.signals.get("u")
    units = [unit for unit in ("V", "A") if spec is not None and conversion(spec.unit, unit)]
    try:
        made, refused = runs_of(table, path, card), ""
    except BadLog as error:
        made, refused = Prepared(_as_far_as_it_goes(raw, path, card), ()), str(error)
    found = CheckedLog(
        file=path.name,
        rig=card.rig(path.name),
        clock=clock,
        bad=tuple(made.bad),
        refused=refused,
        remarks=tuple(made.remarks),
        command_unit=units[0] if units else "",  # nothing for a share, or where none is logged
        raw=raw,
        runs=made.runs,
    )
    return with_limits(found)


def examine(path: Path, card: Card, *, effects: bool = False) -> Examined:
    """What the log in the file shows, read by its card; effects: also which effects it could show.

    Raises as `checked_log` does.
    """
    found = checked_log(path, card)
    units = list(contradicted_units(card.signals, found.rig).values())
    if found.log is not None and not found.refused:
        units += log_remarks(found.runs, found.rig, card.signals)
    return examined(found, units, effects=effects)


def _as_far_as_it_goes(raw: Log, path: Path, card: Card) -> tuple[Log, ...]:
    """A refused log on an even clock, where that can be had."""
    try:
        check_time(raw)
        return even_clock(with_force(raw, path, card))
    except (BadLog, ValueError):
        return ()
