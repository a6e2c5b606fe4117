"""Units as logs of machines write them, in the languages of their loggers."""

import re
import tomllib
import unicodedata
from collections.abc import Iterator
from dataclasses import replace
from importlib.resources import files

from identification.columns.header import WrittenUnit

LOG_WORDS = tomllib.loads((files("workbench.cards") / "log_words.toml").read_text("utf-8"))


def _table() -> Iterator[tuple[str, WrittenUnit]]:
    for table, rotary in (("units", False), ("rotary_units", True)):
        for quantity, units in LOG_WORDS[table].items():
            for card, spellings in units.items():
                for one in spellings.split():
                    yield one, WrittenUnit(card, quantity, rotary)


# "nm" stands for both nanometres and newton metres; its case says which.
_UNITS = dict(_table())
_NEWTON_METRE, _NANOMETRE = _UNITS["nm"], WrittenUnit("nm", "position")
_SCALED = re.compile(r"(\d*[.,]?\d+)\s*([^\W\d].*|%.*|°.*)")


def written_unit(text: str) -> WrittenUnit | None:
    """The unit of that spelling; None where it is none that logs of machines have."""
    found = unicodedata.normalize("NFKC", text).strip()
    if found in ("nm", "Nm", "NM"):
        return _NANOMETRE if found == "nm" else _NEWTON_METRE
    if found in ("mpa", "MPa", "MPA"):  # no log is in millipascal
        return _UNITS["mpa"]
    if found in ("mN", "MN"):
        return replace(_UNITS["mn"], card=found)
    if found.startswith("% "):  # of what: "% of rated torque"
        return _UNITS["%"]
    if scaled := _SCALED.fullmatch(found):  # "0.1 rpm"
        own = written_unit(scaled[2])
        return replace(own, card=f"{scaled[1].replace(',', '.')} {own.card}") if own else None
    found = found.replace("μ", "µ").casefold().replace("μ", "µ")
    plain = found.replace(" ", "")
    return _UNITS.get(found) or _UNITS.get(plain) or _UNITS.get(plain.replace(".", "-"))
