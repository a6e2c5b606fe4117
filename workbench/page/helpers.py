"""Heavy work on a log in processes of their own, warm, and killed where they take too long."""

from collections.abc import Callable
from contextlib import AsyncExitStack, suppress
from typing import Any, Self, TypeVar

import anyio
from anyio import to_process

from identification.errors import UserError
from workbench.page.inspection import warm

Result = TypeVar("Result")
QUICK_CALLS, SLOW_CALLS = 2, 1  # at once; a slow one never keeps a first picture waiting
LONGEST_CALL = 60.0  # s
STAYS_WARM = 120.0  # s between two calls; after five minutes without one a process would end


class TooLong(UserError):
    """Work on a log that does not come to its end."""


class Helpers:
    """The processes, from the first use until the server ends."""

    def __init__(self) -> None:
        self._quick: anyio.CapacityLimiter | None = None
        self._slow: anyio.CapacityLimiter | None = None
        self._stack = AsyncExitStack()

    async def __aenter__(self) -> Self:
        self._quick = anyio.CapacityLimiter(QUICK_CALLS)
        self._slow = anyio.CapacityLimiter(SLOW_CALLS)
        group = await self._stack.enter_async_context(anyio.create_task_group())
        group.start_soon(self._keep_warm)
        self._stack.callback(group.cancel_scope.cancel)
        return self

    async def __aexit__(self, *_: object) -> None:
        await self._stack.aclose()

    def __call__(self, work: Callable[..., Result], *arguments: Any) -> Result:
        """What the work gives, asked for in a thread of the server; raises what it raises."""
        return anyio.from_thread.run(self._asked, self._quick, work, *arguments)

    def slowly(self, work: Callable[..., Result], *arguments: Any) -> Result:
        """The same of work that may take seconds of a long log."""
        return anyio.from_thread.run(self._asked, self._slow, work, *arguments)

    async def _asked(
        self, limit: anyio.CapacityLimiter | None, work: Callable[..., Result], *arguments: Any
    ) -> Result:
        try:
            with anyio.fail_after(LONGEST_CALL):
                return await to_process.run_sync(work, *arguments, cancellable=True, limiter=limit)
        except TimeoutError:
            raise TooLong(
                f"the log was not read within {LONGEST_CALL:.0f} s; cut it, or use the commands"
            ) from None
        except anyio.BrokenWorkerProcess:
            raise TooLong("the log could not be read: its reader has died; cut it") from None

    async def _keep_warm(self) -> None:
        while True:
            with suppress(anyio.BrokenWorkerProcess):  # the next call starts another
                await to_process.run_sync(warm, cancellable=True, limiter=self._quick)
            await anyio.sleep(STAYS_WARM)
