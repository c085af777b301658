"""Names of the latency table: segments of the data path, data, windows, reasons.

A segment lies between two places where a message is timed; JSON and columns call it
``hop`` (``domain.hops`` has what is judged healthy or not).
"""

from typing import Final, Literal, get_args

from iveg.domain.observations import (
    DetectionFrame,
    LaserScan,
    Observation,
    Odometry,
)

Segment = Literal["uplink", "fiware", "robot_orion", "iveg", "screen"]
"""``uplink`` Δt₁: the robot's stamp to iVeg's own reading of the broker; ``fiware``
Δt₂: from there to Orion's notification at the boundary; ``robot_orion`` both as one
number; ``iveg`` Δt₃: whichever copy was first, to the decision; ``screen`` Δt₄: from
there to the frame that a page has drawn."""
SEGMENTS: Final[tuple[Segment, ...]] = get_args(Segment)

Data = Literal["odometry", "detections", "lidar"]
"""The paper's three rows; its "YOLOx" is ``detections``."""
DATA: Final[tuple[Data, ...]] = get_args(Data)

Window = Literal["1min", "15min", "24h"]
WINDOW_S: Final[dict[Window, float]] = {"1min": 60.0, "15min": 900.0, "24h": 86400.0}

Exclusion = Literal[
    "no_stamp",
    "repeated_stamp",
    "clock_jump",
    "clock_untrusted",
    "stale_stamp",
    "negative",
    "page_nonsense",
]
"""Why a message is not in the statistics of a hop; each is counted.

``clock_jump``: its stamp contradicts what the clock was just proven to be;
``clock_untrusted``: how far that clock is off is not known well enough;
``stale_stamp``: older than anything can be on its way; ``negative``: it would have
arrived before it left; ``page_nonsense``: a page told a moment that cannot be."""

STAMP_S: Final = 0.001
"""Resolution of a stamp (s): what lies below zero by less is zero."""
LONGEST_S: Final = 60.0
"""A longer time is not counted: the stamp is wrong, or the message was replayed."""

_DATA: Final[dict[type, Data]] = {
    Odometry: "odometry",
    DetectionFrame: "detections",
    LaserScan: "lidar",
}


def data_of(kind: type[Observation]) -> Data | None:
    """The row of the table that a kind of observation belongs to; None for no row."""
    return _DATA.get(kind)
