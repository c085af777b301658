"""Scans that wait to be read: identity orders them, and numbers are for eyes."""

from collections.abc import Mapping
from functools import partial

from iveg.domain.errors import UnreadableError
from iveg.domain.observations import LaserScan, Origin, UnreadScan
from iveg.ngsi import names, payloads
from iveg.ngsi.codec.attributes import Readers, read_attributes
from iveg.ngsi.codec.fields import read_origin, refuse_unplaced
from iveg.ngsi.codec.scans import compact


def _unread_scan(
    name: str, robot_id: str, attributes: Mapping[str, object]
) -> UnreadScan:
    """A scan by its identity alone."""
    header = attributes.get(names.LIDAR_HEADER)
    origin = Origin()
    if header is not None:
        origin = read_origin(payloads.OriginFields.model_validate(header))
        refuse_unplaced(header)
    kept = {name: compact(attributes[name]), names.LIDAR_HEADER: header}
    return UnreadScan(robot_id, origin, partial(_read, robot_id, kept))


def _read(robot_id: str, attributes: Mapping[str, object]) -> LaserScan:
    """The scan.

    Raises:
        UnreadableError: it is none.
    """
    reading = read_attributes(robot_id, attributes)
    for scan in reading.observations:
        if isinstance(scan, LaserScan):
            return scan
    (problem,) = reading.problems
    raise UnreadableError(problem.reason, problem.detail)


UNREAD: Readers = {
    name: partial(_unread_scan, name) for name in (names.LIDAR, "laser_scan")
}
"""Readers that leave scans to those who draw them."""
