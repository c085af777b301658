"""An embedded FIWARE whose IoT Agent fails as they do in the field.

In a test's own process: ``faulty_fiware()``.  As a program of its own, on the addresses
of the settings: ``python -m tests.faulty_fiware``; ``POST /test/faults`` on the agent's
north port (``{"deaf": bool, "slow_s": seconds, "stuck": bool}``) then says how.
"""

import asyncio
import os
import sys
from collections.abc import Mapping
from contextlib import AbstractAsyncContextManager
from dataclasses import dataclass
from urllib.parse import urlsplit

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from iveg.cli.running import report_ready, run_until_stopped
from iveg.lab.embedded.context_broker import ContextBroker
from iveg.lab.embedded.entities import Scope
from iveg.lab.embedded.iot_agent import IotAgent
from iveg.lab.embedded.mqtt_broker import MqttBroker
from iveg.lab.embedded.server import Running, embedded_fiware
from iveg.settings import Settings

MODULE = "tests.faulty_fiware"


@dataclass(frozen=True, slots=True)
class Faults:
    """How an agent fails.

    Attributes:
        deaf: Measures and answers are not heard; the north port says all is well.
        slow_s: Everything is done so much later (s), in order.
        stuck: Requests of the context broker are taken and not answered until this
            ends; then they are carried out, late.
    """

    deaf: bool = False
    slow_s: float = 0.0
    stuck: bool = False


class FaultyAgent(IotAgent):
    """The embedded agent, until it is told to fail."""

    def __init__(self, broker: ContextBroker, mqtt: MqttBroker) -> None:
        self._faults = Faults()
        self._unstuck = asyncio.Event()
        self._unstuck.set()
        super().__init__(broker, mqtt)

    def fail(self, faults: Faults) -> None:
        """From now on, fail like this."""
        self._faults = faults
        if faults.stuck:
            self._unstuck.clear()
        else:
            self._unstuck.set()

    def receive(self, topic: str, payload: bytes) -> None:
        if self._faults.deaf:
            return
        if self._faults.slow_s > 0:
            loop = asyncio.get_running_loop()
            loop.call_later(self._faults.slow_s, super().receive, topic, payload)
        else:
            super().receive(topic, payload)

    async def command(
        self, scope: Scope, name: str, kind: str, values: Mapping[str, object]
    ) -> None:
        await self._unstuck.wait()
        if self._faults.slow_s > 0:
            await asyncio.sleep(self._faults.slow_s)
        await super().command(scope, name, kind, values)

    def north_port(self) -> Starlette:
        """The agent's own, with one more request."""

        async def take_faults(request: Request) -> Response:
            self.fail(Faults(**await request.json()))
            return Response(status_code=204)

        app = super().north_port()
        app.router.routes.append(Route("/test/faults", take_faults, methods=["POST"]))
        return app


def fail(up: Running, faults: Faults) -> None:
    """From now on, the agent of a faulty FIWARE fails like this."""
    assert isinstance(up.agent, FaultyAgent)
    up.agent.fail(faults)


def faulty_fiware() -> AbstractAsyncContextManager[Running]:
    """On free ports, while the block lasts."""
    return embedded_fiware(make_agent=FaultyAgent)


def main() -> int:
    settings = Settings.from_environment(os.environ)
    urls = settings.mqtt_url, settings.orion_url, settings.iota_url
    parts = [urlsplit(url) for url in urls]
    mqtt, orion, iota = ((part.hostname or "", part.port or 0) for part in parts)

    async def serve() -> None:
        async with embedded_fiware(mqtt, orion, iota, make_agent=FaultyAgent):
            report_ready()
            await asyncio.Event().wait()

    return run_until_stopped(serve())


if __name__ == "__main__":
    sys.exit(main())
