"""Fixtures and settings of every test; numba's cache stays on, as for a user."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

from workbench.threads import one_thread_by_default

pytest_plugins = ["tests.verdicts.plugin"]  # here, as it prints where no worker collects
ROOT = Path(__file__).resolve().parent.parent
LONG_FIRST = (  # files and folders whose tests take longest, so that no worker ends alone with one
    "end_to_end/test_scenario.py",
    "test_notebooks.py",
    "bad_inputs",
    "workbench/jobs/test_killed.py",
    "end_to_end",
    "identification/tracing",
    "workbench/jobs",
    "studies/paper",
    "workbench/steps",
    "workbench/interface",
    "identification/drift",
    "identification/estimation",
    "design/test_effect_loop.py",
    "contract",
)

one_thread_by_default(os.environ)  # of every library that a test loads from here on

settings.register_profile("desk", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("ci" if "CI" in os.environ else "desk")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Long files first; the tests of a file stay together, as `--dist loadfile` needs it."""
    places = [ROOT / "tests" / name for name in LONG_FIRST]

    def rank(item: pytest.Item) -> int:
        inside = (k for k, place in enumerate(places) if item.path.is_relative_to(place))
        return next(inside, len(places))

    items.sort(key=rank)


@pytest.fixture(scope="session")
def workbench_data() -> Path:
    """Folder of the measured data: WORKBENCH_DATA, else ../shared/data beside the checkout."""
    named = os.environ.get("WORKBENCH_DATA")
    folder = Path(named) if named else ROOT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"no measured data: {folder} is no folder; set WORKBENCH_DATA")
    return folder
