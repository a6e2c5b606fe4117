"""What the pages say of commands, scripts and keys between their blocks exists."""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import click
import pytest
from sphinx.errors import ExtensionError

from docs._ext import card_page, command_pages, effect_pages
from docs._ext.session import blocks
from identification.effects._library import built_in
from workbench.cards.card_tables import CardFile
from workbench.cli import COMMANDS, cli

ROOT = Path(__file__).parents[2]
PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *sorted(p for p in (ROOT / "docs").rglob("*.md") if "made" not in p.parts),
]
INLINE = re.compile(r"`(workbench|python|pytest) ([^`]+)`")


def spoken(path: Path) -> Iterator[tuple[str, list[str]]]:
    """Programs and arguments that a page names within its sentences."""
    text = path.read_text("utf-8")
    for program, rest in INLINE.findall(text.replace("\n", " ")):
        yield program, shlex.split(rest)


@pytest.mark.parametrize("path", PAGES, ids=lambda p: p.name)
def test_commands_in_sentences_exist_with_their_options(path: Path) -> None:
    for program, words in spoken(path):
        if program == "workbench":
            command, names = named(words)
            known = {option for one in command.params for option in one.opts} | {"--help"}
            assert {word for word in words if word.startswith("--")} <= known, (names, words)
        else:
            files = [word.partition(" ")[0] for word in words if "/" in word and "*" not in word]
            scripts = [one for one in files if one.startswith(("benchmarks/", "tests/", "tools/"))]
            assert all((ROOT / one).exists() for one in scripts), words
            for script in (one for one in scripts if one.startswith("benchmarks/")):
                text = (ROOT / script).read_text("utf-8")
                for option in (word for word in words if word.startswith("--")):
                    assert option in text, (script, option)


def named(words: list[str]) -> tuple[click.Command, list[str]]:
    """The command that the words name, and its names."""
    found: click.Command = cli
    names: list[str] = []
    context = click.Context(cli)
    for word in words:
        if not isinstance(found, click.Group) or word.startswith("-") or word == "...":
            break
        inner = found.get_command(context, word)
        assert inner is not None, words
        found, names = inner, [*names, word]
    return found, names


def test_readme_is_a_screen_with_its_first_command_on_top() -> None:
    text = (ROOT / "README.md").read_text("utf-8")
    assert len(text.splitlines()) <= 55
    first = next(one for one in blocks(text) if one.language == "sh")
    assert first.end <= 25
    lines = [line for one in blocks(text) for line in one.text.splitlines()]
    assert len([line for line in lines if line.startswith("make ")]) == 2
    assert len([line for line in lines if line.startswith("workbench ")]) == 5


def test_the_card_page_has_every_key_of_the_models() -> None:
    page = card_page.page()
    for field in CardFile.model_fields:
        assert f"[{field}]" in page
    for key in ("area_p_m2", "gain", "k_d", "T_d", "anti_windup_s", "high_hz", "F_sn", "sha256"):
        assert f"| `{key}` |" in page
    assert '`"electro-pneumatic"`' in page


def test_a_key_that_says_nothing_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def silent(section: type) -> dict[str, str]:
        return {}

    monkeypatch.setattr(card_page, "_texts", silent)
    with pytest.raises(ExtensionError, match=r"About\.name"):
        card_page.page()


def test_every_command_has_its_page() -> None:
    found = dict(command_pages.pages())
    assert set(found) == {"commands/index.md"} | {f"commands/{name}.rst" for name in COMMANDS}


@pytest.mark.slow
def test_every_effect_has_its_page_with_equation_units_source_and_picture(tmp_path: Path) -> None:
    found = dict(
        effect_pages.pages(tmp_path, keys=("spring", "valve_dead_zone", "rising_stiction"))
    )
    spring = built_in()["spring"]
    page = found["effects/spring.md"]
    assert spring.source in page and "| `k` | N/m | stiffness |" in page
    assert r"- k y - k_{3} y^{3}" in page
    assert (tmp_path / "spring.svg").stat().st_size > 5000
    assert "rests of different length" in found["effects/rising_stiction.md"]
    assert all(f"[{key}]({key}.md)" in found["effects/index.md"] for key in built_in())
