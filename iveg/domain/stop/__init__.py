"""STOP, from a person's hand to a measured standstill (safety.md §2.3)."""

from iveg.domain.stop.commands import (
    Command,
    CommandState,
    Press,
    Times,
    believe,
)
from iveg.domain.stop.effects import (
    Changed,
    Closed,
    Effect,
    SendOnce,
    SendStop,
    SetLevel,
)
from iveg.domain.stop.machine import StopMachine
from iveg.domain.stop.sends import FIWARE_PAUSE_S, STANDING_RESEND_S
from iveg.domain.stop.table import STEPS, SendRoad, State, Transport
from iveg.domain.stop.wanted import Wanted

__all__ = [
    "FIWARE_PAUSE_S",
    "STANDING_RESEND_S",
    "STEPS",
    "Changed",
    "Closed",
    "Command",
    "CommandState",
    "Effect",
    "Press",
    "SendOnce",
    "SendRoad",
    "SendStop",
    "SetLevel",
    "State",
    "StopMachine",
    "Times",
    "Transport",
    "Wanted",
    "believe",
]
