"""A column's header as it was read: its words, its unit, and the quantities that they mean."""

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Quantity = Literal[
    "time", "position", "velocity", "acceleration", "force", "pressure", "command", "temperature",
    "count", "other",
]  # fmt: skip


Purpose = Literal["reference", "demand", "measured", "error", "model", "filtered", ""]


_ADDRESS = re.compile(r"(?<!\w)0x[0-9a-f]+", re.I)
_GREEK = str.maketrans({"θ": "theta", "φ": "phi", "ω": "omega", "τ": "tau", "α": "alpha",
                        "β": "beta", "ψ": "psi"})  # fmt: skip
SAYS_WHAT_IT_IS = 3.0  # weight of a word that does
NUMBER = re.compile(r"[+-]?(\d+(\.\d*|,\d+)?|[.,]\d+)([eE][+-]?\d+)?|[+-]?inf(inity)?|nan", re.I)
_WORDS_OF_PERIODS = {"ts", "dt", "timestep", "period", "tsample", "increment", "xincrement",
                     "interval", "takt", "taktzeit", "abtastzeit", "zykluszeit"}  # fmt: skip
_TWO_OF_PERIODS = {("delta", "x"), ("delta", "t"), ("sample", "time"), ("sampling", "time")}


@dataclass(frozen=True)
class WrittenUnit:
    """A unit as cards write it, what it measures, and whether of a turning machine."""

    card: str
    quantity: Quantity
    rotary: bool = False

    @property
    def plain(self) -> str:
        """The unit without a number before it: rpm of "0.1 rpm"."""
        return self.card.lstrip("0123456789. ") or self.card


@dataclass(frozen=True)
class Header:
    """A header read: its text, the name without the unit, the unit (None: none), the quantities
    that its words mean with their weight, what the signal is for ("model": what another model
    says; "filtered": a smoothed copy), and whether it speaks of an angle.

    doubtful: the unit may as well belong to the name, as the m of "y_m"; turning: log-odds of a
    machine that turns, by words that others have too; stem: what the name says beside what the
    signal is for: "theta" of "target_theta".
    """

    text: str
    name: str
    unit: WrittenUnit | None
    means: Mapping[Quantity, float]
    purpose: Purpose
    angle: bool
    doubtful: bool = False
    turning: float = 0.0
    stem: tuple[str, ...] = ()

    @property
    def speed(self) -> bool:
        """Whether it says that the column is a speed, and no position."""
        if self.unit is not None and not self.doubtful:
            return self.unit.quantity == "velocity"
        return self.means.get("velocity", 0.0) >= SAYS_WHAT_IT_IS and "position" not in self.means


def is_position(head: Header) -> bool:
    """Whether a header speaks of a position that is measured."""
    if head.purpose in ("reference", "error", "model"):
        return False
    if head.unit is not None:
        counts = head.unit.quantity == "count" and (not head.means or "position" in head.means)
        return counts or head.unit.quantity == "position"
    if not head.means:
        return head.purpose == "measured" and head.unit is None
    return max(head.means, key=lambda what: head.means[what]) == "position"


def words_of(name: str) -> list[str]:
    """The words of a name in small letters: at case, digits and signs it is parted; addresses, as
    0x6064, are none."""
    parted = re.sub(
        r"(?<=[a-zäöüß])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", _ADDRESS.sub(" ", name)
    )
    parted = re.sub(r"(?<=\D)(?=\d)|(?<=\d)(?=\D)", " ", parted)
    parted = unicodedata.normalize("NFD", parted).replace("\u0307", "dot")  # above a letter
    small = unicodedata.normalize("NFC", parted).casefold().translate(_GREEK)
    for umlaut, two in (("ä", "ae"), ("ö", "oe"), ("ü", "ue"), ("é", "e"), ("à", "a"), ("ó", "o")):
        small = small.replace(umlaut, two)
    return [one for one in re.split(r"[\W_]+", small) if one]


def says_period(name: str) -> bool:
    """Whether a name is one of the time from row to row."""
    words = words_of(name)
    return bool(_WORDS_OF_PERIODS & set(words)) or tuple(words[:2]) in _TWO_OF_PERIODS
