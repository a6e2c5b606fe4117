"""The wheel holds our three packages and the cards, and nothing else."""

import re
import zipfile
from pathlib import Path, PurePosixPath

import pytest

from tools.check_wheel import ROOT, build_wheel

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_wheel(tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def names(wheel: Path) -> list[PurePosixPath]:
    with zipfile.ZipFile(wheel) as archive:
        return [PurePosixPath(name) for name in archive.namelist()]


def test_top_level(names: list[PurePosixPath]) -> None:
    top = {path.parts[0] for path in names}
    info = {name for name in top if name.endswith(".dist-info")}
    assert top - info == {"workbench", "identification", "design"}
    assert len(info) == 1
    assert not [path for path in names if "__pycache__" in path.parts]


def test_every_module_is_there(names: list[PurePosixPath]) -> None:
    for package in ("workbench", "identification", "design"):
        in_tree = {p.relative_to(ROOT).as_posix() for p in (ROOT / package).rglob("*.py")}
        assert in_tree <= {str(path) for path in names}


def test_cards_are_there_and_no_python_among_them(names: list[PurePosixPath]) -> None:
    contained = {
        path.relative_to("workbench/_datasets") for path in names if "_datasets" in path.parts
    }
    cards = {PurePosixPath(p.relative_to(ROOT / "datasets")) for p in _cards()}
    assert cards <= contained
    assert not [path for path in contained if path.suffix == ".py"]


def test_the_description_needs_no_file_of_the_checkout(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (n for n in archive.namelist() if n.endswith(".dist-info/METADATA"))
        text = archive.read(name).decode("utf-8")
    assert "Description-Content-Type: text/markdown" in text
    assert "workbench identify" in text
    assert not re.findall(r"\]\((?!https?:)", text)


def test_numba_whose_privates_are_used_is_bounded(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (n for n in archive.namelist() if n.endswith(".dist-info/METADATA"))
        (line,) = re.findall(r"^Requires-Dist: numba(.*)$", archive.read(name).decode(), re.M)
    assert ">=" in line and "<" in line


def test_licence_is_there(names: list[PurePosixPath]) -> None:
    assert any(path.name == "LICENSE" for path in names)


def _cards() -> list[Path]:
    return sorted(ROOT.glob("datasets/*/card.toml"))
