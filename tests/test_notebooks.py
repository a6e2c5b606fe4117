"""Notebooks run from their first to their last cell, and are kept without outputs."""

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

ROOT = Path(__file__).resolve().parent.parent
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
SECONDS_A_CELL = 300
LONG = ("02_closing_the_loop", "04_retuning_after_drift", "05_the_paper", "06_next_run")

each_notebook = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)


def read(path: Path) -> nbformat.NotebookNode:
    notebook: nbformat.NotebookNode = nbformat.read(path, as_version=4)
    return notebook


@each_notebook
def test_outputs_are_stripped(path: Path) -> None:
    for cell in read(path).cells:
        if cell.cell_type == "code":
            assert not cell.outputs, f"{path.name}: run nbstripout (make format)"
            assert cell.execution_count is None, f"{path.name}: run nbstripout (make format)"


@pytest.mark.slow
@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, id=path.stem, marks=[pytest.mark.method] * (path.stem in LONG))
        for path in NOTEBOOKS
    ],
)
def test_runs(path: Path, tmp_path: Path) -> None:
    place = {"metadata": {"path": str(tmp_path)}}
    NotebookClient(read(path), timeout=SECONDS_A_CELL, resources=place).execute()
