"""The world as iVeg knows it: every robot, with the age of its data.

``World.apply`` takes one observation; late ones and copies change nothing and are
counted.  Nothing here reads a clock: ages are measured from the argument ``now``.
Beside it are the ledger of feedback, whose echoes prove ages, the contradictions with
physics, and the feedback of other servers.
"""

from bisect import bisect_right
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import inf
from typing import Literal

from iveg.domain.detector import WordAnswers
from iveg.domain.errors import UnknownRobotError
from iveg.domain.fleet import FleetDescription, RobotDescription
from iveg.domain.frames import is_pose_frame
from iveg.domain.geometry import Rectangle, Twist2D
from iveg.domain.limits import LIMITS
from iveg.domain.motion import LASTED_S
from iveg.domain.observations import (
    Climate,
    DetectionFrame,
    FeedbackRef,
    HeartbeatProbe,
    Instant,
    LaserScan,
    Observation,
    Odometry,
    Origin,
    Received,
    RefusedFrame,
    SafetyReport,
    kind_of,
)
from iveg.domain.probe import ProbeLag
from iveg.domain.robot_state import (
    RobotState,
    dated,
    learn_kind,
    note_motion,
    store,
)
from iveg.domain.stream_order import Freshness
from iveg.domain.transports import FIWARE

# --- proven age -------------------------------------------------------------------
#
# Robots name in every message the newest feedback that they have received.  The message
# was measured after that feedback left iVeg.  So it is at most as old as the feedback
# is now, on iVeg's own monotonic clock, without a clock of the robot or a guessed delay
# (docs/safety.md, "Age").

_APART_S = 0.05
"""Closer moments share the earlier moment, which makes ages greater (s)."""
_MOST_KEPT = 36_000
"""Number at which the older half is dropped: fifteen minutes at least."""


class FeedbackLedger:
    """Times at which feedback messages were composed."""

    def __init__(self) -> None:
        self._boot: str | None = None
        self._firsts: list[int] = []
        """First count at each of the moments."""
        self._moments: list[float] = []
        self._last = -1
        """Newest count that was composed."""

    def composed(self, boot: str, first: int, last: int, now: float) -> None:
        """Record that feedback ``first`` to ``last`` is composed now (monotonic, s)."""
        self._boot, self._last = boot, last
        if self._moments and now - self._moments[-1] < _APART_S:
            return
        self._firsts.append(first)
        self._moments.append(now)
        if len(self._moments) > _MOST_KEPT:
            del self._firsts[: _MOST_KEPT // 2], self._moments[: _MOST_KEPT // 2]

    def is_sent(self, echo: FeedbackRef) -> bool:
        """Whether this run of iVeg has sent that feedback."""
        # A count above ours is forged or of another server: it proves nothing.
        return echo.boot == self._boot and echo.seq <= self._last

    def composed_at(self, *echoes: FeedbackRef) -> float | None:
        """Lower bound of the time at which the newest was composed (monotonic, s).

        None: all are of other authors, were never sent, or are forgotten.
        """
        counts = [echo.seq for echo in echoes if self.is_sent(echo)]
        index = bisect_right(self._firsts, max(counts, default=-1)) - 1
        return None if index < 0 else self._moments[index]


_DIRECT_FRESH_S = 1.0
"""Time after a direct message in which Orion's is taken for its copy (s)."""

# --- contradictions ---------------------------------------------------------------
#
# Whether an observation can be true: by physics, and by earlier observations of the
# robot.  Only new messages are compared, and the longer of the robot's time and ours
# counts, so that lateness and reordering are no contradictions.  docs/safety.md,
# "Doubt", has the table.

Code = Literal["pose_outside", "too_fast", "jumped"]
"""Contradictions, beside those of :mod:`~iveg.domain.motion`."""

ANY_ROBOT_M_S, ANY_ROBOT_RAD_S = 10.0, 10.0
"""Bounds of a robot without description: faster than any robot in a greenhouse."""
_SPEED_SHARE, _SPEED_M_S = 1.25, 0.25
"""Overshoot of a drive over its greatest speed, and noise of odometry (1, m/s)."""
_TURN_SHARE, _TURN_RAD_S = 1.5, 0.5
"""Likewise for the turn rate (1, rad/s)."""
_JUMP_M = 0.5
"""Bound of the corrections of a localisation (m)."""
_ANCHOR_S = 1.0
"""Time over which poses are compared, so that many small steps add up (s)."""
_MOST_DELAY_S = 10.0
"""Greatest difference of two delays; a clock that shows more was set (s)."""


@dataclass(frozen=True, slots=True)
class _Anchor:
    """Odometry that later poses are compared with; ``at``: arrival (monotonic, s)."""

    odometry: Odometry
    at: float

    def passed_s(self, later: Origin, now: float) -> float:
        """Greatest time between the measurements of this and ``later`` (s)."""
        earlier, arrived_s = self.odometry.origin, now - self.at
        longest_s = arrived_s + _MOST_DELAY_S
        if earlier.seq is None or later.seq is None:
            return longest_s  # Without a count messages may come in any order.
        own_s = _own_s_between(earlier, later)
        return arrived_s if own_s is None else max(arrived_s, min(own_s, longest_s))


class Plausibility:
    """Judge of the observations of a fleet's robots.

    Args:
        bounds: The area in which robots may be, in ``map``; None: unknown.
    """

    def __init__(self, bounds: Rectangle | None) -> None:
        self._bounds = bounds
        self._anchors: dict[str, _Anchor] = {}

    def contradictions(self, robot: RobotState, received: Received) -> Iterator[Code]:
        """Codes of the contradictions of a new message with the state before it."""
        description = robot.description
        match received.observation:
            case Odometry() as odometry:
                bounds, pose = self._bounds, odometry.pose
                if bounds is not None and not bounds.contains(pose.x, pose.y):
                    yield "pose_outside"
                if _is_too_fast(description, odometry.twist):
                    yield "too_fast"
                if self._has_jumped(description, odometry, received.at.mono):
                    yield "jumped"
            case SafetyReport(linear=linear, angular=angular):
                if _is_too_fast(description, Twist2D(linear, angular)):
                    yield "too_fast"

    def _has_jumped(
        self, robot: RobotDescription, odometry: Odometry, at: float
    ) -> bool:
        """Whether it cannot have driven here from an earlier pose of this boot."""
        anchor, pose = self._anchors.get(odometry.robot_id), odometry.pose
        if anchor is None or anchor.odometry.origin.boot != odometry.origin.boot:
            self._anchors[odometry.robot_id] = _Anchor(odometry, at)
            return False
        reach_m = (
            _greatest_speed(robot) * anchor.passed_s(odometry.origin, at) + _JUMP_M
        )
        jumped = anchor.odometry.pose.distance_to(pose.x, pose.y) > reach_m
        # After a jump the new place is believed: a relocalisation jumps only once.
        if jumped or at - anchor.at >= _ANCHOR_S:
            self._anchors[odometry.robot_id] = _Anchor(odometry, at)
        return jumped


def _is_too_fast(robot: RobotDescription, twist: Twist2D) -> bool:
    turn = ANY_ROBOT_RAD_S
    if robot.is_described:
        turn = _TURN_SHARE * robot.profile.max_turn + _TURN_RAD_S
    return abs(twist.linear_x) > _greatest_speed(robot) or abs(twist.angular_z) > turn


def _greatest_speed(robot: RobotDescription) -> float:
    """Greatest speed of such a robot, noise included (m/s)."""
    if not robot.is_described:
        return ANY_ROBOT_M_S
    return _SPEED_SHARE * robot.profile.max_speed + _SPEED_M_S


def _own_s_between(earlier: Origin, later: Origin) -> float | None:
    """Time between two messages on the robot's own clock (s); None: unknown."""
    if (earlier.mono is None) != (later.mono is None):
        return None
    earlier_s, now = earlier.own_s, later.own_s
    return None if earlier_s is None or now is None else now - earlier_s


# --- other servers ----------------------------------------------------------------
#
# A robot that keeps receiving new feedback from elsewhere has a second author.  An
# earlier run of this iVeg sends nothing new, so it is none.  One robot's report is
# enough, since it slows nobody and frees nobody.

SPOKEN_FOR_S = 3.0
"""Least time that an author goes on (s): our earlier run may end after our start."""


@dataclass(frozen=True, slots=True)
class _OtherFeedback:
    """Feedback of other authors that one robot receives.

    Attributes:
        counts: Boot of an author → its newest count.
        began: First report of any (monotonic, s).
        newest: Last report of anything new (monotonic, s).
    """

    counts: dict[str, int]
    began: float
    newest: float


class OtherAuthors:
    """Authors of feedback beside this iVeg; ``ledger`` has its own feedback."""

    def __init__(self, ledger: FeedbackLedger) -> None:
        self._ledger = ledger
        self._received: dict[str, _OtherFeedback] = {}

    def note(
        self, robot_id: str, origin: Origin, at: Instant, *, is_direct: bool
    ) -> None:
        """Take the echoes of a robot, but for those that may precede our start."""
        proven_at = self._ledger.composed_at(*origin.echoes)
        if not is_direct and (proven_at is None or at.mono - proven_at > LIMITS.late_s):
            return
        sent_echoes = [echo for echo in origin.echoes if self._ledger.is_sent(echo)]
        # A second count in our own name is another's.
        newest = max(sent_echoes, key=lambda echo: echo.seq, default=None)
        counts = {echo.boot: echo.seq for echo in origin.echoes if echo != newest}
        before = self._received.get(robot_id)
        if not counts:
            self._received.pop(robot_id, None)
        elif before is None:
            self._received[robot_id] = _OtherFeedback(counts, at.mono, at.mono)
        elif any(seq > before.counts.get(boot, -1) for boot, seq in counts.items()):
            self._received[robot_id] = _OtherFeedback(counts, before.began, at.mono)

    def speaking(self, now: Instant) -> list[str]:
        """Boots of authors that went on for 3 s and spoke within the last 10 s."""
        return sorted(
            {
                boot
                for feedback in self._received.values()
                if feedback.newest - feedback.began >= SPOKEN_FOR_S
                and now.mono - feedback.newest <= LIMITS.zone_lasts_s
                for boot in feedback.counts
            }
        )


# --- the world --------------------------------------------------------------------

_UNORDERED = Climate, HeartbeatProbe, RefusedFrame
"""Observations that belong to no robot's stream of messages."""
_ANSWER_AGE_S = LIMITS.late_s + 0.1
"""Least age of Orion's answer to a query (s): it never looks live or late, but lost."""


class World:
    """All robots of the fleet and the air around them.

    Args:
        fleet: Its robots; ids alone are robots without a description.
        probe: Lag of FIWARE; None: the lag is not used.
        bounds: Area in which robots may be, in ``map``; None: anywhere.

    Attributes:
        robots: State of each robot, by id.
        climate: Newest air of the greenhouse; ``climate_received``: its arrival.
        counters: Number of messages by kind and freshness, and of contradictions.
        returned_detectors: Robots whose boot put their detector back in service, until
            they are read.
        word_answers: Answers of operators about words of detectors.
        ledger: Times at which iVeg's own feedback was composed.
        other_authors: Other servers whose feedback robots echo.
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
            robot_id: RobotState(robot_id, description)
            for robot_id, description in fleet.members.items()
        }
        self._plausibility = Plausibility(bounds)
        self.other_authors = OtherAuthors(self.ledger)
        self.climate: Climate | None = None
        self.climate_received: Instant | None = None
        self.counters: Counter[str] = Counter()
        self._direct_at: dict[tuple[str, type[Observation]], float] = {}
        """Arrival of the newest direct message by robot and kind (monotonic, s)."""
        self.returned_detectors: list[str] = []
        self.word_answers = WordAnswers(self.robots)

    def robot(self, robot_id: str) -> RobotState:
        """One robot.

        Raises:
            UnknownRobotError: not in the fleet.
        """
        try:
            return self.robots[robot_id]
        except KeyError:
            raise UnknownRobotError(robot_id) from None

    def is_refused(self, robot_id: str) -> bool:
        """Whether a setting says that a robot is ignored."""
        robot = self.robots.get(robot_id)
        return robot is not None and robot.refused

    def misplaced(self, observation: Observation) -> str | None:
        """Frame of odometry that is not its robot's pose frame; None: it fits."""
        frame = observation.frame_id if isinstance(observation, Odometry) else None
        if frame is None or is_pose_frame(
            frame, self.robot(observation.robot_id).description
        ):
            return None
        return frame

    def apply(self, received: Received) -> Freshness:
        """Take one observation.

        Returns:
            ``new`` when it became the state, else its other freshness.

        Raises:
            UnknownRobotError: from a robot that is not in the fleet.
        """
        observation, at = received.observation, received.at
        if isinstance(observation, _UNORDERED):
            return self._note_unordered(observation, at)
        robot = self.robot(observation.robot_id)
        origin = observation.origin
        if self.refuses(received):
            # Orion's answer may be from a time when the robot was a recording.
            robot.refused_at = robot.refused_at if received.is_query_answer else at.mono
            self.counters[f"{kind_of(observation).__name__}.refused"] += 1
            return "refused"
        if received.is_query_answer:
            return self._restore(robot, received)
        if received.alone:
            # It may be retained and of any age: it protects, but changes no state.
            robot.sighted_at = at
            return "late"
        learn_kind(robot, received, origin)
        proven_at = self.ledger.composed_at(*origin.echoes)
        freshness = robot.judge(received, origin, proven_at)
        freshness = self._without_copies(received, freshness)
        self.counters[f"{kind_of(observation).__name__}.{freshness}"] += 1
        if freshness == "duplicate":
            return "duplicate"
        # The robot's next boot puts its detector back in service.
        if robot.detector.meet_boot(origin.boot):
            self.returned_detectors.append(robot.robot_id)
        likely = self._likely_age(robot, received, origin)
        moment = _measured_at(origin, at, likely, proven_at)
        if isinstance(observation, DetectionFrame):
            # A person counts even if the age of the frame is not proven.
            seen_at = at.mono - (likely or 0.0) if moment is None else moment
            robot.sighted_at = dated(at, seen_at)
        if freshness == "new":
            self._take(robot, received, moment)
        return freshness

    def _restore(self, robot: RobotState, received: Received) -> Freshness:
        """Store Orion's answer to a query where it is newer than all that is known.

        It is of any time: it shows no motion, contradicts nothing and is never live.
        """
        observation, at = received.observation, received.at
        origin = observation.origin
        proven_at = self.ledger.composed_at(*origin.echoes)
        if origin.seq is None or robot.judge(received, origin, proven_at) != "new":
            return "duplicate"
        self.counters[f"{kind_of(observation).__name__}.stored"] += 1
        stamped_s = 0.0 if origin.stamp_s is None else at.wall - origin.stamp_s
        likely = at.later(-max(stamped_s, _ANSWER_AGE_S))
        moment = proven_at if origin.acknowledgements else likely.mono
        if isinstance(observation, DetectionFrame):
            robot.sighted_at = likely
        store(robot, received, None if moment is None else min(moment, likely.mono))
        return "stored"

    def _take(
        self, robot: RobotState, received: Received, moment: float | None
    ) -> None:
        """Store the newest observation of its kind, and note its contradictions."""
        observation, at = received.observation, received.at
        self.other_authors.note(
            robot.robot_id,
            observation.origin,
            at,
            is_direct=received.transport != FIWARE.id,
        )
        # Before it is stored, since it is compared with the state before it.
        # A recording may jump when it begins anew.
        if not robot.is_replay:
            for code in self._plausibility.contradictions(robot, received):
                self._doubt(robot, code, at)
        store(robot, received, moment)
        note_motion(robot, observation, at, moment)
        moved = robot.motion(at).contradiction
        if not robot.is_replay and moved and isinstance(observation, Odometry):
            self._doubt(robot, moved, at, LASTED_S)

    def _doubt(
        self, robot: RobotState, code: str, at: Instant, lasted_s: float = 0.0
    ) -> None:
        """Note a contradiction of a robot with itself or physics."""
        robot.doubts.contradicted(code, at, lasted_s)
        self.counters[f"contradicted.{code}"] += 1

    def _note_unordered(
        self, observation: Climate | HeartbeatProbe | RefusedFrame, at: Instant
    ) -> Freshness:
        """Note an observation that belongs to no stream."""
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

        Such a message does not count: its sender is not that robot.
        """
        observation = received.observation
        if observation.origin.replay is None:
            return False
        robot = self.robots.get(observation.robot_id)
        return robot is not None and not robot.is_replay

    def _likely_age(
        self, robot: RobotState, received: Received, origin: Origin
    ) -> float | None:
        """Age of a message on arrival by its stamp and our probe (s); None: unknown."""
        at = received.at
        lag: float | None = 0.0
        if self._probe is not None:
            lag = self._probe.lag(at) if self._probe.is_known else None
        return robot.clock.delay(
            kind_of(received.observation), origin, at, received.transport, lag
        )

    def age_then(self, received: Received) -> float:
        """Greatest age of the newest of its kind on arrival (s).

        Infinite if that is unknown, or for odometry of estimated age: an estimate
        proves nothing.
        """
        moment = self._newest_at(received.observation)
        return inf if moment is None else max(0.0, received.at.mono - moment)

    def may_act(self, received: Received) -> bool:
        """Whether the newest of its kind may act on a STOP.

        From a robot that echoes, no report or odometry of an earlier boot may.  An
        answer of the robot names its order, so it cannot be older than that.
        """
        observation = received.observation
        if not isinstance(observation, SafetyReport | Odometry):
            return True
        origin, proven_at = observation.origin, self._newest_at(observation)
        if not origin.acknowledgements:
            return True  # Its age is an estimate; the STOP machine judges that.
        present_boot = self.robot(observation.robot_id).present_boot
        return not present_boot.is_past(origin.boot, proven_at)

    def _newest_at(self, observation: Observation) -> float | None:
        """Lower bound of the newest report's or odometry's time (monotonic, s)."""
        if isinstance(observation, SafetyReport):
            reported = self.robot(observation.robot_id).safety_received
            return None if reported is None else reported.mono
        if isinstance(observation, Odometry):
            robot = self.robot(observation.robot_id)
            return robot.pose_at if robot.estimated_since is None else None
        return None

    def _without_copies(self, received: Received, freshness: Freshness) -> Freshness:
        """The freshness; ``duplicate``: Orion's copy of an uncounted direct message."""
        observation, at = received.observation, received.at.mono
        key = observation.robot_id, kind_of(observation)
        if key[1] not in (Odometry, LaserScan):
            return freshness
        if received.transport != FIWARE.id:
            self._direct_at[key] = at
        elif observation.origin.seq is None:
            direct_at = self._direct_at.get(key, -inf)
            return "duplicate" if at - direct_at <= _DIRECT_FRESH_S else freshness
        return freshness

    def live_robots(self) -> Iterable[RobotState]:
        """All robots but recordings."""
        return (robot for robot in self.robots.values() if not robot.is_replay)


def _measured_at(
    origin: Origin, at: Instant, likely: float | None, proven_at: float | None
) -> float | None:
    """Lower bound of the measurement time (monotonic, s); None: unknown.

    For a robot that echoes only a proof counts.
    """
    if origin.acknowledgements:
        return None if proven_at is None else min(proven_at, at.mono)
    return None if likely is None else at.mono - max(likely, 0.0)
