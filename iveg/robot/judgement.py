"""Speed limit of a robot at this moment from all that it knows, holds excepted.

Its own pose, iVeg's silence and the peers' feedback each give a cap; the lowest
applies, and missing knowledge means slow (docs/safety.md).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from iveg.domain.feedback import HALF_SPEED, Feedback
from iveg.domain.fleet import CAUTIOUS
from iveg.domain.geometry import REST, Pose2D, Twist2D
from iveg.domain.limits import LIMITS
from iveg.domain.observations import LaserScan
from iveg.domain.witness import KnownBody, Outline, Plan, Witness
from iveg.robot.caps import FREE, AppliedCap, Cap, lowest
from iveg.robot.known_here import KnownHere
from iveg.robot.lookahead import Lookahead
from iveg.robot.peer_feedback import PeerFeedback
from iveg.robot.watchdog import Watchdog

OnLinkLoss = Literal["stop", "slow"]

_UNDESCRIBED = Outline()


@dataclass(frozen=True, slots=True)
class Limits:
    """Constants of one robot for the safety machine.

    Attributes:
        max_speed: (m/s); ``max_turn`` (rad/s).
        slow_s: Feedback older than this halves the speed (s).
        stand_s: Feedback older than this holds the robot (s).
        on_link_loss: ``slow`` stays at half speed however long the silence is.
        outline: The robot's body.
        plan: What stands in the greenhouse; None: nobody drew it.
        braking: What its brakes can do (m/s²).
    """

    max_speed: float = 1.0
    max_turn: float = 1.0
    slow_s: float = LIMITS.feedback_slow_s
    stand_s: float = LIMITS.feedback_stand_s
    on_link_loss: OnLinkLoss = "stop"
    outline: Outline = _UNDESCRIBED
    plan: Plan | None = None
    braking: float = CAUTIOUS.braking


DEFAULT_LIMITS = Limits()


@dataclass(frozen=True, slots=True)
class Motion:
    """Newest odometry; ``at`` monotonic (s); ``pose`` None: not in ``map``."""

    pose: Pose2D | None
    twist: Twist2D
    at: float


class Judgement:
    """Knowledge of one robot and its evaluation; times are monotonic seconds.

    Args:
        robot_id: This robot.
        boot_at: When it started.
        limits: Waiting times and the policy on silence.
    """

    def __init__(self, robot_id: str, boot_at: float, limits: Limits) -> None:
        self._id = robot_id
        self._limits = limits
        self._peer_feedback = PeerFeedback(robot_id)
        self._motion: Motion | None = None
        self._witness = Witness(limits.outline, limits.plan)
        self._lookahead = Lookahead(limits.braking)
        self._waited = AppliedCap(Cap(0.0, "watchdog"))
        self.cap = self._waited.cap
        """In force since the last ``settle``."""
        self.watchdog = Watchdog(boot_at, limits.slow_s)
        self._known_here = KnownHere(robot_id)
        self.local = FREE
        """Cap requested by the robot's own software, independent of iVeg."""

    @property
    def twist(self) -> Twist2D:
        """The measured twist, however old; zero before the first."""
        return REST if self._motion is None else self._motion.twist

    def motion(self, now: float) -> Motion | None:
        """Newest odometry; None when it is older than 0.5 s."""
        motion = self._motion
        if motion is None or now - motion.at > LIMITS.pose_stand_s:
            return None
        return motion

    def stands(self, now: float) -> bool:
        """Whether fresh odometry shows the robot at rest."""
        motion = self.motion(now)
        if motion is None:
            return False
        return (
            abs(motion.twist.linear_x) < LIMITS.standing_speed
            and abs(motion.twist.angular_z) < LIMITS.standing_speed
        )

    def note_odometry(self, pose: Pose2D | None, twist: Twist2D, now: float) -> None:
        """Note odometry; one with a number that is not finite is ignored.

        Odometry without a pose gives the speed, which confirms a standstill, but no
        position: proximity cannot be judged, and the cap is 0.
        """
        place = () if pose is None else (pose.x, pose.y, pose.yaw)
        if all(map(math.isfinite, (*place, twist.linear_x, twist.angular_z))):
            self._motion = Motion(pose, twist, now)

    def note_feedback(self, topic: str, feedback: Feedback, now: float) -> None:
        """Note a message of ``/{topic}/mqtt_feedback``."""
        if self._peer_feedback.apply(topic, feedback, self._own(now), now):
            self.watchdog.heard(feedback.seen.get(self._id), now)
            self._known_here.note(topic, feedback)

    def note_scan(self, scan: LaserScan, now: float) -> None:
        """Note what the laser sees; nothing of it without a young pose."""
        motion = self.motion(now)
        if motion is not None and motion.pose is not None:
            peers = map(KnownBody.of_peer, self._peer_feedback.peers(now))
            known = self._known_here.places(self.watchdog.age(now))
            self._witness.look(scan, motion.pose, motion.twist, peers, now, known)

    def note_path(self, path: Sequence[tuple[float, float]], now: float) -> None:
        """Note where the robot's own navigation will drive, in ``map`` (m)."""
        self._lookahead.note_path(path, now)

    def settle(self, now: float) -> None:
        """Evaluate this moment."""
        self.watchdog.tick(now)
        slowed = self.cap.reason in ("person", "robot")
        peer_caps = [*self._peer_feedback.caps(self._own(now), slowed, now)]
        raw = lowest(
            (
                self.local,
                self._pose_cap(now),
                self._silence_cap(now),
                self._obstacle_cap(now),
                self._foreseen_cap(now),
                *(one for one in peer_caps if one.waits),
            )
        )
        self._waited = self._waited.settle(raw, now)
        ends_late = (one for one in peer_caps if not one.waits)
        self.cap = lowest((self._waited.cap, *ends_late))

    def must_stand(self, now: float) -> bool:
        """Whether iVeg's silence requires a hold."""
        silent = self.watchdog.silence(now) > self._limits.stand_s
        return silent and self._limits.on_link_loss == "stop"

    def _own(self, now: float) -> Pose2D | None:
        motion = self.motion(now)
        return None if motion is None else motion.pose

    def _pose_cap(self, now: float) -> Cap:
        motion = self.motion(now)
        if motion is None or motion.pose is None:
            return Cap(0.0, "stale")
        return (
            Cap(HALF_SPEED, "stale") if now - motion.at > LIMITS.pose_slow_s else FREE
        )

    def _obstacle_cap(self, now: float) -> Cap:
        seen = self._witness.obstacle(now)
        return FREE if seen is None else Cap(HALF_SPEED, "obstacle")

    def _foreseen_cap(self, now: float) -> Cap:
        motion = self.motion(now)
        if motion is None or motion.pose is None:
            self._lookahead.forget()
        elif self._lookahead.is_due(now):
            ahead = list(self._peer_feedback.ahead(now))
            self._lookahead.look(motion.pose, motion.twist, ahead, now)
        return self._lookahead.cap

    def _silence_cap(self, now: float) -> Cap:
        age = self.watchdog.age(now)
        if age is not None and age <= self._limits.slow_s:
            return FREE
        stands = age is None or age > self._limits.stand_s
        if stands and self._limits.on_link_loss == "stop":
            return Cap(0.0, "watchdog")
        return Cap(HALF_SPEED, "watchdog")
