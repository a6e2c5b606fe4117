"""A card as the fields of a form: filled from `init`'s proposal, corrected, and written as TOML."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter

from identification.errors import BadCard
from workbench.cards.card_text import Line, card_text
from workbench.output import write_whole

if TYPE_CHECKING:
    from workbench.steps.first_card.proposal import Proposal

FORM_FILE = "form.json"
FORM_SIGNALS = ("t", "y", "r", "F", "u", "p_p", "p_n")
SIGNAL_WORDS = {
    "t": "time",
    "y": "position",
    "r": "reference of the position",
    "F": "force on the body",
    "u": "command",
    "p_p": "pressure, positive side",
    "p_n": "pressure, negative side",
}
KIND_WORDS = {
    "electro-pneumatic": "two pressures make the force",
    "force": "the force is logged",
    "motor": "the force is a constant times the command",
    "velocity": "the velocity follows the command (a valve and cylinder)",
}
RIG_NUMBERS = {  # key of the card: label, and unit
    "area_p_m2": ("area, positive side", "m^2"),
    "area_n_m2": ("area, negative side", "m^2"),
    "supply_pressure_pa": ("supply pressure", "Pa"),
    "force_per_command": ("force per command", "N, or N m, for one unit of u"),
    "control_limit": ("limit of the command", "unit of u"),
}
LONGEST_FIELD = 200
OTHER_FIELD = "other"  # names the guess that is to be what it would be otherwise
_TEXTS = ("force_per_command", "control_limit")  # that may be "35 N/A" too


@dataclass(frozen=True)
class CardForm:
    """The fields by name, each a text; columns: key and words of each column that may be chosen.

    why: by field, how sure the proposal is of it and why; layout: the card's [file]; others: by
    field, what it would be otherwise in words, and the fields that are then others.
    """

    fields: Mapping[str, str]
    columns: Sequence[tuple[str, str]]
    why: Mapping[str, tuple[bool, str]] = field(default_factory=dict)
    remarks: Sequence[str] = ()
    layout: Mapping[str, Any] = field(default_factory=dict)
    others: Mapping[str, tuple[str, Mapping[str, str]]] = field(default_factory=dict)

    def __getitem__(self, name: str) -> str:
        return self.fields.get(name, "")

    def with_fields(self, given: Mapping[str, Any]) -> "CardForm":
        """The form with what a visitor has put into its fields; others are left out."""
        texts = {
            name: " ".join(str(given.get(name, "")).split())[:LONGEST_FIELD] for name in _names()
        }
        wanted, back = str(given.get(OTHER_FIELD, "")), dict[str, tuple[str, Mapping[str, str]]]()
        if wanted in self.others:
            new = self.others[wanted][1]
            back[wanted] = (self._shown(wanted), {name: texts[name] for name in new})
            texts |= new
        changed = {name for name in texts if texts[name] != self[name]}
        changed |= {f"column_{name.partition('_')[2]}" for name in changed if "_" in name}
        changed |= {"kind", "motion"} if {"kind", "motion"} & changed else set()
        why = {name: said for name, said in self.why.items() if name not in changed}
        others = {name: one for name, one in self.others.items() if name not in changed}
        return CardForm(texts, self.columns, why, self.remarks, self.layout, {**others, **back})

    def _shown(self, name: str) -> str:
        """What a field holds, as the other of a guess is shown."""
        part, _, signal = name.partition("_")
        if part != "column" or signal not in FORM_SIGNALS:
            return self[name] or "none"
        words = dict(self.columns).get(self[name], "no column")
        return f"{words} {self[f'unit_{signal}']}".strip()

    def text(self, file: str) -> str:
        """The card; raises BadCard where a field can be none."""
        signals = [line for name in FORM_SIGNALS if (line := self._signal(name)) is not None]
        rig = [
            Line("kind", self["kind"], self._remark("kind")),
            Line("motion", self["motion"] or "linear", self._remark("motion")),
        ]
        rig += [Line(k, self._number(k), self._remark(k)) for k in RIG_NUMBERS if self[k]]
        tables: dict[str, list[Line]] = {
            "card": [Line("name", self["name"])], "rig": rig, "signals": signals,
        }  # fmt: skip
        if self.layout:
            tables["file"] = [Line(key, value) for key, value in self.layout.items()]
        return card_text([f"Made on the page from {file}."], tables, self.remarks)

    def _signal(self, name: str) -> Line | None:
        column = self[f"column_{name}"]
        if not column:
            return None
        if column not in [key for key, _ in self.columns]:
            raise BadCard(f"{SIGNAL_WORDS[name]}: the log has no such column; choose one")
        value: dict[str, Any] = {"column": json.loads(column), "unit": self[f"unit_{name}"]}
        gain = self[f"gain_{name}"]
        if gain:
            try:
                value["gain"] = float(gain.replace(",", "."))
            except ValueError:
                value["gain"] = gain
        if self[f"bits_{name}"].isdigit():
            value |= {"bits": int(self[f"bits_{name}"]), "signed": True}
        if self[f"summed_{name}"]:
            value["summed"] = True
        return Line(name, value, self._remark(f"column_{name}"))

    def _remark(self, name: str) -> str:
        """How sure a field is and why, and what it would be otherwise; of a corrected one this
        alone."""
        sure, why = self.why.get(name, (True, ""))
        said = [f"{'sure' if sure else 'guess'}: {why}"] if why else []
        said += [f"else {self.others[name][0]}"] if name in self.others else []
        return "; ".join(said)

    def _number(self, key: str) -> float | str:
        text = self[key]
        try:
            return float(text.replace(",", "."))
        except ValueError:
            if key in _TEXTS:
                return text
            label, unit = RIG_NUMBERS[key]
            raise BadCard(f"{label}: {text!r} is no number; give it in {unit}") from None

    def store(self, folder: Path) -> None:
        """Write the form beside its log."""
        write_whole(folder / FORM_FILE, FORM.dump_json(self).decode(), "form")


FORM = TypeAdapter(CardForm)


def stored_form(folder: Path) -> CardForm | None:
    """The form that was kept beside a log; None where there is none."""
    path = folder / FORM_FILE
    return FORM.validate_json(path.read_bytes()) if path.exists() else None


def form_of(of: "Proposal", file: str) -> CardForm:
    """The proposal as a form; file: name of the log, of which the machine's is made."""
    why = {_field(one.key): (one.sure, one.why) for one in of.rig}
    why |= {f"column_{one.name}": (one.sure, one.why) for one in of.signals}
    columns = [(json.dumps(one.raw.key), one.raw.header or one.shown) for one in of.columns]
    unused = [f"left out: column {shown}: {why}" for shown, why in of.unused.items()]
    layout = of.spec.model_dump(exclude_defaults=True)
    remarks = [*of.hardly, *of.remarks, *unused]
    return CardForm(_fields(of), columns, why, remarks, layout, _others(of))


def _field(key: str) -> str:
    return "control_limit" if key == "control_limit_v" else key


def _fields(of: "Proposal") -> dict[str, str]:
    """The proposal as fields by name."""
    fields = {"name": of.name, "kind": of.kind, "motion": of.motion}
    for one in of.rig:
        fields[_field(one.key)] = "" if one.value is None else _written(one.value)
    for signal in of.signals:
        name = signal.name
        fields[f"column_{name}"] = json.dumps(signal.column)
        fields[f"unit_{name}"] = signal.unit
        fields[f"gain_{name}"] = "" if signal.gain is None else _written(signal.gain)
        fields[f"bits_{name}"] = "" if signal.bits is None else str(signal.bits)
        fields[f"summed_{name}"] = "summed" if signal.summed else ""
    return fields


def _others(of: "Proposal") -> dict[str, tuple[str, Mapping[str, str]]]:
    """By the field of each guess that has another, this in words, and the fields that change."""
    from workbench.steps.first_card.answers import THE_OTHER, BadAnswer, with_rig, with_signal

    before, out = _fields(of), dict[str, tuple[str, Mapping[str, str]]]()
    guesses: list[tuple[str, str, Callable[[Proposal, str, str], Proposal], str]]
    guesses = [(_field(one.key), one.rival, with_rig, one.key) for one in of.rig if not one.sure]
    guesses += [(f"column_{one.name}", one.rival, with_signal, one.name)
                for one in of.signals if not one.sure]  # fmt: skip
    for name, rival, changed, key in guesses:
        if not rival:
            continue
        try:
            after = _fields(changed(of, key, THE_OTHER))
        except BadAnswer:
            continue
        every = dict.fromkeys([*before, *after])
        out[name] = (rival, {one: after.get(one, "") for one in every
                             if after.get(one, "") != before.get(one, "")})  # fmt: skip
    return out


def empty_form(columns: Sequence[tuple[str, str | int, str]], name: str) -> CardForm:
    """A form to be filled by hand, where `init` proposes nothing."""
    fields = {"name": name, "kind": "force", "motion": "linear"}
    return CardForm(fields, [(json.dumps(key), shown) for shown, key, why in columns if not why])


def _names() -> list[str]:
    """Every field of the form."""
    parts = [f"{part}_{name}" for name in FORM_SIGNALS for part in ("column", "unit", "gain",
                                                                    "bits", "summed")]  # fmt: skip
    return ["name", "kind", "motion", *RIG_NUMBERS, *parts]


def _written(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.12g}"
