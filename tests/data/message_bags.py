"""Bags of any messages of ours, written by rosbags, in the forms of ROS 1 and 2."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin, Writer

from iveg.ros2.schema import Message
from tests.unit.ros2.reference import STORE, as_rosbags

Said = tuple[str, Message, float]
"""Topic, message, and when it was recorded (s)."""


def message_bag(
    path: Path, said: Iterable[Said], *, mcap: bool = True, store: Any = STORE
) -> Path:
    """A directory of ROS 2; messages in the order in which they were recorded."""
    plugin = StoragePlugin.MCAP if mcap else StoragePlugin.SQLITE3
    with Writer(path, version=9, storage_plugin=plugin) as writer:
        topics: dict[str, Any] = {}
        for topic, message, at in said:
            if topic not in topics:
                topics[topic] = writer.add_connection(
                    topic, message.ROS, typestore=store
                )
            data = bytes(STORE.serialize_cdr(as_rosbags(message), message.ROS))
            writer.write(topics[topic], round(at * 1e9), data)
    return path


def ros1_message_bag(path: Path, said: Iterable[Said]) -> Path:
    """A file ``.bag``; its definitions are left out, as readers need none."""
    with Ros1Writer(path) as writer:
        topics: dict[str, Any] = {}
        for topic, message, at in said:
            kind = message.ROS
            if topic not in topics:
                topics[topic] = writer.add_connection(
                    topic, kind, msgdef="# none", md5sum="0" * 32
                )
            wire = STORE.serialize_cdr(as_rosbags(message), kind)
            data = bytes(STORE.cdr_to_ros1(wire, kind))
            writer.write(topics[topic], round(at * 1e9), data)
    return path
