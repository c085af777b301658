"""STOP, from a person's hand to a measured standstill (docs/safety.md, "STOP")."""

from iveg.domain.stop.commands import (
    CommandState,
    FollowedCommand,
    Press,
    State,
    Times,
    believe,
)
from iveg.domain.stop.machine import STEPS, Step, StopMachine
from iveg.domain.stop.status import (
    FIWARE_PAUSE_S,
    STANDING_RESEND_S,
    Changed,
    Closed,
    DesiredRecord,
    Effect,
    Event,
    Key,
    OffTable,
    SendOnce,
    SendStop,
    SetDesiredState,
)

__all__ = [
    "FIWARE_PAUSE_S",
    "STANDING_RESEND_S",
    "STEPS",
    "Changed",
    "Closed",
    "CommandState",
    "DesiredRecord",
    "Effect",
    "Event",
    "FollowedCommand",
    "Key",
    "OffTable",
    "Press",
    "SendOnce",
    "SendStop",
    "SetDesiredState",
    "State",
    "Step",
    "StopMachine",
    "Times",
    "believe",
]
