"""What is known of one robot, and the situation that is found from it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from iveg.domain.events import Condition, Slot
from iveg.domain.feedback import FULL_SPEED, SpeedLimit
from iveg.domain.margins import SafetyMargin
from iveg.domain.observations import SafetyReport
from iveg.domain.robot_state import Link
from iveg.domain.rule.premises import Missing
from iveg.domain.stop.commands import State

Level = Literal["danger", "caution", "doubt", "locked", "working", "away"]
"""Worst first: a P1; a robot near somebody, or on its way to a standstill; one of which
iVeg does not know enough; one that may not move; one at work; one that never spoke."""
Action = Literal[
    "none",
    "press_stop",
    "red_button",
    "keep_away",
    "as_moving",
    "check_robot",
    "check_camera",
    "check_network",
    "check_fleet_file",
    "release",
    "unlock",
    "resume",
]


@dataclass(frozen=True, slots=True)
class Near:
    """The person, robot or obstacle that a situation is about.

    Attributes:
        about: Its id, where it is known.
        distance_m: To it (m); ``lane`` is where it is.
        foretold_s: Until the robot reaches its ring (s); None: it is inside.
        unseen_s: Since anybody saw it (s); of a robot of the fleet 0.
    """

    kind: str
    about: str | None = None
    distance_m: float | None = None
    lane: str | None = None
    foretold_s: float | None = None
    unseen_s: float = 0.0


@dataclass(frozen=True, slots=True)
class RobotFacts:
    """What is known of one robot now.

    Attributes:
        age_s: Of its pose (s); None while nobody knows.
        report: Its newest, while that is fresh.
        alert: The gravest P1 that holds for it.
        alert_about: Whom that is about.
        near: Whom the applied reason is about; ``told_near`` that of the speed limit,
            ``margin_near`` that of the margin.
        stop: State of its STOP.
        is_resuming: The order under way is a resume.
    """

    robot_id: str
    link: Link
    age_s: float | None
    stands: bool
    report: SafetyReport | None
    limit: SpeedLimit
    missing: Sequence[Missing] = ()
    doubts: Sequence[str] = ()
    alert: Condition | None = None
    alert_about: Near | None = None
    near: Near | None = None
    told_near: Near | None = None
    margin: SafetyMargin | None = None
    margin_near: Near | None = None
    stop: State = "RUNNING"
    is_resuming: bool = False
    is_replay: bool = False
    is_revoked: bool = False

    @property
    def applied(self) -> float:
        """Speed factor that it reports to apply; 1.0 where it reports none."""
        if self.report is None:
            return FULL_SPEED
        return 0.0 if self.report.holds else self.report.speed_factor

    @property
    def factor(self) -> float | None:
        """The strictest factor in force; None of a robot that never spoke."""
        if self.link == "UNKNOWN" and self.report is None:
            return None
        return min(self.applied, self.limit.speed_factor)


@dataclass(frozen=True, slots=True)
class Situation:
    """How it stands with one robot.

    Attributes:
        state: Names the sentence of what it does (``situation.is.{state}``).
        cause: The reason that is applied: that of the robot's report, of the speed
            limit, or what iVeg found itself.
        why: Names the sentence of the cause (``situation.why.{why}``); None: the state
            says it all.
        about: The person, robot or hold that is the cause, where it is known.
        factor: The strictest speed factor in force; None: unknown.
    """

    level: Level
    state: str
    cause: str
    why: str | None = None
    about: str | None = None
    action: Action = "none"
    factor: float | None = None
    slots: Mapping[str, Slot] = field(default_factory=dict)
