"""Drop a log: the zone, the log's columns, its card as the fields of a form, filled from `init`'s
proposal, corrected, and written as TOML; and the doctor's picture."""

import json
import secrets
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter
from starlette.datastructures import UploadFile
from starlette.exceptions import HTTPException
from starlette.responses import Response
from starlette.routing import Route

from identification.errors import BadCard, UserError
from workbench.cards.card_text import Line, card_text
from workbench.jobs.options import clock
from workbench.output import write_whole
from workbench.page import inspection
from workbench.page.asked import Asked, download
from workbench.page.dropped import ENDINGS, file_name
from workbench.page.visitors import changing, reading
from workbench.page.work import shown_tasks
from workbench.registry.tables import UploadRow

if TYPE_CHECKING:
    from design.first_card.proposal import Proposal


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
    remarks = [*of.hardly, *of.remarks, *unused]
    return CardForm(_fields(of), columns, why, remarks, dict(of.layout), _others(of))


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
    from design.first_card.answers import THE_OTHER, BadAnswer, with_rig
    from workbench.steps.first_card.proposal import with_signal

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


LONGEST_SHOWN = 200  # characters of a file's name as it was given


def zone(asked: Asked) -> Response:
    """Where a log is dropped, and the last ones."""
    return asked.show("zone", title="Drop a log", uploads=asked.bench.uploads(), endings=ENDINGS,
                      most=asked.server.settings.most_bytes)  # fmt: skip


def drop(asked: Asked) -> Response:
    """Take a log; what its name and its first bytes say has to be a log."""
    given = asked.given("log")
    if not isinstance(given, UploadFile) or not given.filename:
        raise HTTPException(400, "No file came; choose one.")
    if (given.size or 0) > asked.server.settings.most_bytes:
        raise HTTPException(413, "The file is too large; cut the log.")
    files = asked.drop_of(secrets.token_hex(8))
    size, digest = files.store(file_name(given.filename), given.file)
    try:
        asked.server.helpers(inspection.refuse_no_log, files.log)
    except UserError:
        shutil.rmtree(files.folder, ignore_errors=True)
        raise
    shown = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in given.filename)
    asked.bench.add(UploadRow(id=files.upload, file=shown[:LONGEST_SHOWN], size=size, sha256=digest,
                              made_by=asked.visitor.name, at=clock()))  # fmt: skip
    return asked.go(f"/drop/{files.upload}")


def dropped(asked: Asked) -> Response:
    """A dropped log's page; its parts come by themselves."""
    upload = _upload(asked)
    tasks = shown_tasks(asked, upload.id)
    return asked.show("dropped", title=upload.file, upload=upload, tasks=tasks, upload_id=upload.id)


def columns(asked: Asked) -> Response:
    """Every column over time, before anything is known of it; the card is looked for after it."""
    upload, path = _upload(asked), asked.drop.log
    try:
        html, rows = asked.server.helpers(inspection.columns_chart, path, upload.file)
        response = asked.show("chart", html=html, said=f"{rows} rows")
    except UserError as error:
        response = _said(asked, str(error))
    response.headers["HX-Trigger-After-Settle"] = "columns-ready"
    return response


def card(asked: Asked) -> Response:
    """The card as a form: as it was corrected, else as `init` proposes it."""
    form, said = stored_form(asked.drop.folder), ""
    try:
        if form is None:
            form, said = _proposed(asked)
            said = said or _store_card(asked, form)
        response = _form(asked, form, said)
    except UserError:  # which stands where the columns would
        response = _said(asked, "No card: the log cannot be read.", bad=False)
    response.headers["HX-Trigger-After-Settle"] = "card-ready"
    return response


def correct(asked: Asked) -> Response:
    """Take the corrected card; one that does not read the log is reported, and the last one
    stays."""
    before = stored_form(asked.drop.folder) or _proposed(asked)[0]
    form = before.with_fields(asked.form or {})
    said = _store_card(asked, form)
    if said:
        return _form(asked, form, said)
    asked.audit("card_corrected", asked["upload"], form["name"])
    response = _form(asked, form, "", saved=True)
    response.headers["HX-Trigger"] = "card-changed"
    return response


def picture(asked: Asked) -> Response:
    """The doctor's picture of the log by its card."""
    path, place = asked.drop.log, asked.drop.card
    if not place.exists():
        return _said(asked, "Nothing to show until a card reads the log.", bad=False)
    try:
        html = asked.server.helpers(inspection.doctor_chart, path, place)
    except UserError as error:
        return _said(asked, str(error))
    return asked.show("chart", html=html, said="")


def words(asked: Asked) -> Response:
    """What the doctor finds identifiable in the log."""
    path, place = asked.drop.log, asked.drop.card
    if not place.exists():
        return _said(asked, "", bad=False)
    try:
        found = asked.server.helpers.slowly(inspection.doctor_words, path, place)
    except UserError as error:
        return _said(asked, str(error))
    return asked.show("words", found=found)


def card_file(asked: Asked) -> Response:
    if not asked.drop.card.exists():
        raise HTTPException(404, "No card yet.")
    return download(asked.drop.card.read_text("utf-8"), "card.toml", "text/plain")


def _said(asked: Asked, said: str, *, bad: bool = True) -> Response:
    """A line in place of a part."""
    return asked.show("said", said=said, bad=bad)


def _form(asked: Asked, form: CardForm, said: str, *, saved: bool = False) -> Response:
    return asked.show(
        "card", form=form, said=said, saved=saved, upload=_upload(asked), signals=FORM_SIGNALS,
        signal_words=SIGNAL_WORDS, kinds=KIND_WORDS, numbers=RIG_NUMBERS,
    )  # fmt: skip


def _proposed(asked: Asked) -> tuple[CardForm, str]:
    """The proposal as a form and why there is none, as far as that is known."""
    path, upload, helpers = asked.drop.log, _upload(asked), asked.server.helpers
    try:
        return form_of(helpers.slowly(inspection.proposal, path), upload.file), ""
    except UserError as error:
        return empty_form(helpers(inspection.headers, path), path.stem), str(error)


def _store_card(asked: Asked, form: CardForm) -> str:
    """Keep form and card where it reads the log; else why it does not."""
    path, place = asked.drop.log, asked.drop.card
    part = place.with_name(f"new-{place.name}")
    try:
        part.write_text(form.text(path.name), encoding="utf-8")
        refused = asked.server.helpers(inspection.card_refused, part, path)
        if refused:
            return refused.replace(part.name, "the card")
        part.replace(place)
        form.store(place.parent)
    except BadCard as error:
        return str(error)
    finally:
        part.unlink(missing_ok=True)
    return ""


def _upload(asked: Asked) -> UploadRow:
    return asked.bench.upload(asked["upload"])


DROP_ROUTES = [
    Route("/drop", reading(zone)),
    Route("/drop", changing(drop), methods=["POST"]),
    Route("/drop/{upload}", reading(dropped)),
    Route("/drop/{upload}/columns", reading(columns)),
    Route("/drop/{upload}/card", reading(card)),
    Route("/drop/{upload}/card", changing(correct), methods=["POST"]),
    Route("/drop/{upload}/card.toml", reading(card_file)),
    Route("/drop/{upload}/picture", reading(picture)),
    Route("/drop/{upload}/words", reading(words)),
]
