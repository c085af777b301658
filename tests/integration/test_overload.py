"""Two robots at their full rate before an agent that carries 70 measures a second.

They have about 190 to send.  Everything runs for real; what limits the rate is the way
to the agent, not the product.  Longer runs are on the virtual clock, in
``unit/robot/test_rates``.
"""

import os
import subprocess
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass

import httpx
import pytest

from iveg.adapters.mqtt import BrokerAddress
from tests.bonds import bound
from tests.brokers import MOSQUITTO, PLAIN
from tests.integration.gate import Gate, bridge, gate
from tests.ports import free_ports
from tests.processes import Site, site, until

pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(180),
    pytest.mark.skipif(
        MOSQUITTO is None and "CI" not in os.environ, reason="Mosquitto is missing"
    ),
]
CARRIED_PER_S = 70.0
"""Less than the 100 that a slow machine's robots may just reach."""
SETTLES_WITHIN_S, STAYS_S = 90.0, 6.0


@pytest.fixture
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Site, Gate]]:
    """The broker in front, the rest of FIWARE behind a narrow way, two robots.

    The gate is the dashboard's own way to the broker.
    """
    front, behind = free_ports(2)
    with ExitStack() as stack:
        place = stack.enter_context(site(tmp_path_factory.mktemp("overload")))
        conf = place.directory / "mosquitto.conf"
        conf.write_text(PLAIN.format(port=front))
        broker = subprocess.Popen(bound(str(MOSQUITTO), "-c", str(conf)))
        stack.callback(broker.wait, 10.0)
        stack.callback(broker.kill)
        place.settings["IVEG_MQTT_URL"] = f"mqtt://127.0.0.1:{behind}"
        place.start("fiware").wait_until_ready()
        place.settings["IVEG_MQTT_URL"] = f"mqtt://127.0.0.1:{front}"
        here, there = (BrokerAddress("127.0.0.1", port) for port in (front, behind))
        stack.enter_context(bridge(here, there, CARRIED_PER_S))
        straight = stack.enter_context(gate(front))
        place.settings["IVEG_MQTT_URL"] = f"mqtt://127.0.0.1:{straight.port}"
        place.start("serve")
        place.wait_until_served()
        place.settings["IVEG_MQTT_URL"] = f"mqtt://127.0.0.1:{front}"
        place.start("emulator")
        yield place, straight


@dataclass
class Health:
    """What iVeg says of the hops, look by look."""

    api: httpx.Client
    well_since: float = float("inf")

    def unwell(self) -> dict[str, str]:
        told = self.api.get("health").raise_for_status().json()
        hops = {one["hop"]: one["state"] for one in told["hops"]}
        return {hop: state for hop, state in hops.items() if state != "ok"}

    def was_late(self) -> bool:
        return self.unwell().get("iot_agent") == "late"

    def well_for_s(self) -> float:
        """Since when without a break every hop has been well (s)."""
        now = time.monotonic()
        self.well_since = float("inf") if self.unwell() else min(self.well_since, now)
        return now - self.well_since


def transports(api: httpx.Client) -> set[str]:
    """What brings the robots' poses."""
    robots = api.get("robots").raise_for_status().json()["items"]
    return {one["transport"] for one in robots}


def test_f52_f53_two_robots_settle_into_health_and_orion_fills_in_when_mqtt_is_lost(
    running: tuple[Site, Gate],
) -> None:
    place, straight = running
    with place.api() as api:
        health = Health(api)
        until(health.was_late, "the agent is behind at first")
        until(lambda: health.well_for_s() > STAYS_S, "it settles", SETTLES_WITHIN_S)
        robots = api.get("robots").raise_for_status().json()["items"]
        assert {one["link"] for one in robots} == {"LIVE"}
        assert transports(api) == {"direct"}
        straight.be("shut")
        until(lambda: transports(api) == {"fiware"}, "Orion fills in")
