"""The registry on both databases: every test that takes `where` runs on each."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.workbench.registry.postgres import Server, new_server
from workbench.registry.store import Registry


@pytest.fixture(scope="session")
def postgres() -> Iterator[Server]:
    """A PostgreSQL server that runs as long as the tests."""
    server = new_server()
    yield server
    server.remove()


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=pytest.mark.slow)])
def where(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """Where an empty registry may be made."""
    if request.param == "sqlite":
        return str(tmp_path / "registry.db")
    server: Server = request.getfixturevalue("postgres")
    return server.database()


@pytest.fixture
def registry(where: str) -> Iterator[Registry]:
    """An empty registry."""
    with Registry(where) as found:
        yield found
