"""Drop a log: the zone, the log's columns, its card as a form, and the doctor's picture."""

import secrets
import shutil

from starlette.datastructures import UploadFile
from starlette.exceptions import HTTPException
from starlette.responses import Response
from starlette.routing import Route

from identification.errors import BadCard, UserError
from workbench.jobs.options import clock
from workbench.page import looks
from workbench.page.asked import Asked, download
from workbench.page.card_form import (
    FORM_SIGNALS,
    KIND_WORDS,
    RIG_NUMBERS,
    SIGNAL_WORDS,
    CardForm,
    empty_form,
    form_of,
    stored_form,
)
from workbench.page.dropped import ENDINGS, file_name
from workbench.page.visitors import changing, reading
from workbench.page.work import shown_tasks
from workbench.registry.tables import UploadRow

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
        asked.server.helpers(looks.refuse_no_log, files.log)
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
        html, rows = asked.server.helpers(looks.columns_chart, path, upload.file)
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
        html = asked.server.helpers(looks.doctor_chart, path, place)
    except UserError as error:
        return _said(asked, str(error))
    return asked.show("chart", html=html, said="")


def words(asked: Asked) -> Response:
    """What the doctor finds identifiable in the log."""
    path, place = asked.drop.log, asked.drop.card
    if not place.exists():
        return _said(asked, "", bad=False)
    try:
        found = asked.server.helpers.slowly(looks.doctor_words, path, place)
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
        return form_of(helpers.slowly(looks.proposal, path), upload.file), ""
    except UserError as error:
        return empty_form(helpers(looks.headers, path), path.stem), str(error)


def _store_card(asked: Asked, form: CardForm) -> str:
    """Keep form and card where it reads the log; else why it does not."""
    path, place = asked.drop.log, asked.drop.card
    part = place.with_name(f"new-{place.name}")
    try:
        part.write_text(form.text(path.name), encoding="utf-8")
        refused = asked.server.helpers(looks.card_refused, part, path)
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
