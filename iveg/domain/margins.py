"""The safety margin of a robot and a person: the gap, less what stopping takes.

The protective separation distance of ISO 13855 and ISO/TS 15066 with constant speeds
and a constant deceleration (docs/safety.md, "Margins")::

    S_p = v_h (T + v/a)  +  v T    +  v²/2a   +  Z
          person walks     reaction   braking    uncertainty

It is shown beside the paper's ring and decides nothing.  T grows with the age of the
data: a distance is as old as the older of both positions.  Somebody out of sight may
have come nearer: of whom that could matter the margin is unknown, and of everybody else
it is at least what is told.  Left out: the intrusion distance C, since nobody reaches
through a light curtain here.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant, Odometry
from iveg.domain.robot_state import RobotState
from iveg.domain.tracking.person import Person, Sighting

Band = Literal["clear", "tight", "inside", "unknown"]

_Placed = tuple[RobotState, Odometry, float]
"""A robot, its newest odometry, and the age of that (s)."""
_UNKNOWN_M = 1e4
_INSIDE_M = 1e6


@dataclass(frozen=True, slots=True)
class Margin:
    """Remaining distance between one robot and one person, surface to surface (m).

    Attributes:
        gap_m: Centre distance less both footprints.
        walks_m: How far the person may walk until the robot stands.
        reaction_m: How far the robot drives before its brakes act.
        braking_m: How far it drives after.
        age_s: Of the older of both positions (s).
        braking: What the margin counts on (m/s²).
        known: False where the robot's pose is too old, or the look is and the person
            could be near by now.
    """

    robot_id: str
    person_id: str
    gap_m: float
    walks_m: float
    reaction_m: float
    braking_m: float
    age_s: float
    braking: float
    known: bool = True

    @property
    def needs_m(self) -> float:
        """S_p (m)."""
        return self.walks_m + self.reaction_m + self.braking_m + LIMITS.uncertainty_m

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


def _is_known(pose_age_s: float, look_age_s: float, margin_m: float) -> bool:
    """Whether the margin is known; of a far person the least possible one is."""
    if pose_age_s > LIMITS.pose_lost_s:
        return False
    return look_age_s <= LIMITS.pose_lost_s or margin_m >= LIMITS.margin_clear_m


class LeastMargins:
    """The margin to show first of each robot and each person, all pairs at once.

    Negative ones come first, then unknown ones, then the least.  Only sightings that
    still protect a person count.

    Args:
        robots: The robots of the pairs.
        people: The people of the pairs.
    """

    def __init__(
        self, robots: Iterable[RobotState], people: Iterable[Person], now: Instant
    ) -> None:
        self._now = now
        self._robots: list[_Placed] = []
        for robot in robots:
            age = robot.age_s(now)
            if robot.odometry is not None and age is not None:
                self._robots.append((robot, robot.odometry, age))
        self._detections = [
            (person, look)
            for person in people
            for look in person.sightings
            if look.age_s(now) <= LIMITS.ring_lasts_s
        ]
        self._row = {one.robot_id: row for row, (one, *_) in enumerate(self._robots)}
        self._columns: dict[str, list[int]] = {}
        for column, (person, _) in enumerate(self._detections):
            self._columns.setdefault(person.person_id, []).append(column)
        looks = [look for _, look in self._detections]
        self._margins = _all_pairs(self._robots, looks, now)

    def of_robot(self, robot_id: str) -> Margin | None:
        """The least margin of this robot to anybody."""
        row = self._row.get(robot_id)
        if row is None or not self._detections:
            return None
        return self._pair(row, int(np.argmin(self._margins[row])))

    def of_person(self, person_id: str) -> Margin | None:
        """The least margin of any robot to this person."""
        columns = self._columns.get(person_id)
        if columns is None or not self._robots:
            return None
        found = self._margins[:, columns]
        row, column = np.unravel_index(int(np.argmin(found)), found.shape)
        return self._pair(int(row), columns[int(column)])

    def telling(self) -> list[Margin]:
        """The least of all pairs that are known now, and one that is not, if any.

        They say of this moment what all pairs do (``domain/exposure``).
        """
        if not self._robots or not self._columns:
            return []
        nearest = np.array(
            [
                np.array(columns)[self._margins[:, columns].argmin(axis=1)]
                for columns in self._columns.values()
            ]
        )
        looks = np.array([look.age_s(self._now) for _, look in self._detections])
        ages = np.array([age for _, _, age in self._robots])
        age = np.maximum(ages, looks[nearest])
        margins = self._margins[np.arange(len(self._robots)), nearest]
        known = (margins > -_UNKNOWN_M / 2) | (margins < -_INSIDE_M / 2)
        seen = known & (age <= LIMITS.seen_s)
        places = [np.where(seen, margins, np.inf).argmin(), seen.argmin()]
        return [
            self._pair(place % len(self._robots), int(nearest.flat[place]))
            for place in map(int, places)
        ]

    def _pair(self, row: int, column: int) -> Margin:
        return _to_look(self._robots[row], *self._detections[column], self._now)


def _all_pairs(
    robots: Sequence[_Placed], looks: Sequence[Sighting], now: Instant
) -> NDArray[np.float64]:
    """Rank of each robot with each look, shape (robots, looks), (m).

    The margin as ``_to_look`` has it; unknown ones rank before all that are known, and
    negative ones before those.
    """
    told = np.array([_facts(*one) for one in robots], float)
    x, y, speed, braking, half, age = told.reshape(-1, 6).T[:, :, np.newaxis]
    seen = np.array([(one.x, one.y, one.age_s(now)) for one in looks], float)
    to_x, to_y, look_age = seen.reshape(-1, 3).T
    reaction = np.maximum(
        LIMITS.reaction_s, np.maximum(age, look_age) + LIMITS.onward_s
    )
    gap = np.hypot(x - to_x, y - to_y) - half - LIMITS.person_radius_m
    walks = LIMITS.walking_m_s * (reaction + speed / braking)
    needs = (
        walks + speed * reaction + speed * speed / (2 * braking) + LIMITS.uncertainty_m
    )
    margins = gap - needs
    unseen = (look_age > LIMITS.pose_lost_s) & (margins < LIMITS.margin_clear_m)
    is_lost = (age > LIMITS.pose_lost_s) | unseen
    is_inside = ~is_lost & (margins < 0.0)
    found: NDArray[np.float64] = margins - _UNKNOWN_M * is_lost - _INSIDE_M * is_inside
    return found


def _facts(robot: RobotState, odometry: Odometry, age_s: float) -> tuple[float, ...]:
    """x, y (m), speed (m/s), braking (m/s²), half the length (m), age (s)."""
    place, speed, profile = odometry.pose, abs(odometry.twist.linear_x), robot.profile
    return place.x, place.y, speed, profile.assumed_braking, profile.length / 2, age_s


def _to_look(placed: _Placed, person: Person, look: Sighting, now: Instant) -> Margin:
    robot, odometry, pose_age = placed
    profile = robot.profile
    braking, speed = profile.assumed_braking, abs(odometry.twist.linear_x)
    age = max(pose_age, look.age_s(now))
    reaction = max(LIMITS.reaction_s, age + LIMITS.onward_s)
    footprints = profile.length / 2 + LIMITS.person_radius_m
    one = Margin(
        robot.robot_id,
        person.person_id,
        gap_m=odometry.pose.distance_to(look.x, look.y) - footprints,
        walks_m=LIMITS.walking_m_s * (reaction + speed / braking),
        reaction_m=speed * reaction,
        braking_m=speed * speed / (2 * braking),
        age_s=age,
        braking=braking,
    )
    known = _is_known(pose_age, look.age_s(now), one.margin_m)
    return one if known else replace(one, known=False)
