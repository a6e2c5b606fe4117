"""Drop a log: the zone, the log's columns, its card as a form, and the doctor's picture."""

import secrets
import shutil
from datetime import UTC, datetime
from pathlib import Path

from starlette.datastructures import UploadFile
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from identification.errors import BadCard, UserError
from workbench.page import log_views
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
from workbench.page.dropped import (
    ENDINGS,
    card_of,
    file_name,
    folder_of,
    log_of,
    store,
)
from workbench.page.pages import go, show
from workbench.page.visitors import Visitor, changing, reading
from workbench.page.visitors import form_of as given_form
from workbench.page.work import shown_tasks
from workbench.registry.access import audit
from workbench.registry.bench import Bench, Upload

LONGEST_SHOWN = 200  # characters of a file's name as it was given


def zone(request: Request, visitor: Visitor) -> Response:
    """Where a log is dropped, and the last ones."""
    uploads = _bench(request).uploads()
    most = request.app.state.settings.most_bytes
    return show(request, visitor, "zone", title="Drop a log", uploads=uploads, endings=ENDINGS,
                most=most)  # fmt: skip


def drop(request: Request, visitor: Visitor) -> Response:
    """Take a log; what its name and its first bytes say has to be a log."""
    given = given_form(request).get("log")
    if not isinstance(given, UploadFile) or not given.filename:
        raise HTTPException(400, "No file came; choose one.")
    if (given.size or 0) > request.app.state.settings.most_bytes:
        raise HTTPException(413, "The file is too large; cut the log.")
    upload, name = secrets.token_hex(8), file_name(given.filename)
    root = request.app.state.settings.root
    size, digest = store(root, upload, name, given.file)
    try:
        request.app.state.helpers(log_views.refuse_no_log, log_of(root, upload))
    except UserError:
        shutil.rmtree(folder_of(root, upload), ignore_errors=True)
        raise
    shown = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in given.filename)
    now = datetime.now(UTC)
    _bench(request).add(Upload(upload, shown[:LONGEST_SHOWN], size, digest, visitor.name, now))
    return go(request, f"/drop/{upload}")


def dropped(request: Request, visitor: Visitor) -> Response:
    """A dropped log's page; its parts come by themselves."""
    upload = _upload(request)
    tasks = shown_tasks(request, upload.id)
    return show(request, visitor, "dropped", title=upload.file, upload=upload, tasks=tasks,
                upload_id=upload.id)  # fmt: skip


def columns(request: Request, visitor: Visitor) -> Response:
    """Every column over time, before anything is known of it; the card is looked for after it."""
    upload, path = _upload(request), _log(request)
    try:
        html, rows = request.app.state.helpers(log_views.columns_chart, path, upload.file)
        response = show(request, visitor, "chart", html=html, said=f"{rows} rows")
    except UserError as error:
        response = show(request, visitor, "said", said=str(error), bad=True)
    response.headers["HX-Trigger-After-Settle"] = "columns-ready"
    return response


def card(request: Request, visitor: Visitor) -> Response:
    """The card as a form: as it was corrected, else as `init` proposes it."""
    form, said = stored_form(_folder(request)), ""
    if form is None:
        form, said = _proposed(request)
        said = said or _store_card(request, form)
    response = _form(request, visitor, form, said)
    response.headers["HX-Trigger-After-Settle"] = "card-ready"
    return response


def correct(request: Request, visitor: Visitor) -> Response:
    """Take the corrected card; one that does not read the log is reported, and the last one
    stays."""
    before = stored_form(_folder(request)) or _proposed(request)[0]
    form = before.with_fields(given_form(request))
    said = _store_card(request, form)
    if not said:
        upload = _upload(request)
        audit(request.app.state.registry.database, "card_corrected", upload.id, form["name"],
              by=visitor.name, now=datetime.now(UTC))  # fmt: skip
    response = _form(request, visitor, form, said, saved=not said)
    if not said:
        response.headers["HX-Trigger"] = "card-changed"
    return response


def picture(request: Request, visitor: Visitor) -> Response:
    """The doctor's picture of the log by its card."""
    path, place = _log(request), _card(request)
    if not place.exists():
        return show(request, visitor, "said", said="The card does not read the log yet.", bad=False)
    try:
        html = request.app.state.helpers(log_views.doctor_chart, path, place)
    except UserError as error:
        return show(request, visitor, "said", said=str(error), bad=True)
    return show(request, visitor, "chart", html=html, said="")


def words(request: Request, visitor: Visitor) -> Response:
    """What the doctor finds identifiable in the log."""
    path, place = _log(request), _card(request)
    if not place.exists():
        return show(request, visitor, "said", said="", bad=False)
    try:
        found = request.app.state.helpers.slowly(log_views.doctor_words, path, place)
    except UserError as error:
        return show(request, visitor, "said", said=str(error), bad=True)
    return show(request, visitor, "words", found=found)


def card_file(request: Request, _visitor: Visitor) -> Response:
    """The card itself."""
    place = _card(request)
    if not place.exists():
        raise HTTPException(404, "No card yet.")
    headers = {"Content-Disposition": 'attachment; filename="card.toml"'}
    return Response(place.read_text("utf-8"), headers=headers, media_type="text/plain")


def _form(
    request: Request, visitor: Visitor, form: CardForm, said: str, *, saved: bool = False
) -> Response:
    return show(
        request, visitor, "card", form=form, said=said, saved=saved, upload=_upload(request),
        signals=FORM_SIGNALS, signal_words=SIGNAL_WORDS, kinds=KIND_WORDS, numbers=RIG_NUMBERS,
    )  # fmt: skip


def _proposed(request: Request) -> tuple[CardForm, str]:
    """The proposal as a form and why there is none, as far as that is known."""
    path, upload = _log(request), _upload(request)
    helpers = request.app.state.helpers
    try:
        return form_of(helpers.slowly(log_views.proposal, path), upload.file), ""
    except UserError as error:
        return empty_form(helpers(log_views.headers, path), path.stem), str(error)


def _store_card(request: Request, form: CardForm) -> str:
    """Keep form and card where it reads the log; else why it does not."""
    path, place = _log(request), _card(request)
    part = place.with_name(f"new-{place.name}")
    try:
        part.write_text(form.text(path.name), encoding="utf-8")
        refused: str = request.app.state.helpers(log_views.card_refused, part, path)
        if refused:
            return refused.replace(part.name, "the card")
        part.replace(place)
        form.store(place.parent)
    except BadCard as error:
        return str(error)
    finally:
        part.unlink(missing_ok=True)
    return ""


def _bench(request: Request) -> Bench:
    return Bench(request.app.state.registry.database)


def _upload(request: Request) -> Upload:
    return _bench(request).upload(request.path_params["upload"])


def _folder(request: Request) -> Path:
    return folder_of(request.app.state.settings.root, request.path_params["upload"])


def _log(request: Request) -> Path:
    return log_of(request.app.state.settings.root, request.path_params["upload"])


def _card(request: Request) -> Path:
    return card_of(request.app.state.settings.root, request.path_params["upload"])


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
