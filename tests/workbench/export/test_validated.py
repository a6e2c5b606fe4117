"""An export says whether its design has passed a validation."""

import json
from pathlib import Path

import pytest

from workbench.export.validated import of_design, validation_line


@pytest.fixture
def design(tmp_path: Path) -> Path:
    folder = tmp_path / "tuned"
    folder.mkdir()
    path = folder / "design.json"
    path.write_text("{}", "utf-8")
    return path


def validated(design: Path, folder: str, passed: bool, **named: str) -> None:
    """A validation of the design in a folder beside its own."""
    path = design.parent.parent / folder / "validation.json"
    path.parent.mkdir(exist_ok=True)
    own = of_design(design) | named
    path.write_text(
        json.dumps({"schema": "validation/1", "passed": passed, "design": own}), "utf-8"
    )


def test_one_that_passed_is_not_spoken_of(design: Path) -> None:
    validated(design, "loop", True)
    assert validation_line(design) == ""


def test_one_that_failed_is_told_first(design: Path) -> None:
    validated(design, "loop", False)
    assert validation_line(design).startswith("its validation did NOT pass (loop/validation.json)")


def test_one_of_another_design_counts_for_nothing(design: Path) -> None:
    validated(design, "loop", True, sha256="0" * 64)
    assert validation_line(design).startswith("no validation of this design")


@pytest.mark.parametrize("text", ["", "[]", "{", '{"design": 1}'])
def test_a_file_that_is_none_counts_for_nothing(design: Path, text: str) -> None:
    (design.parent / "validation.json").write_text(text, "utf-8")
    assert validation_line(design).startswith("no validation of this design")
