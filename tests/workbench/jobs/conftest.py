"""Jobs on both databases, and a receiver of alarms."""

from collections.abc import Iterator

import pytest

from tests.workbench.jobs.listener import Listener, listening
from tests.workbench.registry.conftest import postgres, registry, where

__all__ = ["listener", "postgres", "registry", "where"]


@pytest.fixture
def listener() -> Iterator[Listener]:
    """A receiver of alarms."""
    with listening() as found:
        yield found
