"""Messages about goals, as robots receive them."""

from typing import Annotated

from pydantic import Field, ValidationError

from iveg.domain.errors import UnreadableError
from iveg.domain.goals import CancelOrder, Goal, GoalKind, GoalOrder
from iveg.ngsi import names, payloads
from iveg.ngsi.codec import load_json


class _Named(payloads.Wire, extra="forbid"):
    id: Annotated[payloads.Text, Field(min_length=1)]


class _Set(_Named):
    kind: GoalKind
    x: payloads.Metres
    y: payloads.Metres
    ch: Annotated[str, Field(min_length=1)]
    until: float


class _Value(payloads.Wire, extra="forbid"):
    set: _Set | None = None
    cancel: _Named | None = None


def read_goal(payload: bytes) -> GoalOrder | CancelOrder | None:
    """Read a message of ``/{apikey}/{robot}/cmd`` that is about a goal.

    Returns:
        None for anything else, and for whatever might be a STOP.
    """
    if b"stop" in payload.lower():
        return None
    try:
        message = load_json(payload)
        if not isinstance(message, dict) or message.keys() != {names.GOAL}:
            return None
        value = _Value.model_validate(message[names.GOAL])
    except (UnreadableError, ValidationError):
        return None
    if value.cancel is not None and value.set is None:
        return CancelOrder(value.cancel.id)
    if value.set is None or value.cancel is not None:
        return None
    order = value.set
    goal = Goal(order.id, order.kind, order.x, order.y)
    return GoalOrder(goal, order.ch, order.until)
