"""``iveg serve``: the dashboard and decision-support system as a process."""

import asyncio
import contextlib
import logging
import os
import socket
from collections.abc import Callable, Iterator
from pathlib import Path

import uvicorn
from starlette.types import ASGIApp

from iveg.adapters.history.engine import history_url, upgrade
from iveg.app import App
from iveg.asgi import create_app
from iveg.cli.arguments import CommandCall
from iveg.cli.running import (
    page_address,
    print_sign_in_link,
    report_ready,
    run_until_stopped,
    tune_garbage_collection,
)
from iveg.cli.user import invitation_link
from iveg.domain.errors import HopError
from iveg.settings import Settings
from iveg.web.bounded_http import bounded_http
from iveg.web.live.socket import BoundedSocket
from iveg.web.notifications import notifications_first

_log = logging.getLogger(__name__)
_WS_MAX_BYTES = 65536


class _Server(uvicorn.Server):
    """Server that ends with a vital part.

    ``run_until_stopped`` handles signals, as for all parts.
    """

    def __init__(
        self, config: uvicorn.Config, app: App, on_start: Callable[[], None]
    ) -> None:
        super().__init__(config)
        self._app, self._on_start = app, on_start

    async def on_tick(self, counter: int) -> bool:
        return self._app.failure is not None or await super().on_tick(counter)

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if self.started:
            self._on_start()

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        yield


def run(call: CommandCall) -> int:
    """Run ``iveg serve``; returns the exit code."""
    # Recordings, journals and databases show people: other users must not read them.
    os.umask(0o077)
    call.data.mkdir(parents=True, exist_ok=True)
    work = serve(call.settings, call.data, demo=call.options.demo)
    return run_until_stopped(work, until_eof=call.options.until_eof)


async def serve(
    settings: Settings, data: Path, *, demo: bool, make: type[App] = App
) -> None:
    """Run the decision-support system with its page.

    Raises:
        VitalPartError: one of its vital parts has ended.
    """
    try:
        await asyncio.to_thread(upgrade, history_url(settings.database_url, data))
    except HopError as error:
        # An absent database must not delay STOP; a newer or broken one ends the start.
        _log.warning("the history starts without its database: %s", error)
    app = make(settings, data, demo=demo)
    with contextlib.suppress(HopError):
        await app.accounts.copy_earlier()
    server = _Server(
        _config(settings, notifications_first(create_app(app), app.orion)),
        app,
        on_start=report_ready if demo else lambda: _print_way_in(settings, app),
    )
    tune_garbage_collection()
    serving = asyncio.create_task(server.serve(), name="http")
    try:
        # Shielded: uvicorn ends in order, by `should_exit`.
        await asyncio.shield(serving)
    except asyncio.CancelledError:
        server.should_exit = True
        await serving
    if app.failure is not None:
        raise app.failure


def _print_way_in(settings: Settings, app: App) -> None:
    """Print the sign-in link; without a link, an invitation while there is no admin."""
    if app.sign_in_token:
        print_sign_in_link(settings, app.sign_in_token)
        return
    try:
        invitation = app.accounts.first_invitation()
    except HopError as error:
        _log.warning("no admin can be made: %s", error)
        return
    print(f"iVeg: {page_address(settings)}", flush=True)
    if invitation is not None:
        print("Nobody is admin yet. The first has 30 minutes, and this link once:")
        print(invitation_link(settings, invitation), flush=True)


def _config(settings: Settings, site: ASGIApp) -> uvicorn.Config:
    return uvicorn.Config(
        site,
        host=settings.host,
        port=settings.port,
        log_config=None,
        access_log=False,
        http=bounded_http(),
        ws=BoundedSocket,
        ws_max_size=_WS_MAX_BYTES,
        ws_ping_interval=10.0,
        ws_ping_timeout=10.0,
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=2,
        server_header=False,
    )
