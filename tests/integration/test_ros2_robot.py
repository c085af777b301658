"""``iveg robot`` as a process: one gate a robot, a flood on a real DDS, and a check."""

import asyncio
import math
import re
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from urllib.parse import urlsplit

import pytest

from iveg.adapters import clock
from iveg.adapters.mqtt import BrokerAddress, MqttLink
from iveg.domain.feedback import CLEAR, Feedback
from iveg.domain.observations import DetectionFrame, Origin, SafetyReport
from iveg.ngsi import codec
from iveg.ngsi.names import direct_topic, measure_topic
from iveg.ros2 import cdr, names
from iveg.ros2 import detector_messages as d
from iveg.ros2 import messages as ros
from tests.brokers import broker_on
from tests.dds import Dds, free_domain, loopback
from tests.processes import Program, Site, site

ROBOT = "AGI"
_KEY, _DETECTIONS = "iveg", "_yolox_bounding_boxes"
PERSON = d.BoundingBox3d("farmer", 0.9, 2.8, 0.2, 3.2, 0.8, 0.0, 1.8)
"""3 m before the robot and 0.5 m to its left."""


@dataclass
class Riding:
    """A gate that runs, and two that were started for the same robot after it.

    Attributes:
        here: On the same machine.
        elsewhere: On one that shares but DDS with it.
        words: What each was started with, but the first.
    """

    place: Site
    domain: int
    gate: Program
    here: Program
    elsewhere: Program
    words: list[str]


@pytest.fixture(scope="module")
def riding(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Riding]:
    domain = free_domain()
    who = ["--id", ROBOT, "--ros-domain", str(domain)]
    who += ["--ros-interface", "127.0.0.1", "--ros-peer", "127.0.0.1"]
    words = ["robot", "--attended", *who]
    one, other = (tmp_path_factory.mktemp(name) for name in ("one", "other"))
    config = one / "robot.toml"
    config.write_text('[topics]\ndetections_3d = "/yolact_coordinate"\n')
    with site(one, IVEG_ROBOTS=ROBOT) as place:
        gate = place.start(*words, "--config", str(config))
        gate.wait_until_ready()
        with site(other, **place.settings | {"XDG_DATA_HOME": str(other)}) as second:
            here, elsewhere = place.start(*words), second.start(*words)
            yield Riding(place, domain, gate, here, elsewhere, who)


class Iveg:
    """As much of iVeg as lets a robot drive, and what the robot reported last."""

    def __init__(self, address: BrokerAddress) -> None:
        self.report: SafetyReport | None = None
        self.frame: DetectionFrame | None = None
        self._devices = {
            direct_topic(ROBOT, "_safety"): f"{ROBOT}_safety",
            measure_topic(_KEY, f"{ROBOT}{_DETECTIONS}"): f"{ROBOT}{_DETECTIONS}",
        }
        topics = dict.fromkeys(self._devices, 1)
        self.link = MqttLink(address, "iveg", topics, self._take)

    def _take(self, topic: str, payload: bytes) -> None:
        for one in codec.read_measure(self._devices[topic], payload).observations:
            if isinstance(one, SafetyReport):
                self.report = one
            elif isinstance(one, DetectionFrame):
                self.frame = one

    async def talk(self) -> None:
        """Name the newest report ten times a second."""
        seq = 0
        while True:
            seq += 1
            heard = 0 if self.report is None else self.report.origin.seq or 0
            clear = {ROBOT: CLEAR}
            said = Feedback(
                ROBOT, Origin("b", seq), speed_limits=clear, seen={ROBOT: heard}
            )
            topic = f"/{ROBOT}/mqtt_feedback"
            self.link.enqueue(topic, codec.write_feedback(said), 1)
            await asyncio.sleep(0.1)


class Sensors:
    """A base's odometry, on DDS, and its ear."""

    def __init__(self, dds: Dds) -> None:
        self._odometry = dds.writer("/odom", ros.Odometry, names.DEFAULT)
        self._tf = dds.writer("/tf", ros.TFMessage, names.DEFAULT)
        self._boxes = dds.writer("/yolact_coordinate", d.BoundingBoxes3d, names.DEFAULT)
        self.drive = dds.reader("/cmd_vel", ros.Twist, names.DEFAULT)

    async def talk(self) -> None:
        """Say where the base is thirty times a second, as often as ``burst``."""
        while True:
            stamp = ros.Time.from_seconds(clock.wall())
            odom = ros.Header(stamp, "odom")
            links = (
                ros.TransformStamped(ros.Header(stamp, "map"), "odom"),
                ros.TransformStamped(odom, "base_link"),
            )
            self._tf.write(cdr.write(ros.TFMessage(links)))
            base = ros.Header(stamp, "base_link")
            self._boxes.write(cdr.write(d.BoundingBoxes3d(base, (PERSON,))))
            self._odometry.write(cdr.write(ros.Odometry(odom, "base_link")))
            await asyncio.sleep(1 / 30)


@asynccontextmanager
async def at_work(riding: Riding) -> AsyncIterator[tuple[Iveg, Sensors]]:
    """A broker, iVeg and sensors for the gate that runs."""
    port = urlsplit(riding.place.settings["IVEG_MQTT_URL"]).port or 0
    async with broker_on(port, riding.place.directory) as address:
        iveg = Iveg(address)
        with Dds(loopback(riding.domain)) as dds:
            sensors = Sensors(dds)
            tasks = [
                asyncio.create_task(work)
                for work in (iveg.link.run(), iveg.talk(), sensors.talk())
            ]
            try:
                yield iveg, sensors
            finally:
                for task in tasks:
                    task.cancel()
                await asyncio.gather(*tasks, return_exceptions=True)


async def test_a_detector_with_its_own_messages_tells_iveg_of_its_person(
    riding: Riding,
) -> None:
    async with at_work(riding) as (iveg, _):
        async with asyncio.timeout(30.0):
            while iveg.frame is None or not iveg.frame.detections:  # noqa: ASYNC110
                await asyncio.sleep(0.05)

    (seen,) = iveg.frame.detections
    assert (seen.class_id, seen.frame_id) == ("farmer", "map")
    assert math.dist(seen.box.centre[:2], (3.0, 0.5)) <= 0.1


async def test_a_check_tells_a_robot_that_talks_what_it_lacks(riding: Riding) -> None:
    lacks = [
        r"/odom +nav_msgs/msg/Odometry +1 +\d+\.\d +reliable +odom +ok",
        r"/scan .*nobody publishes it \(sensor_msgs/msg/LaserScan\)",
        r"/yolact_coordinate .*a detector's: topics\.detections_3d",
        r"/cmd_vel +geometry_msgs/msg/Twist .* ok",
    ]
    missing = lacks
    async with at_work(riding):
        # Beside busy programs the talker may fall silent, and others are found late.
        for _ in range(8):
            check = riding.place.start("robot", "check", *riding.words)
            assert await asyncio.to_thread(check.process.wait, 60) == 1
            said = check.text()
            assert "MQTT" not in said
            missing = [
                row for row in lacks if not re.search(f"^{row}$", said, re.MULTILINE)
            ]
            if not missing:
                break

    assert missing == []


def test_a_second_gate_refuses_and_says_who_drives(riding: Riding) -> None:
    """On the same machine by its lease, on another by the drive's publisher."""
    codes = [one.process.wait(20) for one in (riding.here, riding.elsewhere)]

    assert codes == [1, 1]
    said = f"AGI is driven already, by process {riding.gate.pid}"
    assert said in riding.here.text()
    assert "only one program may drive this robot" in riding.elsewhere.text()
    assert riding.gate.process.poll() is None
