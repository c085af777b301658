"""What the safety machine wants done, as frozen values, in the order to do it.

Zero command first, then the hold set to disk, then the answer, then the report.
"""

from dataclasses import dataclass
from typing import Literal

from iveg.domain.geometry import Twist2D
from iveg.domain.observations import CommandAnswer, SafetyReport
from iveg.robot.holds import HoldSet

AnswerCode = Literal["LATCHED", "RELEASED", "RESUMED", "REFUSED"]


@dataclass(frozen=True, slots=True)
class Drive:
    """Tell the drive this, now."""

    twist: Twist2D


@dataclass(frozen=True, slots=True)
class Persist:
    """Keep this hold set over a loss of power."""

    holds: HoldSet


@dataclass(frozen=True, slots=True)
class Answer:
    """Answer a command on ``cmdexe``; the uplink fills the origin."""

    answer: CommandAnswer


@dataclass(frozen=True, slots=True)
class Report:
    """Say what is applied; the uplink fills the origin and tells its ``seq`` back.

    Attributes:
        is_measure: Also for the IoT Agent, which gets changes and two a second.
    """

    report: SafetyReport
    is_measure: bool = True


Effect = Drive | Persist | Answer | Report
