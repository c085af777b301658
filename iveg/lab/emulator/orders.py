"""Fault orders to emulated robots."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from iveg.domain.errors import UnreadableError
from iveg.ngsi.codec.fields import first_complaint

Metres = Annotated[float, Field(ge=-1e6, le=1e6)]


class _Order(BaseModel):
    model_config = ConfigDict(
        strict=True, extra="forbid", allow_inf_nan=False, frozen=True
    )


class OrderPlace(_Order):
    """A position in ``map`` (m)."""

    x: Metres
    y: Metres


class FaultOrder(_Order):
    """Faults of one robot; an absent field changes nothing.

    Attributes:
        mute: Nothing that it publishes arrives, without an error.
        deaf: Ignores iVeg's speed limits.
        clock_offset_s: Its wall clock is this far ahead (s).
        local_hold: Its red button or bumper is pressed.
        release_locally: The crew lifts local holds and the boot hold.
        thing: Something there is taken for a person where its camera has it in view, as
            surely and seldom as a person; null ends that.
        hide_people: Its camera detects no person.
    """

    robot: str
    mute: bool | None = None
    deaf: bool | None = None
    clock_offset_s: Annotated[float, Field(ge=-1e9, le=1e9)] | None = None
    local_hold: Literal["hw", "bumper"] | None = None
    release_locally: bool = False
    thing: OrderPlace | None = None
    hide_people: bool | None = None

    def changed_by(self, order: "FaultOrder") -> "FaultOrder":
        """The faults in force after another order; fields that it names count."""
        named = {name: getattr(order, name) for name in order.model_fields_set}
        return self.model_copy(update=named)


def read_order(body: bytes) -> FaultOrder:
    """Parse one order from JSON.

    Raises:
        UnreadableError: not an order; one sentence names the field.
    """
    try:
        return FaultOrder.model_validate_json(body)
    except ValidationError as error:
        raise UnreadableError("bad_order", first_complaint(error)) from error
