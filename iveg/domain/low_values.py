"""Low values of small sensors, with hysteresis so that no alert flaps."""

from collections.abc import Iterable

from iveg.domain.events import Condition
from iveg.domain.kinds import SENSED, Low
from iveg.domain.observations import Observation
from iveg.domain.robot_state import RobotState


class LowValues:
    """Remembers each low value until it is at its upper bound again."""

    def __init__(self) -> None:
        self._low: set[tuple[str, str]] = set()

    def conditions(self, robot: RobotState) -> Iterable[Condition]:
        """Conditions of the low values of one robot."""
        robot_id = robot.robot_id
        for kind in SENSED:
            read = robot.sensed.get(kind.type_)
            low = kind.sensor.low if kind.sensor else None
            if low is None or read is None:
                continue
            value = _worrying(low, read.observation)
            if value is not None and self._is_low((robot_id, kind.name), low, value):
                yield Condition.of_robot(
                    "P3", f"alert.{kind.name}_low", robot_id, level=round(value, 2)
                )

    def _is_low(self, key: tuple[str, str], low: Low, value: float) -> bool:
        # Exclusive above: a value at the upper bound is high enough.
        is_low = value <= low.below or (key in self._low and value < low.above)
        (self._low.add if is_low else self._low.discard)(key)
        return is_low


def _worrying(low: Low, observation: Observation) -> float | None:
    """Value to compare; None where a low value is no fault."""
    if low.unless is not None and getattr(observation, low.unless):
        return None
    value: float | None = getattr(observation, low.value)
    return value
