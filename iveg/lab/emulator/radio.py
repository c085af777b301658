"""Faulty radio link: a robot's messages are lost, delayed, duplicated or reordered.

Deterministic for a seed.  Loss, duplicates and reordering affect telemetry (QoS 0)
alone, since TCP and QoS 1 deliver all other messages once and in order; delay affects
all messages.
"""

from dataclasses import dataclass

import numpy as np

from iveg.lab.emulator.orders import LinkFaults


@dataclass(frozen=True, slots=True)
class Packet:
    """One MQTT packet.

    Attributes:
        topic: Topic of a PUBLISH; None for a packet of another type.
        qos: 0 to 2.
        raw: The whole packet.
        receipt: Acknowledgement for QoS 1 (PUBACK); else empty.
    """

    topic: str | None
    qos: int
    raw: bytes
    receipt: bytes = b""

    @property
    def is_telemetry(self) -> bool:
        """Whether it may be lost."""
        return self.topic is not None and self.qos == 0


class Radio:
    """Decides the fate of each packet that a robot sends.

    Args:
        odometry: Topics that carry odometry.
        rng: Random source, drawn three times for each telemetry message.

    Attributes:
        faults: Faults at present.
    """

    def __init__(self, odometry: frozenset[str], rng: np.random.Generator) -> None:
        self.faults = LinkFaults()
        self._odometry = odometry
        self._rng = rng
        self._last: dict[str, Packet] = {}
        self._overtaken: dict[str, list[Packet]] = {}
        self._newest_due = 0.0

    def pass_on(self, packet: Packet, now: float) -> list[tuple[float, bytes]]:
        """Packets to send for a packet, and when (same clock as ``now``, s)."""
        if packet.topic is None:
            return [(now, packet.raw)]
        if self.faults.mute:
            return []
        if not packet.is_telemetry:
            return [(self._due(now), packet.raw)]
        out = self._disturbed(self._repeated(packet, packet.topic), packet.topic)
        return [(self._due(now), one.raw) for one in out]

    def _repeated(self, packet: Packet, topic: str) -> Packet:
        """The packet; for frozen odometry the last one that passed before the fault."""
        if topic not in self._odometry:
            return packet
        if self.faults.freeze_odometry == "repeat" and topic in self._last:
            return self._last[topic]
        self._last[topic] = packet
        return packet

    def _disturbed(self, packet: Packet, topic: str) -> list[Packet]:
        faults = self.faults
        dropped, doubled, overtaken = (self._rng.random(3) * 100.0).tolist()
        waiting = self._overtaken.pop(topic, [])
        if dropped < (faults.drop_percent or 0.0):
            return waiting
        out = [packet]
        if doubled < (faults.duplicate_percent or 0.0):
            out.append(packet)
        if overtaken < (faults.reorder_percent or 0.0) and not waiting:
            self._overtaken[topic] = out
            return []
        return out + waiting

    def _due(self, now: float) -> float:
        faults = self.faults
        late_ms = faults.delay_ms or 0.0
        if faults.jitter_ms:
            late_ms += self._rng.uniform(0.0, faults.jitter_ms)
        # One connection keeps its order; reordering is a separate fault.
        self._newest_due = max(self._newest_due, now + late_ms / 1000.0)
        return self._newest_due
