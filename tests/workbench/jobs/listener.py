"""A webhook's receiver, for tests."""

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any


class Listener(ThreadingHTTPServer):
    """Takes alarms; answers with each of `answers` in turn, then by `by_machine`, or with 200."""

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), Handler)
        self.taken: list[dict[str, Any]] = []
        self.keys: list[str | None] = []
        self.answers: list[int] = []
        self.by_machine: dict[str, int] = {}


class Handler(BaseHTTPRequestHandler):
    server: Listener

    def do_POST(self) -> None:
        said = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        status = self.server.by_machine.get(said["machine"], 200)
        if self.server.answers:
            status = self.server.answers.pop(0)
        if status == 200:
            self.server.taken.append(said)
            self.server.keys.append(self.headers["Idempotency-Key"])
        self.send_response(status)
        self.send_header("Location", "http://127.0.0.1:9/elsewhere")
        self.end_headers()

    def log_message(self, format: str, *args: object) -> None:
        """Nothing on the terminal."""


@contextmanager
def listening() -> Iterator[Listener]:
    """One that listens within the block."""
    server = Listener()
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield server
    finally:
        server.shutdown()
        thread.join()
        server.server_close()
