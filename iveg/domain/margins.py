"""The safety margin of a robot and a person: the gap, less what stopping takes.

The protective separation distance of ISO 13855 and ISO/TS 15066 with constant speeds
and a constant deceleration (docs/safety.md, "Margins")::

    S_p = v_h (T + v/a)  +  v T    +  v²/2a   +  Z
          person walks     reaction   braking    uncertainty

It is shown beside the paper's ring and decides nothing.  T grows with the age of the
data: a distance is as old as the older of both positions.  Somebody out of sight may
have come nearer: of whom that could matter the margin is unknown, and of everybody else
it is at least what is shown.  Left out: the intrusion distance C, since nobody reaches
through a light curtain here.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant, Odometry
from iveg.domain.robot_state import RobotState
from iveg.domain.tracking.person import Sighting, TrackedPerson

Band = Literal["clear", "tight", "inside", "unknown"]

_Floats = NDArray[np.float64]
_Placed = tuple[RobotState, Odometry, float]
"""A robot, its newest odometry, and the age of that (s)."""
_UNKNOWN_M = 1e4
_INSIDE_M = 1e6


@dataclass(frozen=True, slots=True)
class SafetyMargin:
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


class LeastMargins:
    """The margin to show first of each robot and each person, all pairs at once.

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
        self._robots: list[_Placed] = []
        for robot in robots:
            age = robot.age_s(now)
            if robot.odometry is not None and age is not None:
                self._robots.append((robot, robot.odometry, age))
        seen = [
            (person.person_id, look)
            for person in people
            for look in person.sightings
            if look.age_s(now) <= LIMITS.zone_lasts_s
        ]
        self._persons = [person_id for person_id, _ in seen]
        self._row = {one.robot_id: row for row, (one, *_) in enumerate(self._robots)}
        self._columns: dict[str, list[int]] = {}
        for column, person_id in enumerate(self._persons):
            self._columns.setdefault(person_id, []).append(column)
        self._pairs = _Pairs.of(self._robots, [look for _, look in seen], now)

    def of_robot(self, robot_id: str) -> SafetyMargin | None:
        """The least margin of this robot to anybody."""
        row = self._row.get(robot_id)
        if row is None or not self._persons:
            return None
        return self._pair(row, int(np.argmin(self._pairs.rank[row])))

    def of_person(self, person_id: str) -> SafetyMargin | None:
        """The least margin of any robot to this person."""
        columns = self._columns.get(person_id)
        if columns is None or not self._robots:
            return None
        _, row, column = min(self._least[column] for column in columns)
        return self._pair(row, column)

    @cached_property
    def _least(self) -> list[tuple[float, int, int]]:
        """Of each column: the least rank, its row, and the column."""
        rank = self._pairs.rank
        rows, columns = rank.argmin(axis=0), np.arange(rank.shape[1])
        lists = rank[rows, columns].tolist(), rows.tolist(), columns.tolist()
        return list(zip(*lists, strict=True))

    def _pair(self, row: int, column: int) -> SafetyMargin:
        pairs, robot = self._pairs, self._robots[row][0]
        parts = pairs.gap, pairs.walks, pairs.reaction, pairs.braking, pairs.age
        gap, walks, reaction, braking, age = (one.item(row, column) for one in parts)
        return SafetyMargin(
            robot.robot_id,
            self._persons[column],
            gap,
            walks,
            reaction,
            braking,
            age,
            robot.profile.assumed_braking,
            pairs.known.item(row, column),
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Pairs:
    """Each robot with each look; all of shape (robots, looks), in metres and seconds.

    Attributes:
        rank: The margin; unknown ones rank before all that are known, and negative
            ones before those.
        known: Of a far person the least possible margin is, however old the look.
    """

    gap: _Floats
    walks: _Floats
    reaction: _Floats
    braking: _Floats
    age: _Floats
    known: NDArray[np.bool_]
    rank: _Floats

    @classmethod
    def of(
        cls, robots: Sequence[_Placed], looks: Sequence[Sighting], now: Instant
    ) -> "_Pairs":
        """Margins of all pairs at once."""
        placed = np.array([_facts(*one) for one in robots], float)
        x, y, speed, brakes, half, pose_age = placed.reshape(-1, 6).T[:, :, np.newaxis]
        seen = np.array([(one.x, one.y, one.age_s(now)) for one in looks], float)
        to_x, to_y, look_age = seen.reshape(-1, 3).T
        age = np.maximum(pose_age, look_age)
        reacts_s = np.maximum(LIMITS.reaction_s, age + LIMITS.onward_s)
        gap = np.hypot(x - to_x, y - to_y) - half - LIMITS.person_radius_m
        walks = LIMITS.walking_m_s * (reacts_s + speed / brakes)
        reaction = speed * reacts_s
        braking = np.broadcast_to(speed * speed / (2 * brakes), gap.shape)
        margin = gap - (walks + reaction + braking + LIMITS.uncertainty_m)
        is_seen = look_age <= LIMITS.pose_lost_s
        is_far = margin >= LIMITS.margin_clear_m
        known = (pose_age <= LIMITS.pose_lost_s) & (is_seen | is_far)
        rank = margin - _UNKNOWN_M * ~known - _INSIDE_M * (known & (margin < 0.0))
        return cls(gap, walks, reaction, braking, age, known, rank)


def _facts(robot: RobotState, odometry: Odometry, age_s: float) -> tuple[float, ...]:
    """x, y (m), speed (m/s), braking (m/s²), half the length (m), age (s)."""
    place, speed, profile = odometry.pose, robot.track.motion.speed, robot.profile
    return place.x, place.y, speed, profile.assumed_braking, profile.length / 2, age_s
