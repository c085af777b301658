"""STOP, from a person's hand to a measured standstill (docs/safety.md, "STOP")."""

from iveg.domain.stop.commands import (
    FollowedCommand,
    Press,
    State,
    Times,
)
from iveg.domain.stop.machine import STEPS, StopMachine
from iveg.domain.stop.status import (
    Changed,
    Closed,
    DesiredRecord,
    Effect,
    Key,
    OffTable,
    SendOnce,
    SendStop,
    SetDesiredState,
)

__all__ = [
    "STEPS",
    "Changed",
    "Closed",
    "DesiredRecord",
    "Effect",
    "FollowedCommand",
    "Key",
    "OffTable",
    "Press",
    "SendOnce",
    "SendStop",
    "SetDesiredState",
    "State",
    "StopMachine",
    "Times",
]
