"""Devices of a robot at the IoT Agent, with the time of their last message."""

from pydantic import Field

from iveg.domain.observations import Instant, Observation
from iveg.domain.robot_state import RobotState
from iveg.models.base import Model


class Device(Model):
    """One device of a robot."""

    device: str
    robot_id: str
    kind: str = Field(
        description="``robot`` for the device of all orders, else what it measures."
    )
    age_s: float | None = Field(description="Since something came of it; null: never.")

    @classmethod
    def of(
        cls,
        robot: RobotState,
        suffix: str,
        kind: type[Observation] | None,
        now: Instant,
    ) -> "Device":
        """The device of a robot with a suffix; without a kind, that of all orders."""
        heard_at = robot.heard_at
        if kind is not None:
            received = robot.received_at(kind)
            heard_at = None if received is None else received.mono
        return cls(
            device=robot.robot_id + suffix,
            robot_id=robot.robot_id,
            kind=suffix[1:] or "robot",
            age_s=None if heard_at is None else round(max(0.0, now.mono - heard_at), 3),
        )
