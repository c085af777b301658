"""Which parts share the fate of the process, and what happens when one ends."""

import asyncio
import signal
from pathlib import Path

import pytest

from iveg.app.dss import Dss, open_dss
from iveg.settings import Settings


@pytest.fixture
def dss(tmp_path: Path) -> Dss:
    return open_dss(Settings(), tmp_path)


async def test_mqtt_and_the_rule_loop_alone_share_the_fate_of_the_process(
    dss: Dss,
) -> None:
    assert set(dss.vital()) == {"mqtt", "rule-loop"}


async def test_no_chart_waits_for_an_incident_pack(dss: Dss) -> None:
    packing = asyncio.create_task(dss.packer.run(signal.pause))
    try:
        assert await dss.worker.run(abs, -1) == 1
        assert not packing.done()
    finally:
        dss.worker.close()
        dss.packer.close()
        await asyncio.gather(packing, return_exceptions=True)
