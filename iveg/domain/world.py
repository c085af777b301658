"""The world as iVeg knows it: every robot with the age of everything about it.

``World.apply`` takes one observation; older ones and twins change nothing and are
counted.  Nothing here reads a clock: ages come from the ``now`` that is handed in.
Beside it stands what it judges by: the ledger of feedback, whose echoes prove ages;
what contradicts physics; and other servers' feedback.
"""

from bisect import bisect_right
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import inf
from typing import Literal

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
from iveg.domain.robot_state import RobotState, apply_newest, dated, learn_kind
from iveg.domain.stream_order import OrderVerdict
from iveg.domain.transports import FIWARE
from iveg.domain.words import WordAnswers

# --- proven age -------------------------------------------------------------------
#
# Robots name in every message the newest feedback that they have received.  What was
# measured after that feedback arrived was measured after it left iVeg, so the message
# is at most as old as the feedback is now, on iVeg's own monotonic clock.  No clock of
# the robot enters and no delay is guessed (docs/safety.md, "Age").

_APART_S = 0.05
"""Moments closer than this share the earlier one, so that ages come out older."""
_MOST = 36_000
"""Moments; the older half of them, fifteen minutes at least, goes then."""


class FeedbackLedger:
    """Remembers when each feedback message was composed."""

    def __init__(self) -> None:
        self._boot: str | None = None
        self._firsts: list[int] = []
        self._moments: list[float] = []
        self._last = -1

    def composed(self, boot: str, first: int, last: int, now: float) -> None:
        """Record that feedback ``first`` to ``last`` is composed now (monotonic, s)."""
        self._boot, self._last = boot, last
        if self._moments and now - self._moments[-1] < _APART_S:
            return
        self._firsts.append(first)
        self._moments.append(now)
        if len(self._moments) > _MOST:
            del self._firsts[: _MOST // 2], self._moments[: _MOST // 2]

    def is_sent(self, echo: FeedbackRef) -> bool:
        """Whether this boot has sent that feedback."""
        return echo.boot == self._boot and echo.seq <= self._last

    def composed_at(self, *echoes: FeedbackRef) -> float | None:
        """The moment when the newest of these was composed, or earlier (monotonic, s).

        None where nothing is proven: all are of other authors, were never sent, or are
        forgotten.
        """
        sent = [one.seq for one in echoes if self.is_sent(one)]
        index = bisect_right(self._firsts, max(sent, default=-1)) - 1
        return None if index < 0 else self._moments[index]


_SILENT_S = 1.0
"""A direct copy older than this is missed."""

# --- contradictions ---------------------------------------------------------------
#
# Whether what a robot says can be true: by physics, and by what it said before.  Only
# news is compared, and the longer of the robot's time and ours counts, so that lateness
# and reordering are no contradictions.  docs/safety.md, "Doubt", has the table.

Code = Literal["pose_outside", "too_fast", "jumped"]
"""Contradictions, beside those of :mod:`~iveg.domain.motion`."""

ANY_ROBOT_M_S, ANY_ROBOT_RAD_S = 10.0, 10.0
"""Faster than any robot in a greenhouse: the bound of one that nobody described."""
_SPEED_SHARE, _SPEED_M_S = 1.25, 0.25
"""A drive may overshoot its greatest speed by this, and odometry is noisy (1, m/s)."""
_TURN_SHARE, _TURN_RAD_S = 1.5, 0.5
_JUMP_M = 0.5
"""Corrections of a localisation are smaller (m)."""
_ANCHOR_S = 1.0
"""Poses are compared over so long, so that many small steps add up."""
_LATE_S = 10.0
"""A message may be so much later than the next one; a clock that tells more leapt."""


@dataclass(frozen=True, slots=True)
class _Anchor:
    """A pose that later ones are compared with; ``at`` when it came (monotonic, s)."""

    said: Odometry
    at: float

    def passed_s(self, later: Origin, now: float) -> float:
        """Longest time since it was measured, when ``later`` was (s)."""
        earlier, arrived = self.said.origin, now - self.at
        if earlier.seq is None or later.seq is None:
            return arrived + _LATE_S  # whoever does not count may come in any order
        own = _own_s_between(earlier, later)
        return arrived if own is None else max(arrived, min(own, arrived + _LATE_S))


class Plausibility:
    """Judges what the robots of a fleet say.

    Args:
        bounds: Of the greenhouse and what around it robots may use; None: nobody knows
            where its robots may be.
    """

    def __init__(self, bounds: Rectangle | None) -> None:
        self._bounds = bounds
        self._anchors: dict[str, _Anchor] = {}

    def contradictions(self, robot: RobotState, received: Received) -> Iterator[Code]:
        """Codes of what news contradicts in the robot's state before this message."""
        description = robot.description
        match received.observation:
            case Odometry() as said:
                bounds, pose = self._bounds, said.pose
                if bounds is not None and not bounds.contains(pose.x, pose.y):
                    yield "pose_outside"
                if _is_too_fast(description, said.twist):
                    yield "too_fast"
                if self._has_jumped(description, said, received.at.mono):
                    yield "jumped"
            case SafetyReport(linear=linear, angular=angular):
                if _is_too_fast(description, Twist2D(linear, angular)):
                    yield "too_fast"

    def _has_jumped(self, robot: RobotDescription, said: Odometry, at: float) -> bool:
        """Whether it cannot have come here since an earlier pose of the same boot."""
        anchor = self._anchors.get(said.robot_id)
        if anchor is None or anchor.said.origin.boot != said.origin.boot:
            self._anchors[said.robot_id] = _Anchor(said, at)
            return False
        reach = _most_speed(robot) * anchor.passed_s(said.origin, at) + _JUMP_M
        jumped = anchor.said.pose.distance_to(said.pose.x, said.pose.y) > reach
        if jumped or at - anchor.at >= _ANCHOR_S:
            self._anchors[said.robot_id] = _Anchor(said, at)
        return jumped


def _is_too_fast(robot: RobotDescription, twist: Twist2D) -> bool:
    turn = ANY_ROBOT_RAD_S
    if robot.is_described:
        turn = _TURN_SHARE * robot.profile.max_turn + _TURN_RAD_S
    return abs(twist.linear_x) > _most_speed(robot) or abs(twist.angular_z) > turn


def _most_speed(robot: RobotDescription) -> float:
    """Speed above which no such robot drives, noise included (m/s)."""
    if not robot.is_described:
        return ANY_ROBOT_M_S
    return _SPEED_SHARE * robot.profile.max_speed + _SPEED_M_S


def _own_s_between(earlier: Origin, later: Origin) -> float | None:
    """Seconds between two messages on the robot's own clock; None where unknown."""
    if (earlier.mono is None) != (later.mono is None):
        return None
    then, now = earlier.own_s, later.own_s
    return None if then is None or now is None else now - then


# --- other servers ----------------------------------------------------------------
#
# Two authors steer one fleet where a robot hears feedback that this iVeg never sent,
# and goes on hearing more of it.  An earlier run of this iVeg says nothing more, so it
# is none.  One robot's word is enough, as it slows nobody and frees nobody.

SPOKEN_FOR_S = 3.0
"""An earlier run may end that much after this one began."""


@dataclass(frozen=True, slots=True)
class _Heard:
    """Feedback of others that one robot hears: newest counts, first and last news.

    Attributes:
        news: When it first heard of them (monotonic, s), and last anything new.
    """

    others: dict[str, int]
    news: tuple[float, float]


class OtherAuthors:
    """Authors of feedback beside this iVeg; ``ledger`` knows what it sent itself."""

    def __init__(self, ledger: FeedbackLedger) -> None:
        self._ledger = ledger
        self._heard: dict[str, _Heard] = {}

    def note(
        self, robot_id: str, origin: Origin, at: Instant, *, is_direct: bool
    ) -> None:
        """Take what a robot echoes; what may be from before our start is left out."""
        proven_at = self._ledger.composed_at(*origin.echoes)
        if not is_direct and (proven_at is None or at.mono - proven_at > LIMITS.late_s):
            return
        sent = [one for one in origin.echoes if self._ledger.is_sent(one)]
        # A second count in our own name is another's.
        ours = max(sent, key=lambda one: one.seq, default=None)
        others = {one.boot: one.seq for one in origin.echoes if one != ours}
        before = self._heard.get(robot_id)
        if not others:
            self._heard.pop(robot_id, None)
        elif before is None:
            self._heard[robot_id] = _Heard(others, (at.mono, at.mono))
        elif any(seq > before.others.get(boot, -1) for boot, seq in others.items()):
            self._heard[robot_id] = _Heard(others, (before.news[0], at.mono))

    def speaking(self, now: Instant) -> list[str]:
        """Boots of those that have gone on for 3 s and spoke within the last ten."""
        return sorted(
            {
                boot
                for one in self._heard.values()
                if one.news[1] - one.news[0] >= SPOKEN_FOR_S
                and now.mono - one.news[1] <= LIMITS.zone_lasts_s
                for boot in one.others
            }
        )


# --- the world --------------------------------------------------------------------

_NO_MESSAGE = Climate, HeartbeatProbe, RefusedFrame
"""Observations that are in no robot's stream of messages."""
_ASKED_AGE_S = LIMITS.late_s + 0.1


class World:
    """All robots of the fleet and the air around them.

    Args:
        fleet: Its robots; ids alone are robots without a description.
        probe: Lag of FIWARE; without one FIWARE's lag is not used.
        bounds: Where robots may be; without them anywhere.

    Attributes:
        returned_detectors: Whose detector a boot has put back in service, until read.
        word_answers: What operators said of words of detectors.
        ledger: When iVeg's own feedback was composed, which robots echo.
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
            robot_id: RobotState(robot_id, one)
            for robot_id, one in fleet.members.items()
        }
        self._plausibility = Plausibility(bounds)
        self.other_authors = OtherAuthors(self.ledger)
        self.climate: Climate | None = None
        self.climate_received: Instant | None = None
        self.counters: Counter[str] = Counter()
        self._direct_at: dict[tuple[str, type[Observation]], float] = {}
        """Arrival of the newest direct message by robot and kind (monotonic, s)."""
        self.returned_detectors: list[str] = []
        self.word_answers = WordAnswers()

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
        """Whether a setting says that a robot is not heard."""
        robot = self.robots.get(robot_id)
        return robot is not None and robot.refused

    def misplaced(self, observation: Observation) -> str | None:
        """Name of the frame that odometry is in, if that is not its robot's."""
        frame = observation.frame_id if isinstance(observation, Odometry) else None
        if frame is None or is_pose_frame(
            frame, self.robot(observation.robot_id).description
        ):
            return None
        return frame

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
        if received.alone:
            robot.sighted_at = at
            return "late"
        learn_kind(robot, received, origin)
        verdict = robot.judge(received, origin, self.ledger.composed_at(*origin.echoes))
        if not received.asked:
            verdict = self._fed(received, verdict)
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
            self._take(robot, received, self._measured_at(origin, received, likely))
        return verdict

    def _take(
        self, robot: RobotState, received: Received, moment: float | None
    ) -> None:
        """Take the newest of its kind in, and note what it contradicts.

        A recording may jump as it likes, and Orion's answer is of any time.
        """
        at, origin = received.at, received.observation.origin
        is_checked = not (robot.is_replay or received.asked)
        if not received.asked:
            is_direct = received.transport != FIWARE.id
            self.other_authors.note(robot.robot_id, origin, at, is_direct=is_direct)
        if is_checked:
            for code in self._plausibility.contradictions(robot, received):
                self._doubt(robot, code, at)
        apply_newest(robot, received, moment)
        moved = robot.motion(at).contradiction
        if is_checked and moved and isinstance(received.observation, Odometry):
            self._doubt(robot, moved, at, LASTED_S)

    def _doubt(
        self, robot: RobotState, code: str, at: Instant, lasted_s: float = 0.0
    ) -> None:
        """Note what a robot says that contradicts itself or physics."""
        robot.doubts.contradicted(code, at, lasted_s)
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
        """Age of a message when it came, by its stamp and our probe (s)."""
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
        """Lower bound of the measurement time (monotonic, s); None: nobody knows.

        Of a robot that echoes only a proof counts.
        """
        now = received.at.mono
        moment = None if likely is None else now - likely
        if origin.acknowledgements:
            moment = self.ledger.composed_at(*origin.echoes)
        if moment is None:
            return None
        return min(moment, now - (_ASKED_AGE_S if received.asked else 0.0))

    def age_then(self, received: Received) -> float:
        """Greatest age of the newest of its kind when it came (s).

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
        """Lower bound of when the newest of this kind was measured (monotonic, s)."""
        if isinstance(observation, SafetyReport):
            reported = self.robot(observation.robot_id).safety_received
            return None if reported is None else reported.mono
        if isinstance(observation, Odometry):
            robot = self.robot(observation.robot_id)
            return robot.pose_at if robot.estimated_since is None else None
        return None

    def _fed(self, received: Received, verdict: OrderVerdict) -> OrderVerdict:
        """The verdict; without a count Orion's copy of a direct message is none."""
        observation, at = received.observation, received.at.mono
        key = observation.robot_id, kind_of(observation)
        if key[1] not in (Odometry, LaserScan):
            return verdict
        if received.transport != FIWARE.id:
            self._direct_at[key] = at
        elif observation.origin.seq is None:
            direct_at = self._direct_at.get(key, -inf)
            return "duplicate" if at - direct_at <= _SILENT_S else verdict
        return verdict

    def live_robots(self) -> Iterable[RobotState]:
        """Robots that are not recordings."""
        return (robot for robot in self.robots.values() if not robot.is_replay)


def _age_when_asked(origin: Origin, at: Instant) -> float:
    """Least age of Orion's answer (s): nothing that was asked for looks live."""
    stamped = 0.0 if origin.stamp_s is None else at.wall - origin.stamp_s
    return max(stamped, _ASKED_AGE_S)
