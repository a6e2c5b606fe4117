"""A PostgreSQL server for the pages, while they run."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

from tests.workbench.registry.postgres import new_server


@contextmanager
def registry_url() -> Iterator[str]:
    """URL of an empty database: of the server named by POSTGRES, else of one of its own."""
    if "POSTGRES" in os.environ:
        yield os.environ["POSTGRES"]
        return
    server = new_server()
    try:
        yield server.database()
    finally:
        server.remove()
