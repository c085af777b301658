"""Bags of any messages of ours, written by rosbags, in the form of ROS 2."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from rosbags.rosbag2 import StoragePlugin, Writer

from iveg.ros2 import cdr
from iveg.ros2.messages import STORE, Message

Said = tuple[str, Message, float]
"""Topic, message, and when it was recorded (s)."""


def message_bag(path: Path, said: Iterable[Said], *, mcap: bool = True) -> Path:
    """A directory of ROS 2; messages in the order in which they were recorded."""
    plugin = StoragePlugin.MCAP if mcap else StoragePlugin.SQLITE3
    with Writer(path, version=9, storage_plugin=plugin) as writer:
        topics: dict[str, Any] = {}
        for topic, message, at in said:
            if topic not in topics:
                topics[topic] = writer.add_connection(
                    topic, message.ROS, typestore=STORE
                )
            writer.write(topics[topic], round(at * 1e9), cdr.write(message))
    return path
