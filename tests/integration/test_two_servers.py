"""Two servers on one broker, each a process of its own, and the robots between them."""

import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from iveg.adapters.mqtt import BrokerAddress, MqttLink
from iveg.domain.observations import SafetyReport
from iveg.ngsi import codec
from tests.chaos.person import Person
from tests.chaos.witness import Witness
from tests.processes import EMULATOR, Site, site, until
from tests.threads import running

ALLOWED_S = 3.0
"""A robot may keep to the limit of so long ago: messages cross on their way.  One that
took the laxer server's word would keep to it for longer."""
SHARED = "IVEG_MQTT_URL", "IVEG_ORION_URL", "IVEG_IOTA_URL"


@dataclass
class Comparison:
    """Reports of robots beside what the server met first allows them.

    Attributes:
        boots: Authors of feedback, in the order in which they were met.
        told: Limits of the first of the last second, by robot, each with its moment.
        counts: Reports; those ``faster`` than the first allowed within that second; and
            limits of others that are ``laxer`` than the newest of the first.
    """

    port: int
    boots: list[str] = field(default_factory=list)
    told: dict[str, list[tuple[float, float]]] = field(default_factory=dict)
    counts: Counter[str] = field(default_factory=Counter)

    def take(self, topic: str, payload: bytes) -> None:
        """One message on the broker."""
        if topic.endswith("/mqtt_feedback"):
            self._feedback(payload)
            return
        device = f"{topic.split('/')[1]}_safety"
        for said in codec.read_measure(device, payload).observations:
            if isinstance(said, SafetyReport):
                self._report(said)

    def _feedback(self, payload: bytes) -> None:
        feedback, now = codec.read_feedback(payload), time.monotonic()
        boot = feedback.origin.boot or ""
        self.boots += [boot] if boot not in self.boots else []
        for robot_id, limit in feedback.speed_limits.items():
            if boot == self.boots[0]:
                told = self.told.setdefault(robot_id, [])
                told.append((now, limit.speed_factor))
                while now - told[0][0] > ALLOWED_S:
                    told.pop(0)
            else:
                first = self.told.get(robot_id, [(now, 0.0)])[-1][1]
                self.counts["laxer"] += limit.speed_factor > first

    def _report(self, said: SafetyReport) -> None:
        told = self.told.get(said.robot_id, [])
        if not told:
            return
        self.counts["reports"] += 1
        self.counts["faster"] += said.speed_factor > max(factor for _, factor in told)

    @contextmanager
    def listening(self) -> Iterator["Comparison"]:
        address = BrokerAddress("127.0.0.1", self.port)
        topics = {"/+/mqtt_feedback": 1, "/+/iveg/safety": 1}
        link = MqttLink(address, "comparison", topics, self.take)
        with running(link.run(), "comparison"):
            yield self


def port_of(place: Site) -> int:
    return int(urlsplit(place.settings["IVEG_MQTT_URL"]).port or 0)


def raises(place: Site, key: str) -> bool:
    with place.api() as api:
        return key in {one["key"] for one in api.get("alerts").json()["items"]}


@contextmanager
def two_servers(folder: Path) -> Iterator[tuple[Site, Site]]:
    """Robots and a server, and a second with a laxer rule, which is not started yet."""
    lax = {"IVEG_SAFETY_RADIUS_M": "0.5", "IVEG_CONFIDENCE_THRESHOLD": "1.0"}
    for name in ("first", "second"):
        (folder / name).mkdir()
    with site(folder / "first") as first:
        shared = {name: first.settings[name] for name in SHARED}
        with site(folder / "second", **lax, **shared) as second:
            first.start("fiware")
            first.start("serve")
            first.start(*EMULATOR, "--scenario", "viewpoints")
            first.wait_until_live()
            yield first, second


@pytest.mark.slow
def test_f66_a_second_server_makes_nobody_faster_and_both_are_told_stop_and_release(
    tmp_path: Path,
) -> None:
    with two_servers(tmp_path) as (first, second):
        port = port_of(first)
        with Comparison(port).listening() as seen, Witness(port) as witness:
            until(lambda: seen.counts["reports"] > 10, "robots report")
            second.start("serve")
            second.wait_until_live()
            for place in (first, second):
                until(partial(raises, place, "alert.another_iveg"), "P1")
            until(lambda: seen.counts["laxer"] > 40, "the second would allow more")
            assert seen.counts["faster"] == 0

            people = [Person(place, witness) for place in (first, second)]
            for presses in people:
                assert presses.press("AGI")
                for looks in people:
                    looks.wait_for("AGI", "STANDING")
                # The other has adopted this STOP, and does not stop it again.
                presses.let_go("AGI")
            for one in people:
                one.close()
