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
from iveg.domain.goals import Goal
from iveg.domain.limits import LIMITS
from iveg.domain.observations import (
    CommandAnswer,
    FeedbackRef,
    GoalAnswer,
    Hold,
    Instant,
    LaserScan,
    Navigation,
    Observation,
    Odometry,
    RobotFault,
    SafetyReport,
    Unplaced,
)
from iveg.domain.witness import Outline, Plan
from iveg.ngsi import names
from iveg.ngsi.codec import read_feedback
from iveg.robot.gate import FREE, Cap
from iveg.robot.goals import Facts, Navigate, RobotGoals, read_goal
from iveg.robot.holds import read_holds, write_holds
from iveg.robot.judgement import Limits, OnLinkLoss
from iveg.robot.orders import Drive, Effect, Persist, Report, SendAnswer
from iveg.robot.safety import SafetyMachine, State
from iveg.robot.uplink import Origins, SafetyLane, Uplink

# --- pacing -----------------------------------------------------------------------
#
# Periodic calls.

SLOTS = 3
"""A robot's period has one each for drive and odometry, laser, camera."""
LONGEST_STEP_S = 0.1
"""Longest time step (s), so that a suspended machine moves no robot by a jump."""


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
        directory: Where the holds of each robot survive a loss of power.
        slow_s: Feedback older than this halves the speed (s).
        stand_s: Feedback older than this stops the robot (s).
        on_link_loss: ``slow``: it goes on at half speed instead.
        plan: What stands in the greenhouse; None: nobody drew it.
        replay: It plays a recording, which is in this map frame: its messages are
            marked, and echo no feedback, since their content was measured long ago.
        read_clock: The robot's own clocks.
        open_link: Opens its link to the broker.
    """

    address: BrokerAddress
    apikey: str
    directory: Path
    slow_s: float = LIMITS.feedback_slow_s
    stand_s: float = LIMITS.feedback_stand_s
    on_link_loss: OnLinkLoss = "stop"
    plan: Plan | None = None
    replay: str | None = None
    read_clock: Callable[[], Instant] = clock.now
    open_link: Callable[[BrokerAddress, str], MqttLink] = MqttLink


# --- node -------------------------------------------------------------------------
#
# Safety software of one robot: executes the effects of the safety machine.
#
# It is the only publisher to the drive. Effects are executed where they arise, the zero
# command first; disk and broker have a queue of their own and are never waited for.

_log = logging.getLogger(__name__)
_GATE_EVERY_S = 0.04
"""25 Hz, so that a late timer still gives the drive its 20."""


class RobotNode:
    """Safety node of one robot.

    Args:
        robot_id: This robot.
        settings: Its broker, files and waiting times.
        profile: Its body, and speeds of the drive.
        drive: Takes what the gate lets through; must not block.
        navigate: Takes goals of iVeg; None: the robot takes none.

    Attributes:
        machine: Its safety machine, for reading.
        faults: Data faults that the next reports carry.
        asks_for_scans: Whether they ask iVeg for scans of peers.
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
        self._goals = RobotGoals(robot_id, navigate)
        self._command_topic = names.command_topic(settings.apikey, robot_id)
        self._desired_topic = names.DESIRED_TOPIC.format(robot_id=robot_id)
        self._is_replay = settings.replay is not None
        self._link = settings.open_link(settings.address, f"robot {robot_id}")
        self._subscribe()
        hold_file = settings.directory / f"{robot_id}.holds.json"
        self._lane = SafetyLane(
            partial(write_holds, hold_file), partial(self._link.publish, qos=1)
        )
        stored = read_holds(hold_file)
        if stored is None:
            _log.warning("%s: unreadable hold file, held: %s", robot_id, hold_file)
        boot = secrets.token_hex(4)
        origins = Origins(
            boot,
            1 + secrets.randbelow(2**31),
            echoes=None if self._is_replay else self._echoes,
            replay=settings.replay,
        )
        self._uplink = Uplink(robot_id, settings.apikey, origins, self._link.enqueue)
        self.machine = SafetyMachine(
            robot_id,
            boot,
            self._started,
            stored=stored,
            fresh=partial(secrets.token_hex, 8),
            limits=Limits(
                profile.max_speed,
                profile.max_turn,
                settings.slow_s,
                settings.stand_s,
                settings.on_link_loss,
                Outline(profile.length, profile.width),
                settings.plan,
                profile.braking,
            ),
        )

    def _subscribe(self, **more: int) -> None:
        own = self._command_topic, self._desired_topic, names.FEEDBACK_FILTER
        topics = dict.fromkeys(own, 1) | more
        self._link.attach(topics, self._on_message, on_stored=self._on_stored)

    def _echoes(self) -> tuple[FeedbackRef, ...]:
        return self.machine.authors.echoes(self._read_clock().mono)

    # --- state for upstream -------------------------------------------------------

    @property
    def state(self) -> State:
        """State of the safety machine."""
        return self.machine.state(self._read_clock().mono)

    @property
    def holds(self) -> tuple[Hold, ...]:
        """Holds of the robot."""
        return self.machine.holds.holds

    @property
    def may_drive(self) -> bool:
        """Whether upstream twists have effect; if not, upstream should request zero.

        After a resume the robot moves only once upstream has requested zero, or sent no
        twist at all, for 0.5 s.
        """
        return self.machine.may_drive

    @property
    def goal(self) -> Goal | None:
        """Where it was sent; None: wherever its own work takes it."""
        return self._goals.goal

    @property
    def speed_factor(self) -> float:
        """Speed factor of the gate, holds excepted."""
        return self.machine.cap.factor

    @property
    def connected(self) -> bool:
        """Whether the broker is connected."""
        return self._link.connected

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
            self._drive(REST)

    def sense(self, *observations: Observation) -> None:
        """Take observations of the robot's own sensors; origins are filled in."""
        now = self._read_clock()
        mono = now.mono
        for observation in observations:
            if isinstance(observation, Odometry):
                self._perform(
                    self.machine.odometry(observation.pose, observation.twist, mono),
                    mono,
                )
            elif isinstance(observation, LaserScan) and not self._is_replay:
                self._perform(self.machine.scan(observation, mono), mono)
            elif isinstance(observation, Navigation):
                self.machine.note_path(observation.path, mono)
            elif isinstance(observation, Unplaced) and observation.twist is not None:
                self._perform(
                    self.machine.odometry(None, observation.twist, mono), mono
                )
        if self._link.connected:
            own = self._own(now)
            for observation in observations:
                self._uplink.send(observation, own)

    def request_twist(self, twist: Twist2D) -> None:
        """Take upstream navigation's ``cmd_vel``; it expires after 0.5 s."""
        now = self._read_clock().mono
        self._perform(self.machine.request_twist(twist, now), now)

    def limit(self, factor: float, cause: str | None = None) -> None:
        """Limit the speed factor (0, 0.5 or 1) for the robot's own software.

        The limit applies in addition to iVeg's, never instead of it.
        """
        self.machine.limit(FREE if factor >= 1.0 else Cap(factor, "stale", cause))

    def hear_peer_scans(self, on_scan: Callable[[str, bytes], None]) -> None:
        """Hand on scans of peers as they come, by topic; call it before ``run``."""
        self._on_peer_scan = on_scan
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
                # First what the machine knows by now: the link may have just been lost.
                self._perform(self.machine.tick(now), now)
                self._answer(*self._goals.answer(order, self._facts(now)))
        elif topic == self._desired_topic:
            self._perform(self.machine.desired(payload, now), now)
        elif self._on_peer_scan is not None and topic.endswith(names.PEER_SCAN_END):
            self._on_peer_scan(topic, payload)
        else:
            self._on_feedback(topic, payload, now)

    def _on_stored(self, topic: str, payload: bytes) -> None:
        """Take orders that the broker retained; feedback of the past is none."""
        if topic in (self._command_topic, self._desired_topic):
            self._on_message(topic, payload)

    def _on_feedback(self, topic: str, payload: bytes, now: float) -> None:
        try:
            feedback = read_feedback(payload)
        except UnreadableError:
            return  # Counts as no feedback: the watchdog does the rest.
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
        if self._goals.goal is not None:
            self._answer(*self._goals.settle(self._facts(now)))

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
            _log.info("%s: %s %s %s", *words)
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
