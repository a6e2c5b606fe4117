"""A page on an empty registry, asked without a browser; looks run in the test's own process."""

from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from tests.workbench.registry.conftest import postgres, where
from workbench.page.app import application
from workbench.page.helpers import Helpers
from workbench.page.settings import PageSettings
from workbench.registry.access import Access
from workbench.registry.store import Registry

__all__ = ["postgres", "where"]
NOW = datetime(2026, 3, 1, tzinfo=UTC)


class Here(Helpers):
    """Looks in this process."""

    async def _keep_warm(self) -> None:
        pass

    def __call__(self, work: Callable[..., Any], *arguments: Any) -> Any:
        return work(*arguments)

    slowly = __call__


class Page:
    """The page of a test: `client` without a token, `as_` with one."""

    def __init__(self, folder: Path, **settings: Any) -> None:
        self.root = folder / "machines"
        self.root.mkdir(exist_ok=True)
        self.where = str(folder / "r.db")
        self.registry = Registry(self.where)
        self.access = Access(self.registry.database)
        self.settings = PageSettings(self.where, self.root, **settings)
        self.client = TestClient(
            application(self.settings, Here()), base_url="http://localhost", follow_redirects=False
        )

    def token(self, name: str, role: Any) -> dict[str, str]:
        """The header of a new token."""
        secret = self.access.add(name, role, by="test", now=NOW)
        return {"Authorization": f"Bearer {secret}"}


@pytest.fixture
def page(tmp_path: Path) -> Iterator[Page]:
    """A page that anybody may read."""
    found = Page(tmp_path)
    with found.client:
        yield found
    found.registry.close()
