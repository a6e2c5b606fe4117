"""The runner of the pages: what is written is run, and a page that says what is not so fails."""

import subprocess
import sys
from pathlib import Path

import pytest

from docs._ext.session import PageFault, Pages, blocks


def printed(tmp_path: Path, **pages: str) -> dict[str, list[str]]:
    """What the blocks of these pages print."""
    home = tmp_path / "docs"
    home.mkdir()
    for name, text in pages.items():
        (home / f"{name}.md").write_text(text, "utf-8")
    found = Pages(home, tmp_path / "work", {"WORD": "given"}, beside={})
    found.run()
    return found.printed


def test_shell_and_python_run_in_one_folder_in_their_order(tmp_path: Path) -> None:
    page = (
        "```sh\necho 1 > a.txt\n```\n"
        "```python\nfrom pathlib import Path\nn = int(Path('a.txt').read_text())\n```\n"
        "```toml made/b.toml\nkey = 1\n```\n"
        "```python\nprint(n + 1, Path('made/b.toml').read_text().strip())\n```\n"
        "```sh\necho $WORD; python -c 'print(3)'\n```\n"
    )
    assert printed(tmp_path, one=page) == {"one": ["", "", "", "2 key = 1", "given\n3"]}


def test_a_page_begins_where_the_one_that_it_names_ended(tmp_path: Path) -> None:
    found = printed(
        tmp_path,
        a="<!-- after: b -->\n```sh\ncat x; echo more >> x\n```\n",
        b="```sh\necho of b | tee x\n```\n",
        c="<!-- after: b -->\n```sh\ncat x\n```\n",
    )
    assert found == {"a": ["of b"], "b": ["of b"], "c": ["of b"]}


@pytest.mark.parametrize(
    ("page", "said"),
    [
        ("```sh\necho before; false\n```", "before"),
        ("```sh\nfalse | true\n```", "exit status 1"),
        ("```sh\necho $NOWHERE_SET\n```", "NOWHERE_SET"),
        ("```python\nprint('so far'); 1 / 0\n```", "ZeroDivisionError"),
        ("```sh\nworkbench identfy\n```", "identify"),
        ("```sh\nmake no-such-target\n```", "no-such-target"),
        ("```sh\npip install 'servo-workbench[postgress]'\n```", "pyproject"),
        ("```sh\npip install requests\n```", "pyproject"),
        ("<!-- after: two -->\n```sh\ntrue\n```", "wait for each other"),
    ],
)
def test_a_block_that_fails_is_reported_with_its_page(tmp_path: Path, page: str, said: str) -> None:
    two = "<!-- after: one -->" if "after: two" in page else ""
    with pytest.raises(PageFault, match=said) as raised:
        printed(tmp_path, one=page, two=two)
    assert "one" in str(raised.value)


def test_output_stands_below_its_block_and_quiet_ones_show_none(tmp_path: Path) -> None:
    home = tmp_path / "docs"
    home.mkdir()
    page = "# A\n\n```sh\necho shown\n```\n\nText.\n\n```sh quiet\necho hidden\n```\n"
    (home / "a.md").write_text(page, "utf-8")
    pages = Pages(home, tmp_path / "work", {}, beside={})
    pages.run()
    shown = pages.shown("a", page)
    assert [one.language for one in blocks(shown)] == ["sh", "{code-block}", "sh"]
    assert blocks(shown)[1].text == ":class: printed\n\nshown\n"
    assert shown.index("shown\n````") < shown.index("Text.")
    assert "hidden\n````" not in shown


def test_the_programs_are_those_of_this_checkout(tmp_path: Path) -> None:
    page = "```sh\ncommand -v workbench\nworkbench --version\n```"
    where, version = printed(tmp_path, a=page)["a"][0].splitlines()
    assert Path(where).read_text("utf-8").count(sys.executable) == 1
    said = subprocess.run(
        [sys.executable, "-m", "workbench", "--version"], capture_output=True, text=True, check=True
    )
    assert version == said.stdout.strip()
