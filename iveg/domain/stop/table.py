"""The states of a STOP and every step that leads from one to another.

::

    RUNNING ──> REQUESTED ──> SENT ──> DELIVERED ──> STANDING <──> STALE
       ^            │  │        │          └──> STILL_MOVING ──┘ │
       │            │  └────────┴─> UNCONFIRMED ─────────────────┤
       │            └<── moved, hold lost, release unconfirmed ──┤
       └── READY <────────────── RELEASING <─────────────────────┘

A step that is not in the table does not happen.
"""

from collections.abc import Mapping
from typing import Literal

State = Literal[
    "RUNNING",
    "REQUESTED",
    "SENT",
    "DELIVERED",
    "STANDING",
    "UNCONFIRMED",
    "STILL_MOVING",
    "STALE",
    "RELEASING",
    "READY",
]
Transport = Literal["direct", "fiware"]
"""How an order gets to a robot: straight over MQTT, or through Orion and the agent."""
SendRoad = Transport

STEPS: Mapping[State, frozenset[State]] = {
    "RUNNING": frozenset({"REQUESTED", "DELIVERED", "RELEASING"}),
    "REQUESTED": frozenset({"REQUESTED", "SENT", "DELIVERED", "UNCONFIRMED"}),
    "SENT": frozenset({"REQUESTED", "DELIVERED", "UNCONFIRMED"}),
    "DELIVERED": frozenset({"REQUESTED", "STANDING", "STILL_MOVING"}),
    "UNCONFIRMED": frozenset({"REQUESTED", "DELIVERED", "STANDING"}),
    "STILL_MOVING": frozenset({"REQUESTED", "STANDING"}),
    "STANDING": frozenset({"REQUESTED", "STALE", "RELEASING"}),
    "STALE": frozenset({"REQUESTED", "STANDING"}),
    "RELEASING": frozenset({"REQUESTED", "READY", "STANDING", "RUNNING"}),
    "READY": frozenset({"REQUESTED", "RUNNING", "RELEASING", "DELIVERED"}),
}
