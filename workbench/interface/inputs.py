"""What a caller gives: logs as tables or paths, a machine as a card or in keywords with units.

A log is a DataFrame (or what makes one), a path, or the name of a file of the card's set; several
of one machine go as a list. The machine is said by `card` (a path, the name of a shipped card, or a
card that is read), or by `rig` and `signals`:

    rig = "motor"                                     # all columns in SI
    rig = {"kind": "electro-pneumatic", "area_p": "12.6 cm^2", "area_n": "10 cm^2",
           "supply_pressure": "5 bar"}
    signals = {"y": "position [mm]", "u": ("valve", "V"), "F": {"column": 3, "unit": "kN"}}

Keys of `rig` are a card's, also without the unit in them, then as numbers in SI or texts with a
unit. Without `signals` the columns are those named as signals are (`t`, `y`, `F`, ...), a unit in
brackets behind the name included; an index of times counts as a column. Errors of what was given
are `UserError`, a line that says what to do.
"""

import hashlib
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, Union

import numpy as np

from design.machine.nearest import nearest
from identification.effects._library import Library
from identification.errors import BadCard, BadLog
from workbench.cards.card import Card, card_from, load_card
from workbench.cards.card_tables import FileSpec
from workbench.cards.own_effects import library
from workbench.cards.units import conversion, parse_gain, si_unit
from workbench.logs.clocks import named_in_turn
from workbench.logs.sources import Recorded, Sources, card_path, sources_of
from workbench.logs.table import RawColumn, Table
from workbench.logs.tables import read_table

if TYPE_CHECKING:
    import pandas as pd

PathLike: TypeAlias = str | os.PathLike[str]
LogLike: TypeAlias = Union["pd.DataFrame", Mapping[str, Any], PathLike]
Logs: TypeAlias = LogLike | Sequence[LogLike]
CardLike: TypeAlias = Card | PathLike
RigLike: TypeAlias = str | Mapping[str, Any]
Signals: TypeAlias = Mapping[str, Any]

CANONICAL_SIGNALS = ("t", "y", "r", "F", "p_p", "p_n", "u")
KEYWORDS = "keyword arguments"  # what messages call a card that is none
_UNNAMED = "machine"
_WITH_UNIT = re.compile(r"\s*(.*?)\s*[\[(]\s*([^\[\]()]+?)\s*[\])]\s*")
_RIG_KEYS: Mapping[str, tuple[str, tuple[str, ...]]] = {  # key of a card, SI units it may have
    "area_p": ("area_p_m2", ("m^2",)),
    "area_n": ("area_n_m2", ("m^2",)),
    "supply_pressure": ("supply_pressure_pa", ("Pa",)),
    "stroke": ("stroke_m", ("m", "rad")),
}


def sources(
    logs: Logs, card: CardLike | None, rig: RigLike | None, signals: Signals | None
) -> Sources:
    """The runs of the logs, read by a card or by what the keywords say of machine and columns.

    Raises BadCard, BadLog as the commands do.
    """
    several = isinstance(logs, Sequence) and not isinstance(logs, str)
    every: Sequence[LogLike] = logs if several else [logs]  # type: ignore[assignment,list-item]
    if not every:
        raise BadLog("no log given; give a DataFrame, a path, or a list of them")
    found = [
        os.fspath(one) if isinstance(one, str | os.PathLike) else _recorded(one, k)
        for k, one in enumerate(every)
    ]
    if card is not None:
        if rig is not None or signals is not None:
            raise BadCard(
                "a card, and rig or signals beside it; a card says both, give one of them"
            )
        return sources_of(found, read_card(card))
    if rig is None:
        raise BadCard('no machine given; give card = "card.toml", or rig = "motor" and the like')
    first = found[0]
    table = first.table if isinstance(first, Recorded) else read_table(Path(first), FileSpec())
    return sources_of(found, _card(rig, signals, table.names))


def effects_of(folders: Iterable[PathLike] | PathLike) -> Library:
    """The library with the effects in these folders, or in this one."""
    several = [folders] if isinstance(folders, str | os.PathLike) else folders
    return library([Path(one) for one in several])


def read_card(card: CardLike) -> Card:
    """A card by its path or the name of a shipped one; one that is read already as it is."""
    if isinstance(card, Card):
        return card
    return load_card(card_path(os.fspath(card)), with_recipe=False)


def _recorded(log: Any, number: int) -> Recorded:
    """A DataFrame, or what makes one, as a log; an index that is no count is a column too."""
    import pandas as pd

    if log is None or np.isscalar(log):
        raise BadLog(f"{type(log).__name__} found, a log needed: a path, a DataFrame, an array")
    frame = log if isinstance(log, pd.DataFrame) else pd.DataFrame(log)
    if not isinstance(frame.index, pd.RangeIndex):
        frame = frame.reset_index()
    usual = "DataFrame" if number == 0 else f"DataFrame {number + 1}"
    names = tuple(str(column) for column in frame.columns)
    columns = [_values(frame.iloc[:, k]) for k in range(len(names))]
    digest = hashlib.sha256()
    for name, values in zip(names, columns, strict=True):
        raw = repr(values.tolist()).encode() if values.dtype.kind == "O" else values.tobytes()
        digest.update(name.encode() + raw)
    table = Table(names, columns.__getitem__, first_row=0)
    called = str(frame.attrs.get("name") or usual)
    return Recorded(called, named_in_turn(table) or table, digest.hexdigest())


def _values(series: "pd.Series[Any]") -> RawColumn:
    """A column as logs have it: numbers with NaN, times, or texts with None for a missing one."""
    import pandas as pd

    if pd.api.types.is_numeric_dtype(series.dtype):
        return np.asarray(series.to_numpy(dtype=np.float64, na_value=np.nan))
    values = np.asarray(series.to_numpy())
    if values.dtype.kind == "O":
        values[np.asarray(series.isna())] = None
    return values


def _card(rig: RigLike, signals: Signals | None, names: Sequence[str]) -> Card:
    """The card that the keywords make."""
    said = {"kind": rig} if isinstance(rig, str) else dict(rig)
    name = str(said.pop("name", _UNNAMED))
    table = dict(_rig_entry(key, value) for key, value in said.items())
    motion = "rotary" if table.get("motion") == "rotary" else "linear"
    wanted: dict[str, Any] = dict(_found(names)) if signals is None else dict(signals)
    for signal in ("t", "y"):  # which every machine needs
        if signal not in wanted:
            raise BadCard(
                f"no column for the signal {signal!r}; name it, as in signals = {{{signal!r}:"
                f' "position [mm]", ...}}{nearest(signal, names)}'
            )
    raw = {
        "card": {"name": name},
        "rig": table,
        "signals": {key: _signal(key, value, names, motion) for key, value in wanted.items()},
    }
    return card_from(raw, Path(KEYWORDS))


def _found(names: Sequence[str]) -> dict[str, str]:
    """The columns that are named as signals are, with or without a unit behind the name."""
    found = {}
    for column in names:
        with_unit = _WITH_UNIT.fullmatch(column)
        name = with_unit[1] if with_unit else column.strip()
        if name in CANONICAL_SIGNALS and name not in found:
            found[name] = column
    return found


def _signal(signal: str, said: Any, names: Sequence[str], motion: Any) -> dict[str, Any]:
    """A signal's table of a card: of a column's name with or without "[unit]", a pair, a table."""
    si = si_unit(signal, motion) or "1"
    if isinstance(said, Mapping):
        return {"unit": si, **said}
    if isinstance(said, tuple | list):
        column, unit = said
        return {"column": column, "unit": str(unit)}
    if isinstance(said, int):
        return {"column": said, "unit": si}
    with_unit = _WITH_UNIT.fullmatch(str(said))
    if with_unit is None:
        return {"column": str(said), "unit": si}
    whole = str(said) in names
    return {"column": str(said) if whole else with_unit[1], "unit": with_unit[2]}


def _rig_entry(key: str, value: Any) -> tuple[str, Any]:
    """A key of a card's [rig] and its value in SI, of a number or a text with its unit."""
    if key not in _RIG_KEYS:
        return key, value
    own, units = _RIG_KEYS[key]
    if isinstance(value, tuple | list):
        return own, [_quantity(key, one, units) for one in value]
    return own, _quantity(key, value, units)


def _quantity(key: str, value: Any, units: Sequence[str]) -> Any:
    if not isinstance(value, str):
        return float(value) if isinstance(value, int | np.number) else value
    said = f"rig {key} = {value!r}"
    try:
        number, unit = parse_gain(value)
        found = [conversion(unit or "1", one) for one in units]
    except (ValueError, BadCard) as error:
        raise BadCard(f'{said}: {error}; a number with its unit needed, as in "5 bar"') from None
    scale = next((one for one in found if one is not None), None)
    if scale is None:
        raise BadCard(f"{said}: a unit such as {' or '.join(units)} needed")
    return scale.factor * number + scale.shift
