"""Applications on loopback, for what a test talks to over real HTTP."""

import asyncio
import contextlib
from collections.abc import AsyncIterator

import uvicorn
from starlette.types import ASGIApp


@contextlib.asynccontextmanager
async def served(
    app: ASGIApp, port: int = 0, host: str = "127.0.0.1"
) -> AsyncIterator[str]:
    """An application, while the block lasts; yields its address."""
    config = uvicorn.Config(
        app, host=host, port=port, log_config=None, lifespan="off", ws="none"
    )
    server = uvicorn.Server(config)
    server.capture_signals = contextlib.nullcontext  # type: ignore[method-assign,assignment]
    task = asyncio.create_task(server.serve())
    while not server.started:  # noqa: ASYNC110 (uvicorn has no event for it)
        await asyncio.sleep(0.005)
    (first, *_) = (one for each in server.servers for one in each.sockets)
    try:
        yield f"http://{host}:{first.getsockname()[1]}"
    finally:
        # Its own way to end sleeps for a tenth of a second.
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task
        server.force_exit = True
        await server.shutdown()
