"""The shapes of what peers' lasers saw, as robots are sent it."""

from typing import Annotated, Literal

from pydantic import Field

from iveg.domain.peer_scan import BEAMS, PLACES
from iveg.ngsi.payloads import Metres, OriginFields, Radians, Text, Wire


class MountValue(Wire):
    """A laser in ``base_link`` (m, rad): no robot is longer than twice this."""

    x: Annotated[float, Field(ge=-5, le=5)]
    y: Annotated[float, Field(ge=-5, le=5)]
    yaw: Radians


class PeerPoseValue(Wire):
    """Where a peer's ``base_link`` was (m, rad)."""

    x: Metres
    y: Metres
    yaw: Radians
    frame_id: Literal["map"]


class PeerScanValue(OriginFields):
    """``/{robot}/iveg/peer_scan``."""

    robot_id: Text
    robot_pose: PeerPoseValue
    age_s: Annotated[float, Field(ge=0, le=2)]
    mount: MountValue
    range_max: Annotated[float, Field(gt=0, le=1e4)]
    ranges: Annotated[
        list[Annotated[float, Field(ge=0, le=1e4)] | None],
        Field(min_length=BEAMS, max_length=BEAMS),
    ]
    places: Annotated[
        list[Annotated[int, Field(ge=0, lt=PLACES)]],
        Field(min_length=BEAMS, max_length=BEAMS),
    ]
