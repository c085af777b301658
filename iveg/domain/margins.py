"""Safety margin of a robot and a person: their distance, less that to stop.

The protective separation distance of ISO 13855 and ISO/TS 15066 with constant speeds
and a constant deceleration (docs/safety.md, "Margins")::

    S_p = v_h (T + v/a)  +  v T    +  v²/2a   +  Z
          person walks     reaction   braking    uncertainty

It is shown beside the paper's zone and decides nothing.  T grows with the age of the
data: a distance is as old as the older of both positions.  A person out of sight may
have come nearer.  If they may be near, the margin is unknown; else it is at least the
shown value.  The intrusion distance C is left out, since nobody reaches
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
from iveg.domain.tracking.tracker import TrackedPerson

Band = Literal["clear", "tight", "inside", "unknown"]

_Floats = NDArray[np.float64]
_UNKNOWN_M, _INSIDE_M = 1e4, 1e6
"""Subtracted from unknown and from negative margins, so that they come first."""


@dataclass(frozen=True, slots=True)
class SafetyMargin:
    """Remaining distance between one robot and one person, surface to surface (m).

    Attributes:
        gap_m: Centre distance less both footprints.
        needs_m: The distance that stopping needs, S_p (m).
        age_s: Age of the older of both positions (s).
        known: False where the robot's pose is too old, or where the sighting is too old
            and the person could be near by now.
    """

    robot_id: str
    person_id: str
    gap_m: float
    needs_m: float
    age_s: float
    known: bool = True

    @property
    def margin_m(self) -> float:
        """Margin (m); below zero the robot could not stop in time."""
        return self.gap_m - self.needs_m

    @property
    def band(self) -> Band:
        """Margin as a single word, which is never "safe"."""
        if not self.known:
            return "unknown"
        if self.margin_m < 0.0:
            return "inside"
        return "tight" if self.margin_m < LIMITS.margin_clear_m else "clear"


class LeastMargins:
    """The margin to show first of each robot, all pairs at once.

    Negative margins come first, then unknown margins, then the least.  Only sightings
    that still protect a person count.

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
        sightings = [
            (person.person_id, (sighting.x, sighting.y, sighting.age_s(now)))
            for person in people
            for sighting in person.sightings
            if sighting.age_s(now) <= LIMITS.zone_lasts_s
        ]
        self._persons = [person_id for person_id, _ in sightings]
        placed = np.array(facts, float).reshape(-1, 6)
        places = np.array([place for _, place in sightings], float).reshape(-1, 3)
        self._compute(placed.T[:, :, np.newaxis], places.T)

    def _compute(self, placed: _Floats, sightings: _Floats) -> None:
        """Terms of all pairs, each of shape (robots, sightings) (m, s)."""
        x, y, speed, brakes, half, pose_age = placed
        to_x, to_y, seen_age = sightings
        age = np.maximum(pose_age, seen_age)
        # Old data delay the reaction by their age.
        reacts_s = np.maximum(LIMITS.reaction_s, age + LIMITS.onward_s)
        distance = np.hypot(x - to_x, y - to_y) - half - LIMITS.person_radius_m
        walks = LIMITS.walking_m_s * (reacts_s + speed / brakes)
        drives = speed * reacts_s + speed * speed / (2 * brakes)
        needs = walks + drives + LIMITS.uncertainty_m
        margin = distance - needs
        # A far person's least possible margin is known, however old the sighting.
        is_far = margin >= LIMITS.margin_clear_m
        is_seen = seen_age <= LIMITS.pose_lost_s
        self._known = (pose_age <= LIMITS.pose_lost_s) & (is_seen | is_far)
        is_inside = self._known & (margin < 0.0)
        self._rank = margin - _UNKNOWN_M * ~self._known - _INSIDE_M * is_inside
        self._terms = distance, needs, age

    def of_robot(self, robot_id: str) -> SafetyMargin | None:
        """Least margin of this robot to anybody; None where there is no pair."""
        row = next(
            (n for n, robot in enumerate(self._robots) if robot.robot_id == robot_id),
            None,
        )
        if row is None or not self._persons:
            return None
        column = int(self._rank[row].argmin())
        distance, needs, age = (term.item(row, column) for term in self._terms)
        return SafetyMargin(
            robot_id,
            self._persons[column],
            distance,
            needs,
            age,
            self._known.item(row, column),
        )


def _facts(robot: RobotState, odometry: Odometry, age_s: float) -> tuple[float, ...]:
    """x, y (m), speed (m/s), braking (m/s²), half the length (m), age (s)."""
    place, speed, profile = odometry.pose, robot.track.motion.speed, robot.profile
    return place.x, place.y, speed, profile.assumed_braking, profile.length / 2, age_s
