"""Events of a worker as structured lines: JSON, or plain text on a terminal."""

from typing import Any, TextIO

import structlog

from workbench.jobs.passes import Report


def reporter(stream: TextIO, owner: str) -> Report:
    """A function that writes an event and what belongs to it as one line."""
    shown: Any = structlog.processors.JSONRenderer()
    if stream.isatty():
        shown = structlog.dev.ConsoleRenderer()
    logger = structlog.wrap_logger(
        structlog.WriteLogger(stream),
        processors=[
            structlog.processors.add_log_level,
            structlog.processors.TimeStamper(fmt="iso", utc=True),
            shown,
        ],
        wrapper_class=structlog.BoundLogger,
    ).bind(worker=owner)

    def report(event: str, **details: object) -> None:
        logger.info(event, **details)

    return report
