"""Whether the page and its registry are well, and figures of both for Prometheus."""

import time
from contextlib import suppress

from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, Counter, Gauge, Histogram
from prometheus_client import generate_latest as written
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route
from starlette.types import Message, Send

from workbench.jobs.metrics import PREFIX, MachineFigures, collected
from workbench.page.asked import Asked, Server
from workbench.page.visitors import reading
from workbench.registry.overview import any_machine
from workbench.registry.values import RegistryAway

REQUESTS = CollectorRegistry()
ANSWERED = Counter(
    f"{PREFIX}_page_requests", "Requests that this server has answered.", ["method", "status"],
    registry=REQUESTS,
)  # fmt: skip
SECONDS_TAKEN = Histogram(
    f"{PREFIX}_page_seconds", "Time that an answer took.", registry=REQUESTS,
    buckets=(0.005, 0.01, 0.025, 0.05, 0.1, 0.2, 0.5, 1.0, 2.5, 10.0),
)  # fmt: skip


def counted(send: Send, method: str) -> Send:
    """What sends an answer, which is counted."""
    begun = time.perf_counter()
    # What is none of the usual methods would make figures without end.
    known = method if method in ("GET", "HEAD", "POST") else "other"

    async def noted(message: Message) -> None:
        if message["type"] == "http.response.start":
            ANSWERED.labels(known, str(message["status"])).inc()
            SECONDS_TAKEN.observe(time.perf_counter() - begun)
        await send(message)

    return noted


async def health(request: Request) -> Response:
    """200 where page and registry answer, 503 where the registry does not."""
    server: Server = request.app.state.server
    try:
        await run_in_threadpool(any_machine, server.registry.database)
    except RegistryAway:
        return JSONResponse({"page": "ok", "registry": "away"}, 503)
    return JSONResponse({"page": "ok", "registry": "ok"})


def metrics(asked: Asked) -> Response:
    """All figures in Prometheus' text format."""
    own = collected(MachineFigures(asked.registry))
    with suppress(RegistryAway):  # which its own figures show
        counts = asked.bench.counts()
        tasks = Gauge(f"{PREFIX}_page_tasks", "Tasks by state.", ["state"], registry=own)
        for state, count in sorted(counts.items()):
            tasks.labels(state).set(count)
    return Response(written(own) + written(REQUESTS), media_type=CONTENT_TYPE_LATEST)


HEALTH_ROUTES = [Route("/health", health), Route("/metrics", reading(metrics))]
