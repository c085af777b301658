"""What a robot says that it applies: factor, holds, faults."""

from iveg.domain import observations
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.models.base import Model


class Hold(Model):
    """A reason why a robot may not move."""

    id: str
    source: str
    ack: str

    @classmethod
    def of(cls, hold: observations.Hold) -> "Hold":
        """As the robot reported it."""
        return cls(id=hold.id, source=hold.source, ack=hold.ack)


class Fault(Model):
    """A fault of a robot's own data, as the robot reports it."""

    code: str
    about: str
    for_s: float | None


class Applied(Model):
    """Limit that the robot reports to apply."""

    reason: str
    cause: str | None
    age_s: float
    feedback_age_s: float | None
    faults: list[Fault]

    @classmethod
    def of(cls, robot: RobotState, now: Instant) -> "Applied | None":
        """From its newest report; None before the first."""
        report, received = robot.safety, robot.safety_received
        if report is None or received is None:
            return None
        return cls(
            reason=report.reason,
            cause=report.cause,
            age_s=round(now.mono - received.mono, 3),
            feedback_age_s=report.feedback_age_s,
            faults=[
                Fault(code=one.code, about=one.about, for_s=one.for_s)
                for one in report.faults
            ],
        )
