"""One robot: its settings, its periods, and the node between machine and broker."""

import asyncio
import itertools
import logging
import secrets
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Literal

from iveg.adapters import clock
from iveg.adapters.mqtt import BrokerAddress, MqttLink
from iveg.domain.errors import UnreadableError
from iveg.domain.fleet import RobotProfile
from iveg.domain.geometry import REST, Twist2D
from iveg.domain.observations import (
    CommandAnswer,
    FeedbackRef,
    GoalAnswer,
    Instant,
    LaserScan,
    Navigation,
    Observation,
    Odometry,
    RobotFault,
    SafetyReport,
    Unplaced,
)
from iveg.ngsi import names
from iveg.ngsi.codec import read_feedback, read_goal
from iveg.robot.gate import FREE, Cap
from iveg.robot.goals import Facts, Navigate, RobotGoals
from iveg.robot.holds import read_holds, write_holds
from iveg.robot.judgement import DEFAULT_LIMITS, Limits
from iveg.robot.safety import Drive, Effect, Persist, Report, SafetyMachine, SendAnswer
from iveg.robot.uplink import SafetyLane, Sender, Uplink

# --- pacing -----------------------------------------------------------------------
#
# Periodic calls.

SLOTS = 3
"""Slots of a robot's period: drive and odometry, laser, camera."""
LONGEST_STEP_S = 0.1
"""Longest time step (s): a computer that was suspended moves no robot by a jump."""


async def every(period: float, work: Callable[[float], None]) -> None:
    """Call ``work`` with the time since its last call, once a period (s), for ever.

    A call more than a period late moves the later ones: missed calls are not repeated.
    """
    last = due = clock.mono()
    while True:
        now = clock.mono()
        work(now - last)
        last = now
        due = max(due + period, now)
        await asyncio.sleep(max(0.0, due - clock.mono()))


async def in_slots(period: float, work: Sequence[Callable[[float], None]]) -> None:
    """Call each of ``work`` once a period (s), evenly spaced, for ever."""
    slots = itertools.cycle(work)
    await every(period / len(work), lambda dt: next(slots)(dt))


# --- node settings ----------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeSettings:
    """Settings of a safety node.

    Attributes:
        address: The broker.
        apikey: First part of the measure topics.
        directory: Folder of the hold files, which survive a loss of power.
        limits: Waiting times and the plan; the profile is each robot's own.
        replay: Map frame of the recording that is played; None: a real robot.  Its
            messages are marked, and echo no feedback: they were measured long ago.
        read_clock: The robot's own clocks.
        open_link: Opens its link to the broker.
    """

    address: BrokerAddress
    apikey: str
    directory: Path
    limits: Limits = DEFAULT_LIMITS
    replay: str | None = None
    read_clock: Callable[[], Instant] = clock.now
    open_link: Callable[[BrokerAddress, str], MqttLink] = MqttLink


# --- node -------------------------------------------------------------------------
#
# Safety software of one robot: executes the effects of the safety machine.
#
# It is the only publisher to the drive. Effects are executed where they arise, the zero
# command first (R5); disk and broker have queues of their own and are never waited for.

_log = logging.getLogger(__name__)
_GATE_EVERY_S = 0.04
"""25 Hz, so that a late timer still gives the drive 20 commands a second."""


class RobotNode:
    """Safety node of one robot.

    Args:
        robot_id: This robot.
        settings: Its broker, files and waiting times.
        profile: Its body, and speeds of the drive.
        drive: Takes the gate's commands; must not block.
        navigate: Takes goals of iVeg; None: the robot takes none.

    Attributes:
        machine: Its safety machine, for reading.
        goals: Its goal and answers to goals, for reading.
        faults: Data faults that the next reports carry.
        asks_for_scans: Whether the reports ask iVeg for scans of peers.
    """

    def __init__(
        self,
        robot_id: str,
        settings: NodeSettings,
        *,
        profile: RobotProfile,
        drive: Callable[[Twist2D], None],
        navigate: Navigate | None = None,
    ) -> None:
        self._id, self._drive = robot_id, drive
        self._read_clock = settings.read_clock
        self._started = self._read_clock().mono
        self._on_peer_scan: Callable[[str, bytes], None] | None = None
        self.asks_for_scans = False
        self.faults: tuple[RobotFault, ...] = ()
        self.goals = RobotGoals(robot_id, navigate)
        self._command_topic = names.command_topic(settings.apikey, robot_id)
        self._desired_topic = names.DESIRED_TOPIC.format(robot_id=robot_id)
        self._is_replay = settings.replay is not None
        self._link = settings.open_link(settings.address, f"robot {robot_id}")
        self._subscribe()
        hold_file = settings.directory / f"{robot_id}.holds.json"
        self._lane = SafetyLane(
            partial(write_holds, hold_file), partial(self._link.publish, qos=1)
        )
        # R2: a STOP from before the restart is in force before anything can move.
        stored = read_holds(hold_file)
        if stored is None:
            _log.warning("%s: unreadable hold file, held: %s", robot_id, hold_file)
        boot = secrets.token_hex(4)
        self._uplink = Uplink(
            Sender(
                robot_id,
                settings.apikey,
                boot,
                first_report=1 + secrets.randbelow(2**31),
                replay=settings.replay,
            ),
            self._link.enqueue,
            None if self._is_replay else self._echoes,
        )
        self.machine = SafetyMachine(
            robot_id,
            boot,
            self._started,
            stored=stored,
            fresh=partial(secrets.token_hex, 8),
            limits=replace(settings.limits, profile=profile),
        )

    def _subscribe(self, **more: int) -> None:
        own = self._command_topic, self._desired_topic, names.FEEDBACK_FILTER
        topics = dict.fromkeys(own, 1) | more
        self._link.attach(topics, self._on_message, on_stored=self._on_stored)

    def _echoes(self, at: float) -> tuple[FeedbackRef, ...]:
        """Feedback that had come by a moment (s since boot)."""
        return self.machine.authors.echoes(self._started + at)

    # --- inputs -------------------------------------------------------------------

    async def run(self) -> None:
        """Run until cancelled; the drive is left at rest."""
        try:
            async with asyncio.TaskGroup() as tasks:
                for name, work in (
                    ("gate", every(_GATE_EVERY_S, self._tick)),
                    ("link", self._link.run()),
                    ("keep", self._lane.keep_forever()),
                    ("send", self._lane.send_forever()),
                ):
                    tasks.create_task(work, name=f"robot-{self._id}-{name}")
        finally:
            # Else the base would follow the last twist until its own time-out.
            self._drive(REST)

    def sense(self, *observations: Observation, age_s: float = 0.0) -> None:
        """Take observations of the robot's own sensors, measured ``age_s`` ago (s).

        Origins are filled in.
        """
        now = self._read_clock()
        mono = now.mono
        for observation in observations:
            match observation:
                case Odometry(pose=pose, twist=twist):
                    self._perform(self.machine.odometry(pose, twist, mono), mono)
                case Unplaced(twist=Twist2D() as twist):
                    self._perform(self.machine.odometry(None, twist, mono), mono)
                # A recorded laser saw the people of then, not those of now.
                case LaserScan() if not self._is_replay:
                    self._perform(self.machine.scan(observation, mono), mono)
                case Navigation(path=path):
                    self.machine.note_path(path, mono)
        if self._link.connected:
            own = self._own(now)
            for observation in observations:
                self._uplink.send(observation, own, age_s)

    def request_twist(self, twist: Twist2D) -> None:
        """Take upstream navigation's ``cmd_vel``; it expires after 0.5 s."""
        now = self._read_clock().mono
        self._perform(self.machine.request_twist(twist, now), now)

    def limit(self, factor: float, cause: str | None = None) -> None:
        """Limit the speed factor (0, 0.5 or 1) for the robot's own software.

        The limit applies in addition to iVeg's, never instead of it.
        """
        self.machine.limit(FREE if factor >= 1.0 else Cap(factor, "stale", cause))

    def on_peer_scan(self, take: Callable[[str, bytes], None]) -> None:
        """Pass topic and payload of peers' scans to ``take``; call before ``run``."""
        self._on_peer_scan = take
        self._subscribe(**{names.PEER_SCAN_FILTER: 0})

    def add_local_hold(self, source: Literal["hw", "bumper"]) -> None:
        """Hold the robot because its red button or bumper was pressed."""
        now = self._read_clock().mono
        self._perform(self.machine.local_hold(source, now), now)

    def release_locally(self) -> None:
        """Lift boot, button and bumper holds and resume, for the crew at the robot."""
        now = self._read_clock().mono
        self._perform(self.machine.release_locally(now), now)

    def _tick(self, _: float) -> None:
        now = self._read_clock().mono
        self._perform(self.machine.tick(now), now)

    def _on_message(self, topic: str, payload: bytes) -> None:
        now = self._read_clock().mono
        if topic == self._command_topic:
            order = read_goal(payload)
            if order is None:
                self._perform(self.machine.command(payload, now), now)
            else:
                # First: a link that is lost by now must hold the robot before a goal.
                self._perform(self.machine.tick(now), now)
                self._answer(*self.goals.answer(order, self._facts(now)))
        elif topic == self._desired_topic:
            self._perform(self.machine.desired(payload, now), now)
        elif self._on_peer_scan is not None and topic.endswith(names.PEER_SCAN_END):
            self._on_peer_scan(topic, payload)
        else:
            self._on_feedback(topic, payload, now)

    def _on_stored(self, topic: str, payload: bytes) -> None:
        """Take retained orders; retained feedback is old and counts as none."""
        if topic in (self._command_topic, self._desired_topic):
            self._on_message(topic, payload)

    def _on_feedback(self, topic: str, payload: bytes, now: float) -> None:
        try:
            feedback = read_feedback(payload)
        except UnreadableError:
            return  # R7: an unreadable message counts as silence for the watchdog.
        peer = topic.removeprefix("/").partition("/")[0]
        self._perform(self.machine.feedback(peer, feedback, now), now)
        self._uplink.rates.note_backlog(self.machine.authors.backlog_s(), now)

    # --- effects ------------------------------------------------------------------

    def _perform(self, effects: tuple[Effect, ...], now: float) -> None:
        for effect in effects:
            match effect:
                case Drive(twist):
                    self._drive(twist)
                case Persist(holds):
                    self._lane.persist(holds)
                case SendAnswer(answer):
                    self._answer(answer)
                case Report(report, is_measure):
                    self._report(report, is_measure=is_measure)
        # After the effects: a hold of this very call deletes the goal.
        if self.goals.goal is not None:
            self._answer(*self.goals.settle(self._facts(now)))

    def _facts(self, now: float) -> Facts:
        return Facts(
            self.machine.state(now) == "RUNNING",
            self.machine.challenge,
            now - self._started,
            self.machine.pose(now),
            self.machine.stands(now),
        )

    def _answer(self, *answers: CommandAnswer | GoalAnswer) -> None:
        for answer in answers:
            words = self._id, answer.result, answer.id or "", answer.why or ""
            _log.info("%s: answers %s %s %s", *words)
            own = self._own(self._read_clock())
            self._lane.answer(self._uplink.answer(answer, own))

    def _report(self, report: SafetyReport, *, is_measure: bool) -> None:
        now = self._read_clock()
        report = replace(report, faults=self.faults, peer_scans=self.asks_for_scans)
        own = self._own(now)
        seq, messages = self._uplink.report(report, own, is_measure=is_measure)
        self.machine.reported(seq, now.mono)
        for message in messages:
            self._lane.report(message)

    def _own(self, now: Instant) -> Instant:
        """This moment on the robot's own clocks: seconds since boot, and wall clock."""
        return Instant(now.mono - self._started, now.wall)
