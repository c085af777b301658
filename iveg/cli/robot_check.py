"""``iveg robot check`` listens for three seconds and prints what is missing."""

import asyncio
from dataclasses import replace
from typing import TYPE_CHECKING

from iveg.adapters import clock
from iveg.adapters.dds_network import DdsNetwork
from iveg.adapters.fleet_files import load_fleet
from iveg.adapters.mqtt import MqttLink
from iveg.cli.nodes import broker_of
from iveg.domain.errors import UnreadableError
from iveg.robot.ros2.checking import Heard, judge
from iveg.robot.ros2.config import RobotConfig
from iveg.robot.ros2.lookout import forms_published
from iveg.robot.ros2.topics import TOPICS, sensed_topics
from iveg.robot.ros2.transforms import TransformBuffer
from iveg.robot.ros2.verdict import lines
from iveg.ros2 import cdr, geometry_msgs, std_msgs
from iveg.ros2.schema import Message
from iveg.settings import Settings

if TYPE_CHECKING:
    from iveg.adapters.dds import Dds
    from iveg.adapters.dds_entities import DdsReader


_CHECK_S = 3.0


async def check(
    robot_id: str, config: RobotConfig, network: DdsNetwork, settings: Settings
) -> int:
    """Listen for three seconds without publishing, and print what is missing."""
    from iveg.adapters.dds import Dds

    heard: dict[str, Heard] = {}
    transforms = TransformBuffer(config.tf_max_age_s)
    newest = 0.0
    with Dds(network) as dds:
        readers: dict[tuple[str, type[Message]], DdsReader] = {}
        link = MqttLink(broker_of(settings), f"check of {robot_id}")
        task = asyncio.create_task(link.run(), name="broker")
        began = clock.mono()
        while clock.mono() - began < _CHECK_S:
            _listen(dds, config, readers)
            await asyncio.sleep(0.05)
            for (topic, form), reader in readers.items():
                for one in reader.take():
                    newest = max(newest, _hear(topic, form, one, heard, transforms))
        broker = None if link.connected else _no_broker(settings)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        verdict = judge(
            config,
            dds.endpoints(),
            heard,
            transforms,
            seconds=_CHECK_S,
            stamp=newest,
            broker=broker,
            robot_id=robot_id,
        )
    known = load_fleet(settings.fleet, settings.robots).ids
    missing = verdict.missing
    if robot_id not in known:
        fleet = ", ".join(known)
        missing += (f"{robot_id} is not in the fleet that IVEG_ROBOTS names: {fleet}.",)
    print("\n".join(lines(replace(verdict, missing=missing))))
    return 1 if missing else 0


def _no_broker(settings: Settings) -> str:
    address = broker_of(settings)
    return f"No MQTT broker answers at {address.host}:{address.port} (IVEG_MQTT_URL)."


def _listen(
    dds: "Dds",
    config: RobotConfig,
    readers: "dict[tuple[str, type[Message]], DdsReader]",
) -> None:
    """Read each topic that is published, in its type."""
    endpoints = dds.endpoints()
    for topic, name in sensed_topics(config.full_topics).items():
        depth = 2 if TOPICS[topic].role == "picture" else 200
        qos = config.qualities[topic].newest(depth)
        for form in forms_published(topic, name, endpoints):
            if (topic, form) not in readers:
                readers[topic, form] = dds.reader(name, form, qos)


def _hear(
    topic: str,
    form: type[Message],
    payload: bytes,
    heard: dict[str, Heard],
    transforms: TransformBuffer,
) -> float:
    """Count a message; returns its stamp (s) for odometry."""
    one = heard.setdefault(topic, Heard())
    one.count += 1
    try:
        message = cdr.read(form, payload)
    except UnreadableError:
        one.unreadable += 1
        return 0.0
    if isinstance(message, geometry_msgs.TFMessage):
        transforms.add(message, static=topic == "tf_static")
        return 0.0
    if not isinstance(message, std_msgs.Stamped):
        return 0.0
    header = message.header
    one.frame = header.frame_id
    one.age_s = clock.wall() - header.stamp.seconds
    return header.stamp.seconds if topic == "odometry" else 0.0
