"""The world as iVeg knows it: every robot with the age of everything about it.

``World.apply`` takes one observation; older ones and twins change nothing and are
counted.  Nothing here reads a clock: ages come from the ``now`` that is handed in.
"""

from collections import Counter
from collections.abc import Iterable
from math import inf

from iveg.domain.age import FeedbackLedger
from iveg.domain.errors import UnknownRobotError
from iveg.domain.feeds import Feeds
from iveg.domain.fleet import FleetDescription
from iveg.domain.geometry import Rectangle
from iveg.domain.limits import LIMITS
from iveg.domain.observations import (
    Climate,
    DetectionFrame,
    HeartbeatProbe,
    Instant,
    LaserScan,
    Observation,
    Odometry,
    Origin,
    Overtaken,
    Received,
    RefusedFrame,
    SafetyReport,
    kind_of,
)
from iveg.domain.plausibility import Plausibility
from iveg.domain.probe import ProbeLag
from iveg.domain.robot_state import RobotState
from iveg.domain.robot_updates import apply_newest, dated, learn_kind
from iveg.domain.stream_order import OrderVerdict
from iveg.domain.transports import FIWARE

_NO_MESSAGE = Climate, HeartbeatProbe, RefusedFrame
"""What is in no robot's stream of messages."""
_ASKED_AGE_S, _THINNED_AGE_S = LIMITS.late_s + 0.1, LIMITS.live_s + 0.1


class World:
    """All robots of the fleet and the air around them.

    Args:
        fleet: Its robots; ids alone are robots without a description.
        probe: Lag of FIWARE; without one FIWARE's lag is not used.
        bounds: Of the greenhouse; without them a robot may be anywhere.

    Attributes:
        returned_detectors: Whose detector a boot has put back in service, until read.
        ledger: When iVeg's own feedback was composed, which robots echo.
    """

    def __init__(
        self,
        fleet: FleetDescription | Iterable[str],
        probe: ProbeLag | None = None,
        bounds: Rectangle | None = None,
    ) -> None:
        self.ledger = FeedbackLedger()
        self._probe = probe
        if not isinstance(fleet, FleetDescription):
            fleet = FleetDescription.undescribed(fleet)
        self.robots = {
            robot_id: RobotState(robot_id, one)
            for robot_id, one in fleet.members.items()
        }
        self._plausibility = Plausibility(bounds, self.ledger, self.robots)
        self.climate: Climate | None = None
        self.climate_received: Instant | None = None
        self.counters: Counter[str] = Counter()
        self.feeds = Feeds()
        self.returned_detectors: list[str] = []

    def robot(self, robot_id: str) -> RobotState:
        """One robot.

        Raises:
            UnknownRobotError: not in the fleet.
        """
        try:
            return self.robots[robot_id]
        except KeyError:
            raise UnknownRobotError(robot_id) from None

    def is_past(
        self, robot_id: str, kind: type[Observation], boot: str, seq: int
    ) -> bool:
        """Whether the identity of a message shows that it is old or a twin."""
        robot = self.robots.get(robot_id)
        return robot is not None and robot.is_past(kind, boot, seq)

    def is_revoked(self, robot_id: str) -> bool:
        """Whether a robot is heard no more."""
        robot = self.robots.get(robot_id)
        return robot is not None and robot.revoked is not None

    def apply(self, received: Received) -> OrderVerdict:
        """Take one observation in.

        Returns:
            ``new`` when it became the state, else why it did not.

        Raises:
            UnknownRobotError: from a robot that is not in the fleet.
        """
        observation, at = received.observation, received.at
        if isinstance(observation, _NO_MESSAGE):
            return self._note(observation, at)
        robot = self.robot(observation.robot_id)
        origin = observation.origin
        if self.refuses(received):
            # What Orion kept may be of a time when the robot was a recording.
            robot.refused_at = robot.refused_at if received.asked else at.mono
            self.counters[f"{kind_of(observation).__name__}.refused"] += 1
            return "refused"
        learn_kind(robot, received, origin)
        verdict = robot.judge(received, origin, self.ledger.composed_at(origin.heard))
        if isinstance(observation, Overtaken) and verdict == "new":
            # Its stream was past it, and has since met sixteen other boots.
            verdict = "late"
        if not received.asked:
            verdict = self._fed(robot, received, origin, verdict)
        self.counters[f"{kind_of(observation).__name__}.{verdict}"] += 1
        if verdict == "duplicate" or (received.asked and origin.seq is None):
            return "duplicate"
        if not received.asked:
            self._hear(robot, origin, at)
        likely = self._likely_age(robot, received, origin)
        if isinstance(observation, DetectionFrame):
            seen_at = self._measured_at(origin, received, likely)
            if seen_at is None:
                # A person counts, though the age of the frame is not proven.
                seen_at = at.mono - (likely or 0.0)
            robot.sighted_at = dated(at, seen_at)
        if verdict == "new":
            self._doubt(robot, received)
            apply_newest(robot, received, self._measured_at(origin, received, likely))
        return verdict

    def _doubt(self, robot: RobotState, received: Received) -> None:
        """Note what contradicts the robot's state; recordings may jump as they like."""
        if robot.is_replay or received.asked:
            return
        for code in self._plausibility.contradictions(robot, received):
            robot.doubts.contradicted(code, received.at)
            self.counters[f"contradicted.{code}"] += 1

    def _hear(self, robot: RobotState, origin: Origin, at: Instant) -> None:
        """Note that a robot speaks; its next boot puts its detector back in service."""
        robot.heard_at = at.mono
        if robot.detector.meet_boot(origin.boot):
            self.returned_detectors.append(robot.robot_id)

    def _note(
        self, observation: Climate | HeartbeatProbe | RefusedFrame, at: Instant
    ) -> OrderVerdict:
        """Note what is in no stream."""
        match observation:
            case Climate():
                self.climate, self.climate_received = observation, at
            case RefusedFrame():
                detector = self.robot(observation.robot_id).detector
                detector.note_flaw("unreadable", at)
                self.counters["DetectionFrame.unreadable"] += 1
                return "refused"
        return "new"

    def refuses(self, received: Received) -> bool:
        """Whether a message calls itself a replay while its robot is live.

        Nothing of it counts: whoever plays it is not that robot.
        """
        observation = received.observation
        if observation.origin.replay is None:
            return False
        robot = self.robots.get(observation.robot_id)
        return robot is not None and not robot.is_replay

    def _likely_age(
        self, robot: RobotState, received: Received, origin: Origin
    ) -> float | None:
        """How old a message was when it came, by its stamp and our probe (s)."""
        at = received.at
        if received.asked:
            return _age_when_asked(origin, at)
        lag: float | None = 0.0
        if self._probe is not None:
            lag = self._probe.lag(at) if self._probe.is_known else None
        kind = kind_of(received.observation)
        return robot.clock.delay(kind, origin, at, received.transport, lag)

    def _measured_at(
        self, origin: Origin, received: Received, likely: float | None
    ) -> float | None:
        """The moment that a message was not measured before (monotonic, s).

        Of a robot that echoes only a proof counts.
        """
        now = received.at.mono
        moment = None if likely is None else now - likely
        if origin.acknowledgements:
            moment = self.ledger.composed_at(origin.heard)
        if moment is None:
            return None
        least = _THINNED_AGE_S if received.thinned else 0.0
        return min(moment, now - (_ASKED_AGE_S if received.asked else least))

    def age_then(self, received: Received) -> float:
        """How old the newest of its kind was at most when it came (s).

        Infinite where nobody knows, and for odometry whose age is only estimated: an
        estimate proves nothing.
        """
        moment = self._newest_at(received.observation)
        return inf if moment is None else max(0.0, received.at.mono - moment)

    def may_act(self, received: Received) -> bool:
        """Whether the newest of its kind may change anything of a STOP.

        Not what Orion kept, nor a replay of a live robot; of a robot that echoes no
        report or odometry of an earlier boot.  An answer names its order, and so is of
        no time before it.
        """
        if received.asked or self.refuses(received):
            return False
        observation = received.observation
        if not isinstance(observation, SafetyReport | Odometry):
            return True
        origin, proven_at = observation.origin, self._newest_at(observation)
        if not origin.acknowledgements:
            return True  # Its age is an estimate, which is judged where it matters.
        present_boot = self.robot(observation.robot_id).present_boot
        return not present_boot.is_past(origin.boot, proven_at)

    def _newest_at(self, observation: Observation) -> float | None:
        """The moment that the newest of this kind was not measured before."""
        if isinstance(observation, SafetyReport):
            reported = self.robot(observation.robot_id).safety_received
            return None if reported is None else reported.mono
        if isinstance(observation, Odometry):
            robot = self.robot(observation.robot_id)
            return robot.pose_at if robot.estimated_since is None else None
        return None

    def _fed(
        self,
        robot: RobotState,
        received: Received,
        origin: Origin,
        verdict: OrderVerdict,
    ) -> OrderVerdict:
        """Note which transport brought it; without a count the direct copy wins."""
        kind = kind_of(received.observation)
        if kind not in (Odometry, LaserScan):
            return verdict
        feed = self.feeds.of(robot.robot_id, kind)
        at, counted = received.at.mono, origin.seq is not None
        if received.transport == FIWARE.id and not counted and feed.is_direct(at):
            verdict = "duplicate"
        is_direct = received.transport != FIWARE.id
        abreast = is_direct and robot.is_newest(kind, origin)
        feed.heard(received.transport, at, news=verdict == "new" or abreast)
        return verdict

    def live_robots(self) -> Iterable[RobotState]:
        """Robots that are not recordings."""
        return (robot for robot in self.robots.values() if not robot.is_replay)


def _age_when_asked(origin: Origin, at: Instant) -> float:
    """How old Orion's answer is at least (s): nothing that was asked for looks live."""
    stamped = 0.0 if origin.stamp_s is None else at.wall - origin.stamp_s
    return max(stamped, _ASKED_AGE_S)
