"""The safety margin of a robot and a person: the gap, less what stopping takes.

The protective separation distance of ISO 13855 and ISO/TS 15066 with constant speeds
and a constant deceleration (docs/safety.md, "Margins")::

    S_p = v_h (T + v/a)  +  v T    +  v²/2a   +  Z
          person walks     reaction   braking    uncertainty

It is shown beside the paper's zone and decides nothing.  T grows with the age of the
data: a distance is as old as the older of both positions.  Somebody out of sight may
have come nearer: of whom that could matter the margin is unknown, and of everybody else
it is at least what is shown.  Left out: the intrusion distance C, since nobody reaches
through a light curtain here.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant, Odometry
from iveg.domain.robot_state import RobotState
from iveg.domain.tracking.person import TrackedPerson

Band = Literal["clear", "tight", "inside", "unknown"]

_Floats = NDArray[np.float64]
_UNKNOWN_M, _INSIDE_M = 1e4, 1e6
"""Taken off the rank of unknown and of negative margins, which come first."""


@dataclass(frozen=True, slots=True)
class SafetyMargin:
    """Remaining distance between one robot and one person, surface to surface (m).

    Attributes:
        gap_m: Centre distance less both footprints.
        needs_m: S_p.
        age_s: Of the older of both positions (s).
        known: False where the robot's pose is too old, or the look is and the person
            could be near by now.
    """

    robot_id: str
    person_id: str
    gap_m: float
    needs_m: float
    age_s: float
    known: bool = True

    @property
    def margin_m(self) -> float:
        """The margin (m); below zero the robot could not stop in time."""
        return self.gap_m - self.needs_m

    @property
    def band(self) -> Band:
        """The margin as one word, which is never "safe"."""
        if not self.known:
            return "unknown"
        if self.margin_m < 0.0:
            return "inside"
        return "tight" if self.margin_m < LIMITS.margin_clear_m else "clear"


class LeastMargins:
    """The margin to show first of each robot, all pairs at once.

    Negative ones come first, then unknown ones, then the least.  Only sightings that
    still protect a person count.

    Args:
        robots: The robots of the pairs.
        people: The people of the pairs.
    """

    def __init__(
        self,
        robots: Iterable[RobotState],
        people: Iterable[TrackedPerson],
        now: Instant,
    ) -> None:
        facts = []
        self._robots: list[RobotState] = []
        for robot in robots:
            age_s = robot.age_s(now)
            if robot.odometry is not None and age_s is not None:
                self._robots.append(robot)
                facts.append(_facts(robot, robot.odometry, age_s))
        seen = [
            (person.person_id, (look.x, look.y, look.age_s(now)))
            for person in people
            for look in person.sightings
            if look.age_s(now) <= LIMITS.zone_lasts_s
        ]
        self._persons = [person_id for person_id, _ in seen]
        placed = np.array(facts, float).reshape(-1, 6)
        looks = np.array([look for _, look in seen], float).reshape(-1, 3)
        self._compute(placed.T[:, :, np.newaxis], looks.T)

    def _compute(self, placed: _Floats, looks: _Floats) -> None:
        """Terms of all pairs, each of shape (robots, looks), in metres and seconds."""
        x, y, speed, brakes, half, pose_age = placed
        to_x, to_y, look_age = looks
        age = np.maximum(pose_age, look_age)
        reacts_s = np.maximum(LIMITS.reaction_s, age + LIMITS.onward_s)
        gap = np.hypot(x - to_x, y - to_y) - half - LIMITS.person_radius_m
        walks = LIMITS.walking_m_s * (reacts_s + speed / brakes)
        drives = speed * reacts_s + speed * speed / (2 * brakes)
        needs = walks + drives + LIMITS.uncertainty_m
        margin = gap - needs
        # Of a far person the least possible margin is known, however old the look.
        is_far = margin >= LIMITS.margin_clear_m
        is_seen = look_age <= LIMITS.pose_lost_s
        self._known = (pose_age <= LIMITS.pose_lost_s) & (is_seen | is_far)
        is_inside = self._known & (margin < 0.0)
        self._rank = margin - _UNKNOWN_M * ~self._known - _INSIDE_M * is_inside
        self._terms = gap, needs, age

    def of_robot(self, robot_id: str) -> SafetyMargin | None:
        """The least margin of this robot to anybody; None where there is no pair."""
        row = next(
            (n for n, one in enumerate(self._robots) if one.robot_id == robot_id), None
        )
        if row is None or not self._persons:
            return None
        column = int(self._rank[row].argmin())
        gap, needs, age = (term.item(row, column) for term in self._terms)
        return SafetyMargin(
            robot_id,
            self._persons[column],
            gap,
            needs,
            age,
            self._known.item(row, column),
        )


def _facts(robot: RobotState, odometry: Odometry, age_s: float) -> tuple[float, ...]:
    """x, y (m), speed (m/s), braking (m/s²), half the length (m), age (s)."""
    place, speed, profile = odometry.pose, robot.track.motion.speed, robot.profile
    return place.x, place.y, speed, profile.assumed_braking, profile.length / 2, age_s
