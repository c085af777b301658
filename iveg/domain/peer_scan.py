"""A scan as it is sent to peers: 72 beams all round, for their own costmaps.

A beam is 5° wide and as long as the shortest ray in it, so only places that the laser
saw to be free are free.  If any ray in it says nothing, the beam says nothing.
"""

import math
from dataclasses import dataclass, replace
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, ConfigDict, Field, Strict

from iveg.domain.geometry import Pose2D
from iveg.domain.observations import LaserScan, Origin
from iveg.domain.wire import MaxRange, Text, digits

BEAMS: Final = 72
PLACES: Final = 10
"""Parts of a beam across; the message says in which part its shortest ray was."""
OLDEST_S: Final = 2.0
"""Greatest age of a scan that is sent (s)."""
_WIDTH = math.tau / BEAMS
_CENTIMETRE = 100.0
_USED_FROM_M = 0.01
"""Length below which a beam says nothing (m)."""
_ROUNDED = 0.05
"""Rounding error of a driver, as a share of the angle between two rays (1)."""
SAYS_NOTHING = np.float32(0.0)

_Floats = NDArray[np.float32]
_LONGEST_ROBOT_M = 5.0
"""Greatest distance of a laser from ``base_link``, along x or y (m)."""


def _on_a_robot(mount: Pose2D) -> Pose2D:
    if max(abs(mount.x), abs(mount.y)) > _LONGEST_ROBOT_M:
        raise ValueError("a laser beyond any robot")
    return mount


@dataclass(frozen=True, slots=True, eq=False)
class PeerScan:
    """One message on ``/{robot_id}/iveg/peer_scan``.

    Attributes:
        pose: Pose of the peer in ``map``, when it scanned.
        age_s: Age of the scan when this was sent (s).
        mount: The laser's pose in ``base_link``.
        range_max: Longest range that counts (m).
        ranges: Shape (72,) (m), the first beam from −π on; ``inf``: nothing came back,
            0: the beam says nothing.
        places: Shape (72,): part of the beam in which its range was measured.
    """

    __pydantic_config__ = ConfigDict(arbitrary_types_allowed=True)

    robot_id: Text
    origin: Origin
    pose: Annotated[Pose2D, Field(alias="robot_pose")]
    age_s: Annotated[float, Strict(), Field(ge=0, le=OLDEST_S), digits(3)]
    mount: Annotated[Pose2D, AfterValidator(_on_a_robot)]
    range_max: Annotated[MaxRange, digits(3)]
    ranges: _Floats
    places: NDArray[np.uint8]

    def ended(self) -> NDArray[np.bool_]:
        """Mask of the beams that ended at something."""
        return (self.ranges >= _USED_FROM_M) & (self.ranges <= self.range_max)

    def returns(self) -> _Floats:
        """Returns in ``map``; shape (m, 2), (m)."""
        sensor, ended = self.pose.compose(self.mount), self.ended()
        across = (self.places[ended] + 0.5) / PLACES
        bearing = sensor.yaw - math.pi + _WIDTH * (np.flatnonzero(ended) + across)
        lengths = self.ranges[ended]
        return np.stack(
            (
                sensor.x + lengths * np.cos(bearing),
                sensor.y + lengths * np.sin(bearing),
            ),
            axis=1,
        ).astype(np.float32)

    def without(self, refused: NDArray[np.bool_]) -> "PeerScan":
        """A copy in which beams with a refused return say nothing.

        ``refused``: Mask of the returns, shape (m,).
        """
        ranges = self.ranges.copy()
        ranges[np.flatnonzero(self.ended())[refused]] = SAYS_NOTHING
        return replace(self, ranges=ranges)

    def scan(self) -> LaserScan:
        """The beams as a sweep; their exact returns are in ``returns``."""
        return LaserScan(
            self.robot_id,
            self.origin,
            _WIDTH / 2 - math.pi,
            _WIDTH,
            _USED_FROM_M,
            self.range_max,
            self.mount,
            self.ranges,
        )


def peer_scan_of(scan: LaserScan, pose: Pose2D, age_s: float) -> PeerScan:
    """The message for peers about a scan that was taken at ``pose`` in ``map``."""
    bearing = _bearings(scan.angle_increment)
    ray = _nearest_rays(scan, bearing)
    lengths = np.where(scan.speaks(), scan.ranges, SAYS_NOTHING)
    beams = np.where(ray < 0, SAYS_NOTHING, lengths[ray])
    shortest = beams.argmin(axis=1)[:, None]
    ranges = np.take_along_axis(beams, shortest, 1)[:, 0]
    ray = np.take_along_axis(ray, shortest, 1)[:, 0]
    at = scan.angle_min + scan.angle_increment * ray - bearing[:, 0]
    # The nearest ray of a bearing at an edge may lie just outside the beam.
    aside = (at + math.pi) % math.tau - math.pi
    places = np.clip(np.floor(aside / _WIDTH * PLACES), 0, PLACES - 1)
    return PeerScan(
        scan.robot_id,
        scan.origin,
        pose,
        age_s,
        scan.mount,
        scan.range_max,
        # Down, so that rounding frees nothing.
        (np.floor(ranges * _CENTIMETRE) / _CENTIMETRE).astype(np.float32),
        places.astype(np.uint8),
    )


def _bearings(increment: float) -> NDArray[np.float64]:
    """Bearings in each beam, both edges among them, two for each ray or more (rad)."""
    parts = 2 * max(1, math.ceil(_WIDTH / abs(increment)))
    edges = np.arange(BEAMS)[:, None] * _WIDTH - math.pi
    return edges + np.linspace(0.0, _WIDTH, parts + 1)[None, :]


def _nearest_rays(scan: LaserScan, bearing: NDArray[np.float64]) -> NDArray[np.intp]:
    """Number of the ray nearest to each bearing; -1: none is near."""
    step, turn = scan.angle_increment, math.tau / abs(scan.angle_increment)
    place = ((bearing - scan.angle_min) / step) % turn
    ray = np.floor(place + 0.5).astype(np.intp)
    ray[place > turn - 0.5] = 0
    # A full turn of rays closes, but for the rounding of the driver's numbers.
    last = scan.ranges.size - 1
    ray[(ray > last) & (place < last + 0.5 + _ROUNDED)] = last
    ray[ray > last] = -1
    return ray
