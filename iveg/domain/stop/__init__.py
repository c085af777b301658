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
from iveg.domain.stop.episode import FRESH_S, MOST_HOLDS, STALE_S, UNCONFIRMED_S
from iveg.domain.stop.machine import StopMachine
from iveg.domain.stop.people import CRAWL_SPEED, RELEASE_S
from iveg.domain.stop.sends import FIWARE_PAUSE_S, STANDING_RESEND_S
from iveg.domain.stop.standstill import (
    STANDING_FRESH_S,
    STANDING_S,
    STANDING_SAMPLES,
)
from iveg.domain.stop.table import STEPS, SendRoad, State, Transport
from iveg.domain.stop.wanted import Wanted

__all__ = [
    "CRAWL_SPEED",
    "FIWARE_PAUSE_S",
    "FRESH_S",
    "MOST_HOLDS",
    "RELEASE_S",
    "STALE_S",
    "STANDING_FRESH_S",
    "STANDING_RESEND_S",
    "STANDING_S",
    "STANDING_SAMPLES",
    "STEPS",
    "UNCONFIRMED_S",
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
