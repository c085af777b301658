"""Small sensors on a ROS 2 robot: topic and type of each, one row a sensor."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from iveg.domain.kinds import Kind, row_of
from iveg.domain.observations import UNKNOWN_ORIGIN, Battery, Observation
from iveg.ros2 import sensor_msgs, std_msgs
from iveg.ros2.schema import Message


def read_battery(state: sensor_msgs.BatteryState) -> Battery:
    """Read the state of the battery.

    ROS writes NaN for unmeasured values, and some drivers per cent instead of a share.
    """
    share: float | None = state.percentage
    if share is None or not math.isfinite(share) or not 0.0 <= share <= 100.0:
        share = None
    elif share > 1.0:
        share /= 100.0
    volts = state.voltage if math.isfinite(state.voltage) else None
    charging = {1: True, 2: False, 3: False, 4: False}
    status = charging.get(state.power_supply_status)
    return Battery("", UNKNOWN_ORIGIN, share, status, volts)


def write_battery(header: std_msgs.Header, battery: Any) -> sensor_msgs.BatteryState:
    """The inverse, for an emulated base."""
    return sensor_msgs.BatteryState(
        header, voltage=battery.voltage, percentage=battery.percentage
    )


@dataclass(frozen=True, slots=True)
class RosSensor:
    """One row.

    Attributes:
        of: What it observes; the key in ``robot.toml`` is the kind's name.
        topic: Its name by default.
        read: Message → observation.  Raises UnreadableError.
        write: Header and observation → message.
    """

    of: type[Observation]
    topic: str
    message: type[Message]
    read: Callable[[Any], Observation]
    write: Callable[[std_msgs.Header, Any], Message]

    @property
    def kind(self) -> Kind:
        """Its row among the observations."""
        return row_of(self.of)

    @property
    def every_s(self) -> float:
        """Least time between two that are sent on (s)."""
        return self.kind.sensor.every_s if self.kind.sensor else 0.0


ROS_SENSORS = {
    row.kind.name: row
    for row in (
        RosSensor(
            Battery,
            "battery_state",
            sensor_msgs.BatteryState,
            read_battery,
            write_battery,
        ),
    )
}
"""By name.  A small sensor that is missing here has no ROS 2 form."""
