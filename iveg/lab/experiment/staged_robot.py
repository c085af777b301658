"""One robot on a virtual clock, with its safety machine."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import count
from typing import Final

from iveg.domain.costmap import InflatedGrid
from iveg.domain.geometry import REST
from iveg.domain.observations import Instant
from iveg.domain.witness import Outline, Plan
from iveg.lab.emulator.orders import FaultOrder
from iveg.lab.emulator.truth import Driving
from iveg.lab.emulator.world import RobotHardware, SimulatedWorld
from iveg.ngsi import codec
from iveg.robot.costmap import FleetCostmap
from iveg.robot.echo import Echo
from iveg.robot.effects import Drive, Effect, Report, SendAnswer
from iveg.robot.holds import HoldSet
from iveg.robot.judgement import Limits
from iveg.robot.neighbours import Neighbours
from iveg.robot.safety import SafetyMachine
from iveg.robot.uplink import Uplink

STEP_S: Final = 0.05


_LOOK_EVERY, _NAVIGATION_EVERY = 2, 20
"""Steps between two camera frames, the first once all odometry was sent, and between
two messages of navigation."""


Looked = Callable[[RobotHardware], None]


class StagedRobot:
    """One rig with its safety machine, whose effects are executed at once.

    Args:
        hear: Called with the topic and payload of its messages.
        looked: Called when its camera has taken a picture.
        scan_every: Steps between two sweeps of its laser; 0: none.
        plan: What stands in the greenhouse.
        is_witness: Its own software reads its laser, too.

    Attributes:
        costmap: Its picture of the fleet; None: it asks for no scans of peers.
    """

    def __init__(
        self,
        rig: RobotHardware,
        now: Instant,
        hear: Callable[[str, bytes], None],
        looked: Looked = lambda _: None,
        scan_every: int = 0,
        plan: Plan | None = None,
        *,
        is_witness: bool = True,
    ) -> None:
        texts = count(1)
        self._faults = FaultOrder(robot=rig.robot_id)
        self._rig = rig
        self._hear = hear
        self._looked = looked
        self._scan_every = scan_every
        self._is_witness = is_witness
        self.costmap: FleetCostmap | None = None
        self._wanted = 0.0
        self._neighbours = Neighbours(rig.robot_id)
        self._echo = Echo()
        self._uplink = Uplink(rig.robot_id, "iveg", "b1", self._say, echo=self._echo)
        self._machine = SafetyMachine(
            rig.robot_id,
            "b1",
            now.mono,
            stored=HoldSet(),
            fresh=lambda: f"{rig.robot_id}-{next(texts)}",
            limits=Limits(
                rig.profile.max_speed,
                rig.profile.max_turn,
                outline=Outline(rig.profile.length, rig.profile.width),
                plan=plan,
                braking=rig.profile.braking,
            ),
        )
        self._perform(self._machine.release_locally(now.mono), now)

    def step(self, number: int, world: SimulatedWorld, now: Instant) -> None:
        """Navigate, drive, sense."""
        into_run = number * STEP_S
        free = self._machine.may_drive
        requested = self._rig.requested_twist(into_run, world) if free else REST
        self._wanted = abs(requested.linear_x)
        self._perform(self._machine.request_twist(requested, now.mono), now)
        if self._faults.deaf and free:
            self._rig.drive(requested)
        self._rig.move(STEP_S)
        moved = self._rig.odometry()
        self._perform(self._machine.odometry(moved.pose, moved.twist, now.mono), now)
        now = self._dated(now)
        self._uplink.send(moved, now)
        if self._scan_every and number % self._scan_every == 0:
            scan = self._rig.scan(world)
            if self._is_witness:
                self._perform(self._machine.scan(scan, now.mono), now)
            self._uplink.send(scan, now)
        if number % _LOOK_EVERY == 1:
            self._uplink.send(self._rig.detect(into_run, world), now)
            self._looked(self._rig)
        if number % _NAVIGATION_EVERY == 0:
            intent = self._rig.navigation()
            self._machine.note_path(intent.path, now.mono)
            self._uplink.send(intent, now)

    def _dated(self, now: Instant) -> Instant:
        """Readings of its own clocks."""
        return Instant(now.mono, now.wall + (self._faults.clock_offset_s or 0.0))

    def obey(self, order: FaultOrder) -> None:
        """Take faults of camera and navigation, ``mute``, ``deaf``, ``clock_offset_s``.

        A mute robot's messages do not arrive; a deaf one ignores iVeg's speed limits,
        but not holds.
        """
        self._faults = self._faults.changed_by(order)
        self._rig.obey(order)

    def listen(self, topic: str, payload: bytes, now: Instant) -> None:
        """Take iVeg's feedback to a robot of the fleet."""
        feedback = codec.read_feedback(payload)
        self._echo.note(feedback.origin)
        self._neighbours.note(topic, feedback, now.mono)
        if self.costmap is not None:
            self.costmap.note(feedback)
        self._perform(self._machine.feedback(topic, feedback, now.mono), now)

    def order(self, payload: bytes, now: Instant) -> None:
        """Take an order that iVeg sends to this robot."""
        self._perform(self._machine.command(payload, now.mono), now)

    def listen_to_scan(self, topic: str, payload: bytes) -> None:
        """Take a scan of a peer, where it asked for those."""
        if self.costmap is not None:
            self.costmap.hear(topic, payload, self._rig.odometry().pose)

    def believe(self, now: Instant) -> InflatedGrid | None:
        """Its costmap as it stands; None: it has none."""
        if self.costmap is None:
            return None
        own = self._rig.odometry().pose
        present = self._neighbours.present(own, now.mono)
        return self.costmap.draw(self.costmap.drain_scans(), present, own, now.mono)

    @property
    def speed(self) -> float:
        """True speed (m/s)."""
        return abs(self._rig.vehicle.twist.linear_x)

    @property
    def driving(self) -> Driving:
        """How it may drive now."""
        factor = self._machine.cap.factor if self._machine.may_drive else 0.0
        return Driving(self._wanted, factor)

    def _perform(self, effects: Sequence[Effect], now: Instant) -> None:
        for effect in effects:
            match effect:
                case Drive(twist):
                    self._rig.drive(twist)
                case Report(report):
                    report = replace(report, peer_scans=self.costmap is not None)
                    seq, (_, message) = self._uplink.report(report, self._dated(now))
                    self._machine.reported(seq, now.mono)
                    self._say(message.topic, message.payload)
                case SendAnswer(answer):
                    message = self._uplink.answer(answer, self._dated(now))
                    self._say(message.topic, message.payload)

    def _say(self, topic: str, payload: bytes) -> None:
        if not self._faults.mute:
            self._hear(topic, payload)
