"""A robot between its ROS 2 topics and iVeg: Algorithms 1 and 3 over DDS.

Thirty times a second the newest message of each topic goes through the safety node to
iVeg; each twist goes to the gate at once.  Only the gate's output is published on the
drive's topic, repeatedly while it is zero; when this process ends, so does publishing.
"""

import asyncio
import itertools
import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass

from iveg.adapters import clock
from iveg.domain.errors import HopError
from iveg.domain.feedback import Feedback
from iveg.domain.fleet import RobotProfile
from iveg.domain.geometry import Twist2D
from iveg.domain.goals import Goal
from iveg.domain.observations import RobotFault
from iveg.domain.witness import Outline
from iveg.robot.costmap import FleetCostmap, Neighbours
from iveg.robot.node import NodeSettings, RobotNode, every
from iveg.robot.ros2 import outputs
from iveg.robot.ros2.checking import Lookout, forms_published
from iveg.robot.ros2.config import RobotConfig
from iveg.robot.ros2.inputs import SensorInputs
from iveg.robot.ros2.outputs import (
    CostmapTopic,
    DriveTopics,
    Network,
    Reader,
    Writer,
    message_of,
    pose_for,
)
from iveg.robot.ros2.reading import speed_of
from iveg.robot.ros2.topics import TOPICS, sensed_topics
from iveg.ros2 import cdr
from iveg.ros2 import messages as ros
from iveg.ros2.messages import Message, definitions
from iveg.ros2.names import Endpoint

_log = logging.getLogger(__name__)
RATE_HZ = 30.0
_DEPTH = 50
"""Pending messages after a thirtieth of a second that count as a flood."""
_OWN_STALL_S = 0.15
"""After a longer pause between two readings of the sensors a full queue, of sensors
or of requested velocities, shows our own delay."""
_PICTURE_DEPTH = 2
_LOOK_ROUND_TICKS, _TELL_TICKS = 15, 6
"""Ticks between two checks of endpoints, and between two outputs of neighbours."""
_KNOWN_WITHIN_S = 8.0
_ORDER = list(TOPICS)


@dataclass(frozen=True, slots=True)
class _In:
    """A topic that is read.

    Attributes:
        topic: Its key.
        form: The type that is read.
        most: Depth of its queue; 0: any number is normal.
        raw: It is read whatever its fields are.
    """

    topic: str
    form: type[Message]
    reader: Reader
    most: int
    raw: bool


class Ros2Robot:
    """One robot.

    Args:
        robot_id: Its id in iVeg.
        config: Names of topics and frames.
        network: The network.
        inputs: Its sensors.
        settings: Those of its safety node; its costmap covers the plan's bounds.
        profile: Its body and drive.
    """

    def __init__(
        self,
        robot_id: str,
        config: RobotConfig,
        network: Network,
        inputs: SensorInputs,
        settings: NodeSettings,
        profile: RobotProfile,
    ) -> None:
        self._id = robot_id
        self._config, self._names = config, config.full_topics
        self._network = network
        self.inputs, self._faults = inputs, inputs.input_faults
        self._topics = DriveTopics(config, self._faults)
        self._neighbours = Neighbours(robot_id)
        self._fleet_costmap = FleetCostmap(
            robot_id,
            Outline(profile.length, profile.width),
            None if settings.plan is None else settings.plan.bounds,
        )
        self._said: frozenset[tuple[str, str]] = frozenset()
        self._first_feedback: float | None = None
        self._known = False
        self._lookout = Lookout(config, self._faults, clock.mono())
        self._ticks = itertools.count()
        self._sensed_at = self._stalled_at = -math.inf
        self._open(network)
        self.node = RobotNode(
            robot_id,
            settings,
            profile=profile,
            drive=self._drive,
            navigate=self.navigate,
            on_feedback=self.hear_feedback,
        )
        self._costmap = self._open_costmap(network)

    def _open(self, network: Network) -> None:
        qualities, drive = self._config.qualities, self._config.drive
        self._ins: list[_In] = []
        for topic in sensed_topics(self._names):
            for form in TOPICS[topic].forms:
                # Codecs are made before the robot drives, not when a detector joins.
                for one in definitions(form):
                    one.STORE.get_msgdef(one.ROS)
            if len(TOPICS[topic].forms) == 1:
                self._listen(topic, TOPICS[topic].message)
        self._wishes = network.reader(
            self._names["cmd_vel_in"],
            message_of(stamped=drive.stamped_in),
            qualities["cmd_vel_in"].newest(_DEPTH),
        )
        self._out = network.writer(
            self._names["cmd_vel_out"],
            message_of(stamped=drive.stamped_out),
            qualities["cmd_vel_out"].newest(),
        )
        self._goal, self._cloud, self._markers = (
            network.writer(name, TOPICS[topic].message, qualities[topic].newest())
            if (name := self._names[topic])
            else None
            for topic in ("goal", "obstacles", "markers")
        )

    def _open_costmap(self, network: Network) -> CostmapTopic | None:
        name = self._names["costmap"]
        if not name:
            return None
        topic = CostmapTopic(
            network.writer(
                name, TOPICS["costmap"].message, self._config.qualities["costmap"]
            ),
            self._fleet_costmap,
            self._neighbours,
            self._config.frames.map,
            lambda: None if (place := self.inputs.place) is None else place.flat(),
            self.node.ask_for_peer_scans,
        )
        self.node.hear_peer_scans(topic.hear)
        return topic

    def _listen(self, topic: str, form: type[Message], *, raw: bool = False) -> None:
        quality = self._config.qualities[topic]
        is_picture = TOPICS[topic].role == "picture"
        usual = max(_DEPTH, quality.depth)
        qos = quality.newest(_PICTURE_DEPTH if is_picture else usual)
        reader = self._network.reader(self._names[topic], form, qos, raw=raw)
        self._ins.append(_In(topic, form, reader, 0 if is_picture else usual, raw))
        self._ins.sort(key=lambda one: _ORDER.index(one.topic))

    async def run(self) -> None:
        """Run until cancelled; the drive is left at rest."""
        self._network.watch([self._wishes], self._on_wish)
        async with asyncio.TaskGroup() as tasks:
            for name, work in (
                ("node", self.node.run()),
                ("senses", every(1 / RATE_HZ, self._tick)),
            ):
                tasks.create_task(work, name=f"{self._id}-{name}")
            if self._costmap is not None:
                tasks.create_task(self._costmap.run(), name=f"{self._id}-costmap")

    def _tick(self, _: float) -> None:
        number = next(self._ticks)
        self._sense()
        if number % _LOOK_ROUND_TICKS == 0:
            self._look_round()
        if number % _TELL_TICKS == 0:
            self._tell_neighbours()

    # --- in -----------------------------------------------------------------------

    def _sense(self) -> None:
        now = clock.now()
        if now.mono - self._sensed_at > _OWN_STALL_S:
            self._stalled_at = now.mono
        self._sensed_at = now.mono
        is_late = self._is_late(now.mono)
        for one in self._ins:
            if waited := one.reader.take():
                form = TOPICS[one.topic].form(one.form.ROS)
                most = 0 if is_late else one.most
                self.inputs.hear(one.topic, waited, now.mono, most, form)
        self.node.sense(*self.inputs.tick(now))
        self._judge(now.mono)

    def _is_late(self, now: float) -> bool:
        """Whether the gate itself stood still until now: a full queue is its own."""
        stands_still = now - self._sensed_at > _OWN_STALL_S
        return stands_still or now - self._stalled_at < 1 / RATE_HZ

    def _judge(self, now: float) -> None:
        faults = self._faults.faults(now)
        self.node.limit(*speed_of(faults))
        self.node.set_faults(faults)
        if faults or self._said:
            self._log(faults)

    def _log(self, faults: tuple[RobotFault, ...]) -> None:
        """Log each fault once at its start and once at its end."""
        said = frozenset((one.code, one.about) for one in faults)
        for code, about in said - self._said:
            _log.warning("%s: %s, %s", self._id, code, about)
        for code, about in self._said - said:
            _log.warning("%s: over: %s, %s", self._id, code, about)
        self._said = said

    def _on_wish(self) -> None:
        now = clock.mono()
        waited = self._wishes.take()
        if len(waited) >= _DEPTH and not self._is_late(now):
            self._faults.note("flood", self._names["cmd_vel_in"], now)
        if not waited:
            return
        wish = self._topics.read(waited[-1], now)
        if wish is not None:
            self.node.request_twist(wish)

    def _look_round(self) -> None:
        """Check the endpoints of others, and iVeg's knowledge of us."""
        now, endpoints = clock.mono(), self._network.endpoints()
        self._lookout.look(endpoints, self._network.unheard(), now)
        self._meet_detectors(endpoints)
        first = self._first_feedback
        if not self._known and first is not None and now - first > _KNOWN_WITHIN_S:
            self._faults.note("unknown_to_iveg", self._id, now)

    def _meet_detectors(self, endpoints: Sequence[Endpoint]) -> None:
        """Listen to a detector in the type in which it publishes.

        A reader of each type from the start would be announced, and tools of ROS refuse
        a topic of several types.
        """
        for topic, name in sensed_topics(self._names).items():
            known = [one for one in self._ins if one.topic == topic]
            if len(TOPICS[topic].forms) == 1:
                continue
            published = forms_published(topic, name, endpoints)
            typed = [
                one for one in known if not one.raw and (one.form, False) in published
            ]
            if typed and not any(one.reader.writers for one in typed):
                self.inputs.note_unreadable(topic, typed[0].form, clock.mono())
            for form, raw in published:
                if any((one.form, one.raw) == (form, raw) for one in known):
                    continue
                if known and all(one.form.ROS != form.ROS for one in known):
                    _log.warning("%s: %s comes as %s now", self._id, name, form.ROS)
                self._listen(topic, form, raw=raw)

    def hear_feedback(self, peer: str, feedback: Feedback) -> None:
        """Take iVeg's feedback of a peer's topic."""
        now = clock.mono()
        if self._first_feedback is None:
            self._first_feedback = now
        self._known = self._known or self._id in feedback.seen
        self._neighbours.note(peer, feedback, now)
        self._fleet_costmap.note(feedback)

    # --- out ----------------------------------------------------------------------

    def _drive(self, twist: Twist2D) -> None:
        try:
            self._out.write(self._topics.write(twist, clock.wall()))
        except HopError as error:
            # No command arrives, so the base halts by its own time-out.
            _log.debug("%s: %s", self._id, error)
            out = self._names["cmd_vel_out"]
            self._faults.note("drive_refused", out, clock.mono())

    def navigate(self, goal: Goal | None) -> bool:
        """Publish a goal; a topic takes none back, so to give up is to stay here."""
        writer, place = _heard(self._goal), self.inputs.place
        if writer is None or place is None:
            return False
        frame = self._config.frames.map
        try:
            writer.write(cdr.write(pose_for(goal, place.flat(), clock.wall(), frame)))
        except HopError as error:
            _log.warning("%s: goal not published: %s", self._id, error)
            return False
        return True

    def _tell_neighbours(self) -> None:
        place = self.inputs.place
        cloud, drawing = _heard(self._cloud), _heard(self._markers)
        if place is None or (cloud is None and drawing is None):
            return
        now = clock.now()
        own, stamp = place.flat(), ros.Time.of(now.wall)
        present = self._neighbours.present(own, now.mono)
        frames = self._config.frames
        if cloud is not None:
            found = outputs.cloud(present, own, stamp, frames.base_link)
            cloud.write(cdr.write(found))
        if drawing is not None:
            drawn = outputs.markers(present, stamp, frames.map)
            drawing.write(cdr.write(drawn))


def _heard(writer: Writer | None) -> Writer | None:
    """The writer if it has subscribers."""
    return writer if writer is not None and writer.readers else None
