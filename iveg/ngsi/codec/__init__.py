"""Between the wire and the domain, both ways, without I/O.

``read_…`` takes bytes to observations; ``write_…`` is its inverse.
"""

from iveg.domain.stamps import format_stamp, parse_stamp
from iveg.ngsi.codec.attributes import IsPast, read_attributes
from iveg.ngsi.codec.feedback import FeedbackWriter, read_feedback, write_feedback
from iveg.ngsi.codec.fields import MAX_DEPTH, ReadResult, UnreadPart, load_json
from iveg.ngsi.codec.incoming import (
    UNREAD,
    read_answer,
    read_entity,
    read_measure,
    read_notification,
    read_peer_scan,
    write_command,
    write_desired,
    write_goal,
    write_peer_scan,
    write_release,
    write_resume,
    write_stop,
)
from iveg.ngsi.codec.reports import (
    write_answer,
    write_climate,
    write_detections,
    write_goal_answer,
    write_heartbeat,
    write_navigation,
    write_odometry,
    write_safety,
    write_scan,
    write_sensed,
    write_unplaced,
)

__all__ = [
    "MAX_DEPTH",
    "UNREAD",
    "FeedbackWriter",
    "IsPast",
    "ReadResult",
    "UnreadPart",
    "format_stamp",
    "load_json",
    "parse_stamp",
    "read_answer",
    "read_attributes",
    "read_entity",
    "read_feedback",
    "read_measure",
    "read_notification",
    "read_peer_scan",
    "write_answer",
    "write_climate",
    "write_command",
    "write_desired",
    "write_detections",
    "write_feedback",
    "write_goal",
    "write_goal_answer",
    "write_heartbeat",
    "write_navigation",
    "write_odometry",
    "write_peer_scan",
    "write_release",
    "write_resume",
    "write_safety",
    "write_scan",
    "write_sensed",
    "write_stop",
    "write_unplaced",
]
