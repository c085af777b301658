"""Other equipment through real programs: MQTT, agent, Orion, iVeg, REST, history."""

import json
from pathlib import Path

import aiomqtt
import httpx
import pytest

from iveg.adapters.broker_address import BrokerAddress
from tests.processes import Site, site, until

TILES = """\
[[tiles]]
entity = "boiler-1"
type = "Boiler"
device = "boiler-1"
attribute = "pressure"
name = { es = "Presión", en = "Pressure" }
unit = "bar"
silent_after_s = 2
high = 3.0

[[tiles]]
entity = "boiler-1"
type = "Boiler"
device = "boiler-1"
attribute = "outlet"
name = { es = "Salida", en = "Outlet" }
unit = "°C"
silent_after_s = 600
"""


async def send(place: Site, **measures: float | str) -> None:
    """One message of the boiler."""
    address = BrokerAddress.from_url(place.settings["IVEG_MQTT_URL"])
    async with aiomqtt.Client(address.host, address.port) as mqtt:
        await mqtt.publish("/iveg/boiler-1/attrs", json.dumps(measures), qos=1)


def states(api: httpx.Client) -> tuple[str, ...]:
    items = api.get("equipment").raise_for_status().json()["items"]
    return tuple(one["state"] for one in items)


def alerts(api: httpx.Client) -> set[str]:
    items = api.get("alerts").raise_for_status().json()["items"]
    return {one["key"] for one in items if one["cleared_at"] is None}


@pytest.mark.slow
async def test_a_device_of_a_file_is_a_tile_and_loses_its_signal_alone(
    tmp_path: Path,
) -> None:
    (tmp_path / "tiles.toml").write_text(TILES)
    equipment = str(tmp_path / "tiles.toml")
    with site(tmp_path, IVEG_EQUIPMENT=equipment) as place:
        place.start("fiware").wait_until_ready()
        place.start("serve")
        place.wait_until_served()
        with place.api() as api:
            place.wait_until_whole()
            # The same number twice: through the agent it is heard again.
            for _ in range(2):
                await send(place, pressure=3.2, outlet=55.0)
            until(lambda: states(api) == ("high", "ok"), "both values", 10.0)
            until(lambda: "alert.tile_high" in alerts(api), "the limit's alert", 10.0)
            until(lambda: states(api) == ("silent", "ok"), "the silence", 10.0)
            until(lambda: "alert.tile_silent" in alerts(api), "its alert", 10.0)
            await send(place, pressure=3.2, outlet="hot")
            until(lambda: states(api)[0] == "high", "the same value again", 10.0)
            until(lambda: states(api)[1] == "unreadable", "a text", 10.0)
            kept = until(
                lambda: api.get("measurements?class=outlet").json()["items"],
                "a row of the history",
                10.0,
            )
    assert [(one["value"], one["unit"]) for one in kept] == [(55.0, "°C")]
