"""The embedded FIWARE as a process."""

import asyncio
from urllib.parse import urlsplit

from iveg.cli.arguments import CommandCall
from iveg.cli.running import (
    report_ready,
    run_until_stopped,
    tune_garbage_collection,
)
from iveg.lab.embedded.server import embedded_fiware
from iveg.settings import Settings


def run(call: CommandCall) -> int:
    """Run ``iveg fiware``; returns the exit code."""
    work = fiware(call.settings)
    return run_until_stopped(work, until_eof=call.options.until_eof)


async def fiware(settings: Settings) -> None:
    """The embedded MQTT broker, Orion and IoT Agent."""
    tune_garbage_collection()
    async with embedded_fiware(
        _address(settings.mqtt_url, 1883),
        _address(settings.orion_url, 1026),
        _address(settings.iota_url, 4041),
    ):
        report_ready()
        await asyncio.Event().wait()


def _address(url: str, default_port: int) -> tuple[str, int]:
    parts = urlsplit(url)
    return parts.hostname or "127.0.0.1", parts.port or default_port
