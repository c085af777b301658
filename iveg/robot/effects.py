"""Effects that the safety machine requests, as frozen values in the order of execution.

The zero command comes first, then the hold set on disk, then the answer, then the
report.
"""

from dataclasses import dataclass
from typing import Literal

from iveg.domain.geometry import Twist2D
from iveg.domain.observations import CommandAnswer, SafetyReport
from iveg.robot.holds import HoldSet

AnswerCode = Literal["LATCHED", "RELEASED", "RESUMED", "REFUSED"]


@dataclass(frozen=True, slots=True)
class Drive:
    """Send this command to the drive at once."""

    twist: Twist2D


@dataclass(frozen=True, slots=True)
class Persist:
    """Store this hold set so that it survives a loss of power."""

    holds: HoldSet


@dataclass(frozen=True, slots=True)
class SendAnswer:
    """Answer a command on ``cmdexe``; the uplink fills in the origin."""

    answer: CommandAnswer


@dataclass(frozen=True, slots=True)
class Report:
    """Publish a safety report; the uplink fills in the origin and returns its ``seq``.

    Attributes:
        is_measure: Also for the IoT Agent, which gets changes and two a second.
    """

    report: SafetyReport
    is_measure: bool = True


Effect = Drive | Persist | SendAnswer | Report
