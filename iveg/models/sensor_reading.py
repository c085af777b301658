"""The newest readings of a robot's small sensors."""

from typing import Any, get_type_hints

from pydantic import Field, create_model

from iveg.domain.kinds import SENSED, Kind
from iveg.domain.observations import Instant
from iveg.domain.quantities import quantities_of, value_of
from iveg.domain.robot_state import RobotState
from iveg.models.base import Model


class SensorReading(Model):
    """The newest reading of a small sensor; its quantities by name."""

    age_s: float | None


def _reading_model(kind: Kind) -> type[SensorReading]:
    """The model of a small sensor: the quantities of its observation, and its age."""
    types = get_type_hints(kind.of)
    members: dict[str, Any] = {
        name: (types[name], Field(description=f"{one.meaning} ({one.unit})"))
        for name, one in quantities_of(kind.of).items()
    }
    return create_model(
        kind.of.__name__, __base__=SensorReading, __doc__=kind.of.__doc__, **members
    )


READINGS = {kind.name: _reading_model(kind) for kind in SENSED}


def newest_reading(robot: RobotState, kind: Kind, now: Instant) -> SensorReading | None:
    """What a small sensor said last; None before the first."""
    read = robot.sensed.get(kind.of)
    if read is None:
        return None
    age_s = None if read.at is None else round(now.mono - read.at.mono, 1)
    return READINGS[kind.name](**value_of(read.observation), age_s=age_s)
