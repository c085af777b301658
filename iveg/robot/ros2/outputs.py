"""A robot's gated drive, goals, neighbours and costmap as messages; and the port."""

import asyncio
import logging
import math
from collections.abc import Callable, Iterable, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from iveg.adapters import clock
from iveg.domain.costmap import UNKNOWN, InflatedGrid
from iveg.domain.errors import UnreadableError
from iveg.domain.geometry import REST, Pose2D, Twist2D
from iveg.domain.goals import Goal
from iveg.robot.costmap import FleetCostmap
from iveg.robot.node import RobotNode
from iveg.robot.peer_alerts import Neighbour
from iveg.robot.ros2.config import RobotConfig
from iveg.robot.ros2.reading import InputFaults, Stamps, read_twist, write_twist
from iveg.ros2 import cdr
from iveg.ros2 import messages as ros
from iveg.ros2.messages import Message
from iveg.ros2.names import Endpoint, Qos

# --- network ----------------------------------------------------------------------
#
# The DDS network as a robot needs it: the port of ``iveg/adapters/dds.py``, which only
# an installation with the extra ``ros2`` can import.  The gate is tested without it.


class Reader(Protocol):
    """A subscription."""

    def take(self) -> Sequence[bytes]:
        """All pending messages, oldest first."""


class Writer(Protocol):
    """A publication."""

    def write(self, payload: bytes) -> None:
        """Publish a message."""

    @property
    def readers(self) -> int:
        """Number of subscribers."""


class Network(Protocol):
    """One participant."""

    def reader(self, name: str, message: type[Message], qos: Qos) -> Reader:
        """Subscribe."""

    def writer(self, name: str, message: type[Message], qos: Qos) -> Writer:
        """Publish."""

    def endpoints(self) -> Sequence[Endpoint]:
        """All writers and readers on the network."""


# --- drive ------------------------------------------------------------------------
#
# The drive's side of Algorithm 3: twists of navigation in, gated twists out.
#
# A twist that cannot be read counts as zero.  The speed limit is decided by the gate of
# the safety node; this module only converts messages.


def message_of(*, stamped: bool) -> type[Message]:
    """Message type of a topic of twists."""
    kind: type[Message] = ros.TwistStamped if stamped else ros.Twist
    return kind


class DriveTopics:
    """Reads ``cmd_vel_in``, writes ``cmd_vel_out``; notes faults of either."""

    def __init__(self, config: RobotConfig, input_faults: InputFaults) -> None:
        self._drive, self._base_link = config.drive, config.frames.base_link
        self._topic = config.full_topics["cmd_vel_in"]
        self._input_faults, self._stamps = input_faults, Stamps()

    def read(self, payload: bytes, now: float) -> Twist2D | None:
        """The twist that upstream requests; None if it is not newer than the last."""
        try:
            if not self._drive.stamped_in:
                return read_twist(cdr.read(ros.Twist, payload))
            stamped = cdr.read(ros.TwistStamped, payload)
            verdict = self._stamps.verdict(stamped.header.stamp.seconds)
            if verdict in ("same", "back"):
                self._input_faults.note("time_back", self._topic, now)
                return None
            return read_twist(stamped.twist)
        except UnreadableError as error:
            self._input_faults.note(error.reason, self._topic, now)
            # Else the twist before it would stay in force for its half second.
            return REST

    def write(self, twist: Twist2D, wall: float) -> bytes:
        """Bytes for the base; ``wall`` is the robot's clock (Unix s)."""
        if self._drive.stamped_out:
            header = ros.Header(ros.Time.from_seconds(wall), self._base_link)
            return cdr.write(ros.TwistStamped(header, write_twist(twist)))
        return cdr.write(write_twist(twist))


# --- goal pose --------------------------------------------------------------------
#
# Goals of iVeg as Nav2 takes them: ``geometry_msgs/PoseStamped`` on ``goal_pose``.


def pose_for(
    goal: Goal | None, here: Pose2D, wall: float, frame: str
) -> ros.PoseStamped:
    """The pose to drive to, looking the way that leads there.

    Args:
        goal: None, or a pause: the pose is the robot's own.
        here: Pose of the robot in ``map``.
        wall: The robot's clock (Unix s).
        frame: Name of ``map``.
    """
    if goal is None or goal.kind == "pause":
        x, y, yaw = here.x, here.y, here.yaw
    else:
        x, y = goal.x, goal.y
        yaw = math.atan2(y - here.y, x - here.x)
    turned = ros.Quaternion(z=math.sin(yaw / 2), w=math.cos(yaw / 2))
    return ros.PoseStamped(
        ros.Header(ros.Time.from_seconds(wall), frame),
        ros.Pose(ros.Point(x, y), turned),
    )


# --- neighbours -------------------------------------------------------------------
#
# People and robots nearby for Nav2's costmap.
#
# The paper's costmap injection.  A point cloud in ``base_link`` holds a disc for each
# person and peer, and a circle of far points that clear the layer: a separate layer
# (docs/robots.md) marks the discs and removes old ones.

REACH_M = 8.0
"""Greatest distance of a disc (m); the clearing circle is a metre beyond."""
_SPACING_M = 0.1
_HEIGHT_M = 0.5
_RAYS = 1440
_FLOAT32 = 7


def cloud(
    neighbours: Iterable[Neighbour], own: Pose2D, stamp: ros.Time, frame: str
) -> ros.PointCloud2:
    """Discs to mark and a circle to clear, in ``base_link``."""
    discs = [
        _disc(near, own)
        for near in neighbours
        if own.distance_to(near.x, near.y) <= REACH_M
    ]
    points = np.ascontiguousarray(np.concatenate([_CLEARING, *discs]), "<f4")
    return ros.PointCloud2(
        ros.Header(stamp, frame),
        1,
        len(points),
        tuple(ros.PointField(name, 4 * n, _FLOAT32, 1) for n, name in enumerate("xyz")),
        False,
        12,
        12 * len(points),
        points.view(np.uint8).reshape(-1),
        True,
    )


_ANGLES = np.arange(_RAYS) * (math.tau / _RAYS)
_CIRCLE = (REACH_M + 1.0) * np.stack((np.cos(_ANGLES), np.sin(_ANGLES)))
_CLEARING = np.column_stack((*_CIRCLE, np.full(_RAYS, _HEIGHT_M)))


def _disc(near: Neighbour, own: Pose2D) -> NDArray[np.float64]:
    ahead, left = own.inverse(near.x, near.y)
    steps = np.arange(-near.body_m, near.body_m + _SPACING_M / 2, _SPACING_M)
    x, y = np.meshgrid(steps, steps)
    inside = np.hypot(x, y) <= near.body_m
    height = np.full(np.count_nonzero(inside), _HEIGHT_M)
    return np.column_stack((x[inside] + ahead, y[inside] + left, height))


# --- markers ----------------------------------------------------------------------
#
# Neighbours as shapes in RViz, in ``map``.

_MARKER_LIVES_S = 1


_CYLINDER, _TEXT = 3, 9


def markers(
    neighbours: Iterable[Neighbour], stamp: ros.Time, frame: str
) -> ros.MarkerArray:
    """Body, radius and name of each, with a lifetime of a second."""
    header, white = ros.Header(stamp, frame), ros.ColorRGBA(1.0, 1.0, 1.0, 1.0)
    shapes: list[ros.Marker] = []
    for number, near in enumerate(neighbours):
        hue = (0.9, 0.2, 0.1) if near.kind == "person" else (0.1, 0.4, 0.9)
        body, zone = ros.ColorRGBA(*hue, 0.9), ros.ColorRGBA(*hue, 0.15)
        for name, kind, z, width, height, color, text in (
            ("body", _CYLINDER, 0.9, 2 * near.body_m, 1.8, body, ""),
            ("zone", _CYLINDER, 0.01, 2 * near.zone_m, 0.02, zone, ""),
            ("name", _TEXT, 2.1, 0.0, 0.4, white, near.name),
        ):
            marker = ros.Marker(
                header,
                f"{near.kind} {name}",
                number,
                kind,
                pose=ros.Pose(ros.Point(near.x, near.y, z)),
                scale=ros.Vector3(width, width, height),
                color=color,
                lifetime=ros.Duration(_MARKER_LIVES_S),
                text=text,
            )
            shapes.append(marker)
    return ros.MarkerArray(tuple(shapes))


# --- costmap ----------------------------------------------------------------------
#
# The fleet's picture for Nav2's static layer: ``nav_msgs/OccupancyGrid`` in ``map``.
#
# Comfort: it is drawn in another thread while somebody listens, asks for scans of peers
# only then, and its failure is logged and ends nothing.

_log = logging.getLogger(__name__)
EVERY_S = 0.5


class CostmapTopic:
    """Draws and publishes one robot's costmap.

    Args:
        writer: Publication of its topic, transient local.
        costmap: Its cells.
        node: The robot's safety node, which gets feedback and scans of peers.
        frame: Name of ``map``.
        place: Returns the pose of the robot; None while it is not localised.
    """

    def __init__(
        self,
        writer: Writer,
        costmap: FleetCostmap,
        node: RobotNode,
        frame: str,
        place: Callable[[], Pose2D | None],
    ) -> None:
        self._writer, self._costmap, self._node = writer, costmap, node
        self._frame, self._place = frame, place
        self._newest: InflatedGrid | None = None
        node.on_peer_scan(self._on_scan)

    def _on_scan(self, topic: str, payload: bytes) -> None:
        iveg_s = self._node.machine.authors.newest_stamp_s
        self._costmap.receive(topic, payload, self._place(), iveg_s)

    async def run(self) -> None:
        """Publish until cancelled."""
        is_logged = False
        while True:
            try:
                await self._tell()
                is_logged = False
            except Exception:
                if not is_logged:
                    _log.exception("the costmap has failed; the gate goes on")
                is_logged = True
            await asyncio.sleep(EVERY_S)

    async def _tell(self) -> None:
        own = self._place()
        has_readers = self._writer.readers > 0
        self._node.asks_for_scans = has_readers
        if has_readers and own is not None:
            now, scans = clock.now(), self._costmap.drain_scans()
            present = self._node.machine.authors.neighbours(now.mono)
            self._newest = await asyncio.to_thread(
                self._costmap.draw, scans, present, own, now.mono
            )
            self._write(self._newest)
        elif self._newest is not None:
            # The topic is latched: a later reader would take the old grid for new.
            nothing = np.full_like(self._newest.data, UNKNOWN)
            self._write(InflatedGrid(self._newest.grid, nothing))
            self._newest = None

    def _write(self, costmap: InflatedGrid) -> None:
        stamp = ros.Time.from_seconds(clock.wall())
        self._writer.write(cdr.write(occupancy_grid(costmap, stamp, self._frame)))


def occupancy_grid(
    costmap: InflatedGrid, stamp: ros.Time, frame: str
) -> ros.OccupancyGrid:
    """The message of a costmap."""
    grid = costmap.grid
    corner = ros.Pose(ros.Point(grid.xmin, grid.ymin))
    info = ros.MapMetaData(stamp, grid.resolution, grid.width, grid.height, corner)
    return ros.OccupancyGrid(ros.Header(stamp, frame), info, costmap.data.reshape(-1))
