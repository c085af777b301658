"""Whether a robot is heard, and who had it heard no more."""

from pydantic import Field

from iveg.domain.revocation import BrokerTold
from iveg.domain.robot_state import RobotState
from iveg.domain.stamps import format_stamp
from iveg.models.base import Model


class Revoked(Model):
    """Who had a robot heard no more."""

    by: str
    since: str
    stood: bool = Field(description="Whether the STOP before it was confirmed.")

    @classmethod
    def of(cls, robot: RobotState) -> "Revoked | None":
        """None of a robot that is heard."""
        word = robot.revoked
        if word is None:
            return None
        return cls(by=word.by, since=format_stamp(word.since), stood=word.stood)


class RobotAccess(Model):
    """What came of revoking a robot, or of allowing it again."""

    robot_id: str
    revoked: Revoked | None
    broker: BrokerTold = Field(description="What came of asking the broker.")

    @classmethod
    def of(cls, robot: RobotState, broker: BrokerTold) -> "RobotAccess":
        """Of one robot."""
        return cls(robot_id=robot.robot_id, revoked=Revoked.of(robot), broker=broker)
