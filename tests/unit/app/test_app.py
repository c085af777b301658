"""Which parts share the fate of the process, and what happens when one ends."""

import asyncio
import signal
from pathlib import Path

import pytest

from iveg.app import App
from iveg.settings import Settings


@pytest.fixture
def app(tmp_path: Path) -> App:
    return App(Settings(), tmp_path)


async def test_mqtt_and_the_rule_loop_alone_share_the_fate_of_the_process(
    app: App,
) -> None:
    assert set(app.vital()) == {"mqtt", "rule-loop"}


async def test_no_chart_waits_for_an_incident_pack(app: App) -> None:
    packing = asyncio.create_task(app.packer.run(signal.pause))
    try:
        assert await app.worker.run(abs, -1) == 1
        assert not packing.done()
    finally:
        app.worker.close()
        app.packer.close()
        await asyncio.gather(packing, return_exceptions=True)
