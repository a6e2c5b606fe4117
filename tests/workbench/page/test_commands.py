"""`token`, `serve` and `work` on the command line."""

import json
from pathlib import Path

import pytest

from workbench.cli import main
from workbench.page import settings
from workbench.page.settings import PageSettings, hand_over, handed_over
from workbench.registry.access import Access
from workbench.registry.store import Registry


def test_tokens_are_made_listed_and_revoked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    where = ["--registry", str(tmp_path / "r.db")]
    assert main(["token", "add", "anna", "--role", "change", "--by", "root", "--json", *where]) == 0
    made = json.loads(capsys.readouterr().out)
    with Registry(where[1]) as registry:
        found = Access(registry.database).of(made["token"])
    assert found is not None and (found.name, found.role, found.made_by) == (
        "anna",
        "change",
        "root",
    )
    assert main(["token", "add", "bob", *where]) == 0
    assert "it is shown only now" in capsys.readouterr().out
    assert main(["token", "add", "anna", *where]) == 2
    assert "exists already" in capsys.readouterr().err
    assert main(["token", "revoke", "anna", *where]) == 0
    assert main(["token", "list", *where]) == 0
    shown = capsys.readouterr().out
    assert "revoked" in shown and "bob" in shown and made["token"] not in shown
    assert main(["token", "revoke", "anna", *where]) == 2


@pytest.mark.parametrize("prefix", ["servo", "/a//b", "/a b", "/a?b", "/%2e"])
def test_a_prefix_is_a_path(prefix: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["serve", "--prefix", prefix]) == 2
    assert "a path needed, as /servo" in capsys.readouterr().err


def test_what_is_wrong_with_a_registry_is_reported_first(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["serve", "--registry", str(tmp_path / "no" / "r.db")]) == 2
    assert "make it first" in capsys.readouterr().err
    assert not (tmp_path / "machines").exists()


def test_without_the_extra_it_says_how_to_get_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(settings, "find_spec", lambda name: None)
    assert main(["serve"]) == 2
    assert "pip install 'servo-workbench[page]'" in capsys.readouterr().err


def test_work_ends_where_nothing_waits(tmp_path: Path) -> None:
    where, root = str(tmp_path / "r.db"), str(tmp_path / "machines")
    assert main(["work", "--registry", where, "--machines", root, "--once"]) == 0


def test_settings_reach_the_servers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WORKBENCH_PAGE", "")
    given = PageSettings("r.db", Path("m"), names=("a", "b"), prefix="/x", silent_days=2.5)
    hand_over(given)
    assert handed_over() == given
    assert {"localhost", "a", "b"} <= given.hosts
