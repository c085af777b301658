"""Codec between the wire and the domain, without I/O.

``read_…`` converts bytes to observations; ``write_…`` is its inverse.
"""

from iveg.domain.stamps import format_stamp, parse_stamp
from iveg.ngsi.codec.feedback import (
    read_feedback,
    read_peer_scan,
    write_feedback,
    write_peer_scan,
)
from iveg.ngsi.codec.fields import MAX_DEPTH, ReadResult, UnreadPart, load_json
from iveg.ngsi.codec.incoming import (
    read_answer,
    read_attributes,
    read_entity,
    read_measure,
    read_notification,
)
from iveg.ngsi.codec.orders import (
    Order,
    ReleaseOrder,
    ResumeOrder,
    StopOrder,
    UnusableOrder,
    read_desired_state,
    read_goal,
    read_order,
    write_command,
    write_desired,
    write_order,
)
from iveg.ngsi.codec.outgoing import (
    write_answer,
    write_climate,
    write_heartbeat,
    write_measure,
)

__all__ = [
    "MAX_DEPTH",
    "Order",
    "ReadResult",
    "ReleaseOrder",
    "ResumeOrder",
    "StopOrder",
    "UnreadPart",
    "UnusableOrder",
    "format_stamp",
    "load_json",
    "parse_stamp",
    "read_answer",
    "read_attributes",
    "read_desired_state",
    "read_entity",
    "read_feedback",
    "read_goal",
    "read_measure",
    "read_notification",
    "read_order",
    "read_peer_scan",
    "write_answer",
    "write_climate",
    "write_command",
    "write_desired",
    "write_feedback",
    "write_heartbeat",
    "write_measure",
    "write_order",
    "write_peer_scan",
]
