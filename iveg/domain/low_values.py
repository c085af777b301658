"""Which small sensors of robots say something low; hysteresis, so that none flaps."""

from collections.abc import Iterable

from iveg.domain.events import Condition, Slot
from iveg.domain.kinds import SENSED, Low
from iveg.domain.observations import Observation
from iveg.domain.robot_state import RobotState


class LowValues:
    """Remembers what is low until it is high enough again."""

    def __init__(self) -> None:
        self._low: set[tuple[str, str]] = set()

    def conditions(self, robot: RobotState) -> Iterable[Condition]:
        """Low values of one robot at present."""
        robot_id = robot.robot_id
        for kind in SENSED:
            read = robot.sensed.get(kind.of)
            low = kind.sensor.low if kind.sensor else None
            if low is None or read is None:
                continue
            value = _worrying(low, read.observation)
            if value is not None and self._is_low((robot_id, kind.name), low, value):
                slots: dict[str, Slot] = {"robot": robot_id, "level": round(value, 2)}
                yield Condition(
                    "P3", f"alert.{kind.name}_low", robot_id, robot_id, slots
                )

    def _is_low(self, key: tuple[str, str], low: Low, value: float) -> bool:
        is_low = value <= low.below or (key in self._low and value < low.above)
        (self._low.add if is_low else self._low.discard)(key)
        return is_low


def _worrying(low: Low, observation: Observation) -> float | None:
    """The value that may be low; None where that would be nothing wrong."""
    if low.unless is not None and getattr(observation, low.unless):
        return None
    value: float | None = getattr(observation, low.value)
    return value
