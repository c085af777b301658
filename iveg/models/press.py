"""The answer to a press of STOP, release or resume."""

from iveg.domain import stop
from iveg.models.base import Model


class Pressed(Model):
    """A STOP, release or resume that was accepted."""

    robot_id: str
    command_id: str
    state: str

    @classmethod
    def of(cls, command: stop.FollowedCommand) -> "Pressed":
        """As it stands just after the press."""
        return cls(
            robot_id=command.robot_id,
            command_id=command.command_id,
            state=command.state,
        )


class FleetPressed(Model):
    """A fleet STOP: one command a robot."""

    commands: list[Pressed]
