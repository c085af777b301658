"""Orders to one robot: a command, or the retained desired state."""

from collections.abc import Iterable, Mapping
from typing import Literal

import orjson

from iveg.domain.goals import CancelOrder, GoalOrder
from iveg.ngsi import names


def write_stop(hold_id: str, by: str) -> dict[str, object]:
    """The value of ``cmd`` that stops a robot."""
    return {"stop": {"id": hold_id, "by": by}}


def write_release(
    hold_ids: Iterable[str], challenge: str, attempt: str
) -> dict[str, object]:
    """The value of ``cmd`` that lifts exactly these holds.

    Args:
        hold_ids: Every remote hold of the robot.
        challenge: The robot's newest.
        attempt: Names this order, so that its copies are known for what they are.
    """
    return {"release": {"ids": list(hold_ids), "ch": challenge, "attempt": attempt}}


def write_resume(challenge: str, attempt: str) -> dict[str, object]:
    """The value of ``cmd`` that lets a released robot drive; as ``write_release``."""
    return {"resume": {"ch": challenge, "attempt": attempt}}


def write_goal(order: GoalOrder | CancelOrder) -> dict[str, object]:
    """The value of ``goal`` that gives a goal, or takes it back."""
    if isinstance(order, CancelOrder):
        return {"cancel": {"id": order.goal_id}}
    goal = order.goal
    fields = {"id": goal.goal_id, "kind": goal.kind, "x": goal.x, "y": goal.y}
    return {"set": {**fields, "ch": order.challenge, "until": order.until_s}}


def write_command(value: Mapping[str, object], name: str = names.COMMAND) -> bytes:
    """A command as the IoT Agent puts it on the robot's topic."""
    return orjson.dumps({name: value})


def write_desired(desired: Literal["stopped", "run"], ids: Iterable[str]) -> bytes:
    """The retained desired state on ``/{robot}/iveg/desired``."""
    return orjson.dumps({"desired": desired, "ids": list(ids)})
