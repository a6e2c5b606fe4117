"""What a user reads is in the field's words, not in a language of this project's own.

It checks texts that the program prints (string literals and templates), the help of its commands,
the manual, the README and the notebooks. Keys and values of files are of one word, or stand in
backticks or quotes, and stay as they are: other programs read them.
"""

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("workbench", "design", "identification")
WORDS = {
    r"told|tells?|telling|untold": "identifiable, reported, distinguishable, informative",
    r"(?:versions?|models?|designs?|controllers?|ones?|is|be|been|nothing|not|put) in force":
    "active",
    r"(?:set|sets|left) aside": "excluded, left out",
    r"st(?:ands?|ood) in for": "confounded with, replaces",
    r"impos(?:ed|es)": "prescribed motion",
    r"not judged|judged? (?:a|each|every|the|new|its)? ?logs?|logs? (?:is|are|was) judged":
    "inconclusive, tested",
    r"could (?:not )?have (?:been )?seen": "minimum detectable change",
    r"luck|lucky": "by chance",
    r"fits? (?:has|have|had|is|are) settled|settled fits?": "converged",
    r"(?<!random[ -])walk(?:s|ed|ing)?": "random-walk drift, samples",
    r"held (?:in )?between|held beyond|held over|held at its": "zero-order hold, constant, fixed",
    r"nudged?|loose|trifles?|headlines?|in vain|deeds?|glances?":
    "with added damping, chaotic, negligible, reported, without effect, actions, summary",
    r"drive(?:s|n)? by force|friction by (?:load|place|pressure)|forces? (?:by|of) place":
    "driven by the force, load-dependent, position-dependent",
    r"look(?:s|ed)? (?:at|for|over|after)": "check, search, test",
    r"(?:off|error) at rest|off in motion": "static error, tracking error",
    r"no number holds": "no estimate is valid",
    r"calls? for no": "does not support",
}  # fmt: skip
WHOLE = re.compile("|".join(rf"\b(?:{words})\b" for words in WORDS), re.IGNORECASE)
CODE = re.compile(r"`[^`]*`|\"[^\"\s]*\"|'[^'\s]*'|\]\([^)]*\)", re.DOTALL)


def replacement(found: str) -> str:
    return next(new for old, new in WORDS.items() if re.fullmatch(old, found, re.IGNORECASE))


def private(text: str) -> list[str]:
    """Each private word of a text, with what to say instead; white space counts as one blank."""
    plain = re.sub(r"\s+", " ", CODE.sub(" ", text))
    return [f"{one[0]} -> {replacement(one[0])}" for one in WHOLE.finditer(plain)]


def docstrings(tree: ast.AST) -> Iterator[ast.Constant]:
    """Docstrings of modules, classes and functions, and of the attributes of classes."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            for one in node.body:
                if isinstance(one, ast.Expr) and isinstance(one.value, ast.Constant):
                    yield one.value


def printed(file: Path) -> Iterator[tuple[int, str]]:
    """Texts of a module, each whole with its line: literals of several words that are no docstring,
    and with the commands, whose docstrings are their help, these too."""
    tree = ast.parse(file.read_text("utf-8"))
    skipped = set() if file.parent.name == "commands" else {id(one) for one in docstrings(tree)}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            skipped |= {id(part) for part in node.values}
            parts = (str(p.value) if isinstance(p, ast.Constant) else "0" for p in node.values)
            yield node.lineno, "".join(parts)
        elif (
            isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and " " in node.value.strip()
            and id(node) not in skipped
        ):
            yield node.lineno, node.value


def texts(kind: str) -> Iterator[tuple[str, str]]:
    """Every text of a kind, and where it stands."""
    if kind == "strings":
        for package in PACKAGES:
            for file in sorted((ROOT / package).rglob("*.py")):
                for line, text in printed(file):
                    yield f"{file.relative_to(ROOT)}:{line}", text
    elif kind == "templates":
        for file in sorted((ROOT / "workbench").rglob("*.j2")):
            shown = re.sub(
                r"{[{%#].*?[}%#]}|<[^>]*>", " ", file.read_text("utf-8"), flags=re.DOTALL
            )
            for number, text in enumerate(shown.split("\n"), 1):
                yield f"{file.relative_to(ROOT)}:{number}", text
    elif kind == "manual":
        for file in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))):
            if "made" in file.parts:  # of the code, as the manual was built last
                continue
            whole = re.sub(r"^```(?!{).*?^```", "", file.read_text("utf-8"), flags=re.M | re.DOTALL)
            for number, text in enumerate(whole.split("\n\n"), 1):
                yield f"{file.relative_to(ROOT)}, paragraph {number}", text
    else:
        for file in sorted((ROOT / "notebooks").glob("*.ipynb")):
            for number, cell in enumerate(json.loads(file.read_text("utf-8"))["cells"], 1):
                if cell["cell_type"] == "markdown":
                    yield f"{file.relative_to(ROOT)}, cell {number}", "".join(cell["source"])


@pytest.mark.parametrize("kind", ["strings", "templates", "manual", "notebooks"])
def test_no_private_word_is_read_by_a_user(kind: str) -> None:
    found = [f"{where}: {said}" for where, text in texts(kind) for said in private(text)]
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    "text",
    [
        "F_cp: not told", "NOT JUDGED, which is no all-clear", "version 2 is in force",
        "a change of 5 %\ncould not have been seen", "it stands in for another", "a log set aside",
        "the motion is imposed", "found by luck", "the force walks away", "friction by load",
    ],
)  # fmt: skip
def test_a_private_word_is_found(text: str) -> None:
    assert private(text)


@pytest.mark.parametrize(
    "text",
    [
        "error of 0.1 N in force", "a held-out log", "all limits kept", "the key `told` of a file",
        'its verdict is "not_judged"', "the log looks like a valve's",
    ],
)  # fmt: skip
def test_plain_words_and_keys_are_left_alone(text: str) -> None:
    assert not private(text)
