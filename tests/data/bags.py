"""Small bags of ROS 2, written where a test wants them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

ODOMETRY, SCAN, TEXT = (
    "nav_msgs/msg/Odometry",
    "sensor_msgs/msg/LaserScan",
    "std_msgs/msg/String",
)
LOGGED_FROM_S = 1000.0
"""When the recorder of every bag began (s); it writes 20 messages a second."""


@dataclass(frozen=True, slots=True)
class Said:
    """One message: where, what kind, what the sensor's clock said (s), the rest."""

    topic: str
    kind: str
    stamp_s: float = 0.0
    x: float = 0.0
    yaw: float = 0.0
    v: float = 0.0
    ranges: Sequence[float] = ()
    raw: bytes | None = None


def drive(seconds: float = 2.0, speed: float = 1.0, stamps: bool = True) -> list[Said]:
    """A robot that drives along x, looks, and stands at the end."""
    said = []
    for tick in range(round(seconds * 10)):
        t = tick / 10
        stamp = 500.0 + t if stamps else 0.0
        said.append(Said("/odom", ODOMETRY, stamp, x=speed * t, v=speed))
        said.append(Said("/scan", SCAN, stamp, ranges=(1.0, math.inf, math.nan, 2.5)))
    return said


def mcap_bag(path: Path, said: Sequence[Said]) -> Path:
    """The ``.mcap`` of a bag of ROS 2."""
    return _ros2(path, said, StoragePlugin.MCAP) / f"{path.name}.mcap"


def db3_bag(path: Path, said: Sequence[Said]) -> Path:
    """The ``.db3`` of a bag of ROS 2."""
    return _ros2(path, said, StoragePlugin.SQLITE3) / f"{path.name}.db3"


def bag_directory(path: Path, said: Sequence[Said]) -> Path:
    """A bag of ROS 2 as ``ros2 bag record`` leaves it."""
    return _ros2(path, said, StoragePlugin.SQLITE3)


def _ros2(path: Path, said: Sequence[Said], plugin: StoragePlugin) -> Path:
    store = get_typestore(Stores.ROS2_HUMBLE)
    with Writer(path, version=8, storage_plugin=plugin) as writer:
        _fill(writer, store, said)
    return path


def _fill(writer: Any, store: Any, said: Sequence[Said]) -> None:
    topics = dict.fromkeys((one.topic, one.kind) for one in said)
    connections = {
        topic: writer.add_connection(topic[0], topic[1], typestore=store)
        for topic in topics
    }
    for number, one in enumerate(said):
        logged = round((LOGGED_FROM_S + number / 20) * 1e9)
        data = one.raw
        if data is None:
            data = bytes(store.serialize_cdr(_message(store.types, one), one.kind))
        writer.write(connections[one.topic, one.kind], logged, data)


def _message(types: Any, one: Said) -> object:
    if one.kind == TEXT:
        return types[TEXT](data="hello")
    sec, rest = divmod(one.stamp_s, 1.0)
    stamp = types["builtin_interfaces/msg/Time"](
        sec=int(sec), nanosec=round(rest * 1e9)
    )
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="odom")
    if one.kind == SCAN:
        return types[SCAN](
            header=header,
            angle_min=-1.5,
            angle_max=1.5,
            angle_increment=1.0,
            time_increment=0.0,
            scan_time=0.1,
            range_min=0.5,
            range_max=20.0,
            ranges=np.array(one.ranges, np.float32),
            intensities=np.zeros(0, np.float32),
        )
    return _odometry(types, one, header)


def _odometry(types: Any, one: Said, header: object) -> object:
    point = types["geometry_msgs/msg/Point"](x=one.x, y=2.0, z=0.1)
    turned = types["geometry_msgs/msg/Quaternion"](
        x=0.0, y=0.0, z=math.sin(one.yaw / 2), w=math.cos(one.yaw / 2)
    )
    vector = types["geometry_msgs/msg/Vector3"]
    pose = types["geometry_msgs/msg/Pose"](position=point, orientation=turned)
    twist = types["geometry_msgs/msg/Twist"](
        linear=vector(x=one.v, y=0.0, z=0.0), angular=vector(x=0.0, y=0.0, z=0.25)
    )
    unsure = np.zeros(36)
    return types[ODOMETRY](
        header=header,
        child_frame_id="base_link",
        pose=types["geometry_msgs/msg/PoseWithCovariance"](pose, unsure),
        twist=types["geometry_msgs/msg/TwistWithCovariance"](twist, unsure),
    )
