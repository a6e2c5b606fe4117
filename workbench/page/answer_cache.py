"""Answers kept for a moment: many who read the same page at once do not each ask the database.

Whoever may change things always sees what is; others what was at most a second ago.
"""

import time
from collections.abc import Mapping
from functools import wraps
from threading import Lock

from starlette.requests import Request
from starlette.responses import Response

from workbench.page.visitors import Endpoint, Visitor

ANSWER_LIFETIME = 1.0  # s
MOST_ANSWERS = 200
Key = tuple[str, str, str, str]


class Moment:
    """The answers of a server in the last second, by address and by who asks."""

    def __init__(self) -> None:
        self._answers: dict[Key, tuple[float, int, bytes, Mapping[str, str]]] = {}
        self._lock = Lock()

    def answer(self, endpoint: Endpoint, request: Request, visitor: Visitor) -> Response:
        """The endpoint's answer, or the one it has just given to the same question.

        One at a time, so that many who come together wait for the first of them.
        """
        asked = request.url.path, request.url.query
        key = (*asked, request.headers.get("hx-target", ""), visitor.name)
        with self._lock:
            found = self._answers.get(key)
            if found is None or time.monotonic() - found[0] > ANSWER_LIFETIME:
                if len(self._answers) >= MOST_ANSWERS:
                    self._answers.clear()
                made = endpoint(request, visitor)
                made_headers = {"content-type": made.headers["content-type"]}
                found = time.monotonic(), made.status_code, bytes(made.body), made_headers
                self._answers[key] = found
        _, status, body, headers = found
        return Response(body, status, headers)


def briefly(endpoint: Endpoint) -> Endpoint:
    """The endpoint, its answers to those who only read kept for a moment."""

    @wraps(endpoint)
    def answered(request: Request, visitor: Visitor) -> Response:
        if visitor.changes:
            return endpoint(request, visitor)
        moment: Moment = request.app.state.moment
        return moment.answer(endpoint, request, visitor)

    return answered
