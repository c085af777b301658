"""Monitoring of other equipment, beside the rule loop: no rule rests on it.

Orion's notifications of equipment come straight here and never wait in the queue of
robots' observations.
"""

from iveg.domain.equipment import Equipment, State, Tile
from iveg.domain.observations import EntityReading, Instant
from iveg.domain.records import MeasurementRecord
from iveg.vital import topics
from iveg.vital.core import Core
from iveg.vital.event_log import READING_PERIOD_S

PART = "equipment"
TICK_S = 1.0


class EquipmentMonitor:
    """Takes in values of equipment, keeps them, and reports faults.

    Attributes:
        equipment: All tiles with their newest values.
    """

    def __init__(self, core: Core, equipment: Equipment) -> None:
        self.equipment = equipment
        self._sink, self._event_log = core.ports.sink, core.event_log
        self._supervision = core.supervision
        self._kept_at: dict[str, float] = {}
        self._states: tuple[State, ...] = ()

    def receive(self, reading: EntityReading, at: Instant) -> None:
        """Take in Orion's reading of an entity."""
        for tile in self.equipment.read(reading.entity_id, reading.attributes, at):
            self._keep(tile, at)
        self._event_log.changed(topics.EQUIPMENT.name)

    def tick(self, now: Instant) -> None:
        """Let time pass: a tile that is silent or beyond a limit raises an alert."""
        self._supervision.report(PART, self.equipment.conditions(now))
        states = tuple(self.equipment.state(tile, now) for tile in self.equipment.tiles)
        if states != self._states:
            self._states = states
            self._event_log.changed(topics.EQUIPMENT.name)

    def _keep(self, tile: Tile, at: Instant) -> None:
        """Record a number, once a minute."""
        value = self.equipment.status(tile).value
        kept_at = self._kept_at.get(tile.key, float("-inf"))
        # A device that sends each minute is early half of the time: a tenth of leeway.
        if value is None or at.mono - kept_at < 0.9 * READING_PERIOD_S:
            return
        self._kept_at[tile.key] = at.mono
        self._sink.enqueue(
            MeasurementRecord(
                at=at.wall,
                entity_id=tile.entity_id,
                attribute=tile.attribute,
                value=value,
                unit=tile.unit,
            )
        )
