"""A greenhouse on a virtual clock.

The emulator's world, the robots' own safety machines and iVeg's pipeline, without a
socket or a process.  Their messages are encoded and decoded by the codec, as on the
wire.  The same seed gives the same run on any machine, however busy it is.
"""

from collections.abc import Callable, Iterable, Sequence

from iveg.domain.feedback import Feedback
from iveg.domain.observations import Instant
from iveg.domain.peer_scan import PeerScan
from iveg.domain.witness import Plan
from iveg.lab.emulator.orders import FaultOrder
from iveg.lab.emulator.scripts import Incident
from iveg.lab.emulator.world import SimulatedWorld
from iveg.lab.experiment.staged_robot import STEP_S, Looked, StagedRobot
from iveg.ngsi import codec, names
from iveg.pipeline.ingest import Ingest
from iveg.pipeline.loop import RuleLoop


class Stage:
    """One scenario in steps of a twentieth of a second.

    Args:
        incidents: Its faults.
        feedback: Feedback that iVeg has published; it grows.
        move_clock: Advances the clock by seconds; returns the time.
        hear: Called with each message of a robot, from its creation on.
        looked, scan_every, plan, is_witness: As for ``StagedRobot``.
        peer_scans: Scans for peers that iVeg has published; it grows.

    Attributes:
        robots: Its robots, by id.
    """

    def __init__(
        self,
        world: SimulatedWorld,
        incidents: Iterable[Incident],
        ingest: Ingest,
        loop: RuleLoop,
        feedback: Sequence[Feedback],
        move_clock: Callable[[float], Instant],
        hear: Callable[[str, bytes], None],
        *,
        looked: Looked = lambda _: None,
        scan_every: int = 0,
        plan: Plan | None = None,
        peer_scans: Sequence[PeerScan] = (),
        is_witness: bool = True,
    ) -> None:
        self._world = world
        self._incidents = [(one.at_s, one.order) for one in incidents]
        self._ingest, self._loop, self._feedback = ingest, loop, feedback
        self._move_clock = move_clock
        self.now = move_clock(0.0)
        self.robots = {
            robot_id: StagedRobot(
                rig, self.now, hear, looked, scan_every, plan, is_witness=is_witness
            )
            for robot_id, rig in world.rigs.items()
        }
        self._scans = peer_scans
        self._delivered = 0
        self._scans_delivered = 0
        self._steps = 0

    def step(self) -> None:
        """Advance everything by a twentieth of a second."""
        number = self._steps
        self._steps += 1
        self.now = self._move_clock(round(self._steps * STEP_S, 6))
        for at_s, order in self._incidents:
            if number == round(at_s / STEP_S):
                self.happen(order)
        self._world.walk(STEP_S)
        for robot in self.robots.values():
            robot.step(number, self._world, self.now)
        self._loop.step(self._ingest.drain(), self.now)
        self._deliver()

    def happen(self, order: FaultOrder) -> None:
        """Inject a fault into a robot, or end it."""
        self.robots[order.robot].obey(order)

    def _deliver(self) -> None:
        """Deliver new feedback and scans to every robot."""
        new = self._feedback[self._delivered :]
        self._delivered += len(new)
        for feedback in new:
            payload = codec.write_feedback(feedback)
            for robot in self.robots.values():
                robot.listen(feedback.robot_id, payload, self.now)
        scans = self._scans[self._scans_delivered :]
        self._scans_delivered += len(scans)
        for scan in scans:
            topic = names.PEER_SCAN_TOPIC.format(robot_id=scan.robot_id)
            for robot in self.robots.values():
                robot.listen_to_scan(topic, codec.write_peer_scan(scan))
