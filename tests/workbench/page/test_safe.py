"""Tokens and roles, forms of other sites, hosts, sizes, names that are markup or paths."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from design.judgement import Candidate
from tests.workbench.page.conftest import NOW, Page
from workbench.page.asked import spark
from workbench.page.dropped import ENDINGS, Drop, file_name
from workbench.page.guard import FORM_BYTES
from workbench.page.visitors import CHANGES, TOKEN_COOKIE, WRONG_TRIES, Limiter, csrf_of
from workbench.registry.access import Access, hashed
from workbench.registry.store import Registry
from workbench.registry.tables import AccessTokenRow
from workbench.registry.values import BadRegistry

NASTY = "<img src=x onerror=alert(1)>"
CSV = b"t,y\n" + b"".join(b"%d,%d\n" % (k, k % 7) for k in range(300))


def test_a_token_is_kept_as_its_hash_and_shown_once(where: str) -> None:
    with Registry(where) as registry:
        access = Access(registry.database)
        secret = access.add("anna", "change", by="root", now=NOW)
        found = access.of(secret)
        assert found is not None and (found.name, found.role) == ("anna", "change")
        assert access.of(secret[:-1]) is None and access.of(hashed(secret)) is None
        with registry.database.reading() as session:
            kept = [tuple(map(str, vars(row).values())) for row in session.query(AccessTokenRow)]
        assert secret not in str(kept) and hashed(secret) in str(kept)
        with pytest.raises(BadRegistry, match="exists already"):
            access.add("anna", "read", by="root", now=NOW)
        with pytest.raises(BadRegistry, match="letters, digits"):
            access.add("an na", "read", by="root", now=NOW)
        access.revoke("anna", by="root", now=NOW)
        assert access.of(secret) is None and access.tokens()[0].ended == NOW
        with pytest.raises(BadRegistry, match="there is none"):
            access.revoke("anna", by="root", now=NOW)
        assert [one.kind for one in access.audited(9)] == ["token_revoked", "token_added"]


def test_reading_is_open_or_by_token_and_changing_by_its_role(tmp_path: Path) -> None:
    closed = Page(tmp_path, reading="token")
    with closed.client as client:
        reader, changer = closed.token("r", "read"), closed.token("c", "change")
        assert client.get("/").status_code == 401
        assert client.get("/metrics").status_code == 401
        assert client.get("/health").json() == {"page": "ok", "registry": "ok"}
        assert client.get("/", headers=reader).status_code == 200
        assert (
            client.post("/drop", headers=reader, files={"log": ("a.csv", CSV)}).status_code == 403
        )
        assert client.post("/drop", files={"log": ("a.csv", CSV)}).status_code == 401
        assert (
            client.post("/drop", headers=changer, files={"log": ("a.csv", CSV)}).status_code == 303
        )
    closed.registry.close()


def test_a_browser_signs_in_and_has_to_show_that_the_form_is_ours(page: Page) -> None:
    secret = page.access.add("anna", "change", by="test", now=NOW)
    client = page.client
    wrong = client.post("/sign-in", data={"token": "no"})
    assert wrong.status_code == 401 and TOKEN_COOKIE not in wrong.cookies
    entered = client.post("/sign-in", data={"token": secret})
    cookie = entered.headers["set-cookie"]
    assert "HttpOnly" in cookie and "SameSite=strict" in cookie and "Path=/" in cookie
    form = {"log": ("a.csv", CSV)}
    assert client.post("/drop", files=form).status_code == 403
    ours = {"csrf": csrf_of(secret)}
    other = {"Sec-Fetch-Site": "cross-site"}
    assert client.post("/drop", files=form, data=ours, headers=other).status_code == 403
    assert client.post("/drop", files=form, data={"csrf": csrf_of("x")}).status_code == 403
    assert client.post("/drop", files=form, data=ours).status_code == 303
    assert "anna (change)" in client.get("/").text
    page.access.revoke("anna", by="test", now=NOW)
    assert client.post("/drop", files=form, data=ours).status_code == 401


def test_wrong_tokens_are_counted(page: Page) -> None:
    client, good = page.client, page.token("anna", "read")
    for _ in range(WRONG_TRIES):
        assert client.get("/", headers={"Authorization": "Bearer no"}).status_code == 401
    late = client.get("/", headers={"Authorization": "Bearer no"})
    assert late.status_code == 429 and late.headers["retry-after"] == "60"
    assert client.get("/", headers=good).status_code == 429
    assert client.get("/").status_code == 200  # whoever brings none is not asked


def test_a_limiter_forgets() -> None:
    limiter = Limiter(2, 60.0)
    for at in (0.0, 1.0):
        assert not limiter.full("a", at)
        limiter.count("a", at)
    assert limiter.full("a", 2.0) and not limiter.full("b", 2.0)
    assert not limiter.full("a", 60.5)


@pytest.mark.slow
def test_changes_of_one_token_are_limited(page: Page) -> None:
    changer, why = page.token("anna", "change"), {"reason": "r"}

    def asked() -> int:
        answer = page.client.post("/machine/x/rollback", headers=changer, data=why)
        return int(answer.status_code)

    assert {asked() for _ in range(CHANGES)} == {400}
    assert asked() == 429


def test_every_answer_has_its_headers_and_no_inline_script(page: Page) -> None:
    page.registry.add("a", Candidate({"m": 1}), reason=NASTY, by="t", now=NOW)
    for path in ("/", "/drop", "/audit", "/sign-in", "/machine/a", "/nothing"):
        answer = page.client.get(path)
        policy = answer.headers["content-security-policy"]
        assert "default-src 'none'" in policy and "unsafe" not in policy
        assert answer.headers["x-content-type-options"] == "nosniff"
        assert "<script>" not in answer.text and " style=" not in answer.text
        assert " onclick" not in answer.text
        assert NASTY not in answer.text


def test_markup_in_names_and_reasons_stays_text(page: Page) -> None:
    name = NASTY.replace("/", "")
    page.registry.add(name, Candidate({"m": 1}), reason=NASTY, by=NASTY, now=NOW)
    changer = page.token("anna", "change")
    given = page.client.post(
        "/drop", headers=changer, files={"log": (f"{NASTY}.csv", CSV, "text/csv")}
    )
    places = ["/", "/?text=" + NASTY, "/drop", "/audit", "/machine/" + NASTY,
              given.headers["location"], given.headers["location"] + "/columns"]  # fmt: skip
    for path in places:
        text = page.client.get(path).text
        assert NASTY not in text, path
    assert "&lt;img src" in page.client.get("/drop").text
    drawn = str(spark([1.0, 2.0], '"><script>'))
    assert "<script>" not in drawn
    part = page.client.post("/machine/no/promote", headers={**changer, "HX-Request": "true"},
                            data={"number": "1", "reason": NASTY})  # fmt: skip
    assert part.status_code == 400 and "<" not in part.text


@pytest.mark.slow
def test_hosts_and_sizes(page: Page, tmp_path: Path) -> None:
    assert page.client.get("/", headers={"Host": "evil.example"}).status_code == 421
    assert page.client.get("/", headers={"Host": "127.0.0.1:8000"}).status_code == 200
    changer = page.token("anna", "change")
    large = {"reason": "x" * (2 * FORM_BYTES + 1)}
    assert page.client.post("/machine/a/rollback", headers=changer, data=large).status_code == 413

    def unsaid() -> Iterator[bytes]:
        for _ in range(60):
            yield b"x" * 10_000

    typed = {**changer, "Content-Type": "application/x-www-form-urlencoded"}
    answer = page.client.post("/machine/a/rollback", headers=typed, content=unsaid())
    assert answer.status_code == 413
    folder = tmp_path / "small"
    folder.mkdir()
    small = Page(folder, most_megabytes=0.001)
    with small.client as client:
        token = small.token("anna", "change")
        answer = client.post("/drop", headers=token, files={"log": ("a.csv", CSV * 200)})
        assert answer.status_code == 413
        answer = client.post("/drop", headers=token, files={"log": ("a.csv", CSV)})
        assert answer.status_code == 413
    assert not list(small.root.glob(".drops/*"))
    small.registry.close()


def test_what_is_no_log_is_refused_and_nothing_stays(page: Page) -> None:
    changer = page.token("anna", "change")
    for name, content, said in (
        ("a.exe", CSV, "no log by its ending"),
        ("a.csv", b"", "is empty"),
        ("a.csv", b"\x1f\x8b" + CSV, "gzip"),
        ("a.csv", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "is a binary file, no text as its ending says"),
    ):
        answer = page.client.post("/drop", headers=changer, files={"log": (name, content)})
        assert answer.status_code == 400 and said in answer.text
        assert str(page.root) not in answer.text
    assert list(page.root.glob(".drops/*")) == []
    assert page.client.post("/drop", headers=changer, data={"x": "y"}).status_code == 400


def test_a_log_that_cannot_be_read_is_said_once_and_nothing_waits(page: Page) -> None:
    changer = page.token("anna", "change")
    files = {"log": ("tiny.csv", b"t,y,u\n0,1,2\n")}
    place = page.client.post("/drop", headers=changer, files=files).headers["location"]
    columns, card, picture = (
        page.client.get(f"{place}/{p}") for p in ("columns", "card", "picture")
    )
    assert "1 row, at least 100 rows needed" in columns.text
    assert card.status_code == 200 and "No card: the log cannot be read." in card.text
    assert card.headers["HX-Trigger-After-Settle"] == "card-ready"
    assert "Nothing to show until a card reads the log" in picture.text


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ("../../etc/passwd.csv", "passwd.csv"),
        ("C:\\logs\\run 1.CSV", "run_1.csv"),
        ("..csv", None),
        (".bashrc.csv", "bashrc.csv"),
        ("a\0b.csv", "a_b.csv"),
        ("x" * 500 + ".parquet", "x" * 72 + ".parquet"),
        ("schön<b>.csv", "sch_n_b.csv"),
        ("run1", None),
    ],
)
def test_a_file_is_kept_under_a_plain_name(given: str, kept: str | None) -> None:
    if kept is None:
        with pytest.raises(Exception, match="no log by its ending"):
            file_name(given)
    else:
        assert file_name(given) == kept


def test_no_path_leaves_the_folder(page: Page) -> None:
    for name in ("..", "../..", "0123456789abcde", "0123456789ABCDEF", "0123456789abcdef/.."):
        with pytest.raises(BadRegistry):
            _ = Drop(page.root, name).folder
    (page.root.parent / "secret.html").write_text("secret")
    for path in (
        "/drop/..%2f..%2fsecret/card.toml",
        "/machine/..%2f..",
        "/machine/%2e%2e/report/secret.html",
        "/static/..%2f..%2fapp.py",
        "/work/1/file/..%2f..%2fr.db",
        "/machine/a/report/..%2fx.html",
    ):
        answer = page.client.get(path)
        assert answer.status_code in (400, 404), path
        assert "secret" not in answer.text or "secret" in path
    assert len(ENDINGS) == len(set(ENDINGS))


def test_behind_a_prefix(tmp_path: Path) -> None:
    below = Page(tmp_path, prefix="/servo", names=("plant.example",))
    with below.client as client:
        host = {"Host": "plant.example"}
        text = client.get("/servo/", headers=host).text
        assert 'href="/servo/drop"' in text and 'src="/servo/static/page.js"' in text
        assert client.get("/", headers=host).text == text  # the proxy may take it off
        assert client.get("/servo/static/page.css", headers=host).status_code == 200
        secret = below.access.add("anna", "change", by="t", now=NOW)
        entered = client.post("/servo/sign-in", data={"token": secret}, headers=host)
        assert entered.headers["location"] == "/servo/"
        assert "Path=/servo/" in entered.headers["set-cookie"]
    below.registry.close()


def test_errors_are_reported_as_they_are_asked_for(page: Page) -> None:
    asked = {"Accept": "application/json"}
    answer = page.client.get("/machine/none", headers=asked)
    assert answer.status_code == 404 and "no machine 'none'" in answer.json()["error"]
    assert "<h1>Not found</h1>" in page.client.get("/machine/none").text
    assert json.loads(page.client.get("/health").text)["page"] == "ok"
    assert "servo_workbench_page_requests_total" in page.client.get("/metrics").text
