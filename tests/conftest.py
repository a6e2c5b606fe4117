"""Fixtures and settings of every test; numba's cache stays on, as for a user."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

ROOT = Path(__file__).resolve().parent.parent

settings.register_profile("desk", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("ci" if "CI" in os.environ else "desk")


@pytest.fixture(scope="session")
def workbench_data() -> Path:
    """Folder of the measured data: WORKBENCH_DATA, else ../shared/data beside the checkout."""
    named = os.environ.get("WORKBENCH_DATA")
    folder = Path(named) if named else ROOT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"no measured data: {folder} is no folder; set WORKBENCH_DATA")
    return folder
