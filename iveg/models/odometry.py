"""Stored poses and speeds of robots."""

from dataclasses import asdict

from iveg.domain.records import OdometryRecord
from iveg.domain.stamps import format_stamp
from iveg.models.base import Model


class OdometryRow(Model):
    """Pose in ``map`` (m, rad), speed (m/s, rad/s), speed limit, margin of a robot."""

    at: str
    robot_id: str
    x: float
    y: float
    yaw: float
    linear: float
    angular: float
    limit_factor: float
    applied_factor: float | None
    link: str | None
    margin_m: float | None
    late: bool

    @classmethod
    def of_record(cls, record: OdometryRecord) -> "OdometryRow":
        """As it was kept."""
        return cls(**asdict(record) | {"at": format_stamp(record.at)})
