"""Sensors that say one small object now and then: one row each, both ways.

A row gives the sensor its device, its attribute, its subscription and its place on the
direct transport; whoever adds one writes no other line of this language.  Odometry,
scans, detections and reports have readers of their own (``codec``).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field

from iveg.domain.observations import Battery, Observation, Origin
from iveg.ngsi.payloads import OriginFields


class BatteryValue(OriginFields):
    """``battery``."""

    percentage: Annotated[float, Field(ge=0, le=1)] | None = None
    charging: bool | None = None
    voltage: Annotated[float, Field(ge=0, le=1e4)] | None = None


def _read_battery(robot_id: str, origin: Origin, value: Any) -> Battery:
    return Battery(robot_id, origin, value.percentage, value.charging, value.voltage)


def _write_battery(battery: Any) -> dict[str, Any]:
    return {
        "percentage": battery.percentage,
        "charging": battery.charging,
        "voltage": battery.voltage,
    }


@dataclass(frozen=True, slots=True)
class Sensor:
    """One row.

    Attributes:
        of: What it observes.
        suffix: Of its device and topic, after the robot's id.
        attribute: Of the robot's entity; its value is one object with the origin.
        value: That object on the wire.
        read: Robot, origin and value → observation; ``write`` is its inverse.
    """

    of: type[Observation]
    suffix: str
    attribute: str
    value: type[OriginFields]
    read: Callable[[str, Origin, Any], Observation]
    write: Callable[[Any], dict[str, Any]]


SENSORS = (
    Sensor(Battery, "_battery", "battery", BatteryValue, _read_battery, _write_battery),
)
SENSOR_OF: Mapping[type, Sensor] = {sensor.of: sensor for sensor in SENSORS}
