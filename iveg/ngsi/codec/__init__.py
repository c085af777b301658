"""Between the wire and the domain, both ways, without I/O.

``read_…`` takes bytes to observations; ``write_…`` is its inverse.
"""

from iveg.domain.stamps import format_stamp, parse_stamp
from iveg.ngsi.codec.attributes import IsPast, read_attributes
from iveg.ngsi.codec.backfill import read_backfill, write_backfill
from iveg.ngsi.codec.commands import (
    write_command,
    write_desired,
    write_goal,
    write_release,
    write_resume,
    write_stop,
)
from iveg.ngsi.codec.feedback import read_feedback
from iveg.ngsi.codec.feedback_writer import FeedbackWriter, write_feedback
from iveg.ngsi.codec.incoming import read_entity, read_notification
from iveg.ngsi.codec.measures import read_answer, read_measure
from iveg.ngsi.codec.peer_scans import read_peer_scan, write_peer_scan
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
from iveg.ngsi.codec.unread import UNREAD
from iveg.ngsi.codec.untrusted import MAX_DEPTH, ReadResult, UnreadPart, load_json

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
    "read_backfill",
    "read_entity",
    "read_feedback",
    "read_measure",
    "read_notification",
    "read_peer_scan",
    "write_answer",
    "write_backfill",
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
