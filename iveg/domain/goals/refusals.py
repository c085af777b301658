"""Why a goal is refused: the codes of the contract, and one sentence of each."""

from collections.abc import Mapping

from iveg.domain.errors import CommandRefusedError

REASONS: Mapping[str, str] = {
    "recording": "it plays a recording",
    "held": "a STOP or another hold keeps it where it is",
    "doubt": "its data contradict each other",
    "no_pose": "its position is not recent",
    "no_report": "its safety report is not recent",
    "no_clock": "its messages do not tell its own clock (mono)",
    "outside": "the place is outside the greenhouse",
    "in_plants": "the place is in the plants",
    "obstacle": "something stands at the place",
    "no_such_aisle": "the greenhouse has no aisle of that label",
    "no_start": "the greenhouse does not say where it belongs",
    "no_goal": "it has no goal",
}


def refusal(robot_id: str, why: str) -> CommandRefusedError:
    """The error that refuses a goal for a reason of the table."""
    return CommandRefusedError(robot_id, "goal", why, REASONS[why])
