"""Speed limit of a robot at this moment from all that it knows, holds excepted.

Its own pose, iVeg's silence and the peers' feedback each give a cap; the lowest
applies, and missing knowledge means slow (docs/safety.md).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from iveg.domain.feedback import HALF_SPEED, Feedback
from iveg.domain.fleet import CAUTIOUS, RobotProfile
from iveg.domain.geometry import REST, Pose2D, Twist2D
from iveg.domain.laser import LaserTracks, Outline, Plan
from iveg.domain.limits import LIMITS
from iveg.domain.motion import MotionTrack
from iveg.domain.observations import LaserScan, ReportedObstacle
from iveg.robot.feedback import Authors, Watchdog
from iveg.robot.gate import FREE, AppliedCap, Cap, Lookahead, lowest

OnLinkLoss = Literal["stop", "slow"]


@dataclass(frozen=True, slots=True)
class Limits:
    """Constants of one robot for the safety machine.

    Attributes:
        profile: Its body, and speeds and brakes of its drive.
        slow_s: Feedback older than this halves the speed (s).
        stand_s: Feedback older than this holds the robot (s).
        on_link_loss: ``slow`` stays at half speed however long the silence is.
        plan: Drawn objects of the greenhouse; None: there is no drawing.
    """

    profile: RobotProfile = CAUTIOUS
    slow_s: float = LIMITS.feedback_slow_s
    stand_s: float = LIMITS.feedback_stand_s
    on_link_loss: OnLinkLoss = "stop"
    plan: Plan | None = None


DEFAULT_LIMITS = Limits()


@dataclass(frozen=True, slots=True)
class Placed:
    """Newest odometry.

    Attributes:
        pose: In ``map`` (m, rad); None: not localised.
        twist: Measured (m/s, rad/s).
        at: When it came (monotonic, s).
    """

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
        self._id, self._limits = robot_id, limits
        self.authors = Authors(robot_id, limits.slow_s)
        self._motion: Placed | None = None
        self._track = MotionTrack()
        profile = limits.profile
        self._laser = LaserTracks(Outline(profile.length, profile.width), limits.plan)
        self._lookahead = Lookahead(profile.braking)
        self._waited = AppliedCap(Cap(0.0, "watchdog"))
        self.cap = self._waited.cap
        """In force since the last ``settle``."""
        self.watchdog = Watchdog(boot_at, limits.slow_s)
        self.local = FREE
        """Cap requested by the robot's own software, independent of iVeg."""

    @property
    def twist(self) -> Twist2D:
        """The measured twist, however old; zero before the first."""
        return REST if self._motion is None else self._motion.twist

    def motion(self, now: float) -> Placed | None:
        """Newest odometry; None when it is older than 0.5 s."""
        motion = self._motion
        if motion is None or now - motion.at > LIMITS.pose_stand_s:
            return None
        return motion

    def stands(self, now: float) -> bool:
        """Whether fresh odometry shows the robot at rest, in its pose and its twist."""
        return self.motion(now) is not None and not self._track.motion.moves

    def note_odometry(self, pose: Pose2D | None, twist: Twist2D, now: float) -> None:
        """Note odometry; one with a number that is not finite is ignored.

        Odometry without a pose gives the speed, which confirms a standstill, but no
        position: proximity cannot be judged, and the cap is 0.
        """
        place = () if pose is None else (pose.x, pose.y, pose.yaw)
        if all(map(math.isfinite, (*place, twist.linear_x, twist.angular_z))):
            self._motion = Placed(pose, twist, now)
            self._track.note_odometry(pose, twist, now)

    def note_feedback(self, topic: str, feedback: Feedback, now: float) -> None:
        """Note a message of ``/{topic}/mqtt_feedback``."""
        seq = feedback.seen.get(self._id)
        seen_at = self.watchdog.sent_at(seq)
        # R9: a copy is no evidence that the link works now.
        if self.authors.apply(topic, feedback, self.pose(now), seen_at, now):
            self.watchdog.received(seq, now)

    def note_scan(self, scan: LaserScan, now: float) -> None:
        """Note a sweep of the laser; without a fresh pose it is ignored."""
        motion = self.motion(now)
        if motion is not None and motion.pose is not None:
            peers = self.authors.peers(now)
            self._laser.look(scan, motion.pose, motion.twist, peers, now)

    def note_path(self, path: Sequence[tuple[float, float]], now: float) -> None:
        """Note the path of the robot's own navigation, in ``map`` (m)."""
        self._lookahead.note_path(path, now)

    def obstacle(self, now: float) -> ReportedObstacle | None:
        """Obstacle of the laser, walking obstacles first; None: there is none."""
        obstacle = self._laser.obstacle(now)
        if obstacle is None:
            return None
        return ReportedObstacle(*obstacle.place, obstacle.size_m, obstacle.walked)

    def settle(self, now: float) -> None:
        """Evaluate this moment: the lowest of all caps applies (R6)."""
        self.watchdog.tick(now)
        # Noise of poses at the edge of a zone must not switch the cap on and off.
        slowed = self.cap.reason in ("person", "robot")
        peer_caps = [*self.authors.caps(self.pose(now), slowed, now)]
        raw = lowest(
            (
                self.local,
                self._pose_cap(now),
                self._silence_cap(now),
                FREE if self.obstacle(now) is None else Cap(HALF_SPEED, "obstacle"),
                self._foreseen_cap(now),
                *(cap for cap in peer_caps if cap.waits),
            )
        )
        self._waited = self._waited.settle(raw, now)
        # Their second runs while they still apply, so they end without another.
        ending = (cap for cap in peer_caps if not cap.waits)
        self.cap = lowest((self._waited.cap, *ending))

    def must_stand(self, now: float) -> bool:
        """Whether iVeg's silence requires a hold."""
        silent = self.watchdog.silence(now) > self._limits.stand_s
        return silent and self._limits.on_link_loss == "stop"

    def pose(self, now: float) -> Pose2D | None:
        """Pose in ``map`` of fresh odometry (m, rad); None without."""
        motion = self.motion(now)
        return None if motion is None else motion.pose

    def _pose_cap(self, now: float) -> Cap:
        motion = self.motion(now)
        if motion is None or motion.pose is None:
            # Without a pose no distance to anybody can be judged.
            return Cap(0.0, "stale")
        return (
            Cap(HALF_SPEED, "stale") if now - motion.at > LIMITS.pose_slow_s else FREE
        )

    def _foreseen_cap(self, now: float) -> Cap:
        motion = self.motion(now)
        if motion is None or motion.pose is None:
            self._lookahead.forget()
        elif self._lookahead.is_due(now):
            zones = list(self.authors.capped_zones(now))
            # At the speed of the poses where that is higher: a twist hides a slide.
            pose, twist = self._track.motion.ahead(motion.pose, motion.twist)
            self._lookahead.look(pose, twist, zones, now)
        return self._lookahead.cap

    def _silence_cap(self, now: float) -> Cap:
        # R7: silence is no permission, unlike in the paper's Algorithm 3.
        age = self.watchdog.age(now)
        if age is not None and age <= self._limits.slow_s:
            return FREE
        stands = age is None or age > self._limits.stand_s
        if stands and self._limits.on_link_loss == "stop":
            return Cap(0.0, "watchdog")
        return Cap(HALF_SPEED, "watchdog")
