"""The pipeline on a virtual clock, without network, disk and operator.

Equal messages at equal times give equal decisions on any machine, so that a rule can be
tried on recorded or simulated messages.
"""

from collections.abc import Iterator
from itertools import count

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import Feedback
from iveg.domain.fleet import FleetDescription
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import Instant, Received
from iveg.domain.peer_scan import PeerScan
from iveg.domain.records import DecisionRecord, Record
from iveg.domain.transports import DIRECT
from iveg.ngsi import codec
from iveg.pipeline import Choices, Pipeline
from iveg.vital.operators import Kept, KeptChoices
from iveg.vital.ports import Ports

START = Instant(0.0, 1_700_000_000.0)


class VirtualPipeline:
    """Pipeline with ports that keep its output.

    Args:
        fleet, greenhouse, rule: As at a start of iVeg.

    Implements ``vital.ports.FleetPort``, ``StopJournal`` and ``RecordSink``.

    Attributes:
        now: Its time.
        feedback: Feedback to robots, oldest first.
        decisions: Newest state of all decisions, by id.
        parts: The pipeline.
    """

    def __init__(
        self,
        fleet: FleetDescription,
        greenhouse: Greenhouse,
        rule: DetectionRule,
    ) -> None:
        # Counted, not random: equal runs must give equal ids.
        ids = count(1)
        self.now = START
        self.feedback: list[Feedback] = []
        self.decisions: dict[str, DecisionRecord] = {}
        ports = Ports(
            self,
            {},
            self,
            self,
            lambda: self.now,
            lambda: f"{next(ids):026d}",
            lambda: "ok",
        )
        kept = KeptChoices(
            [rule],
            self.keep,
            Kept({}, self.keep),
            Kept({}, self.keep),
        )
        self.parts = Pipeline(fleet, greenhouse, ports, Choices(kept))

    def move(self, seconds: float) -> Instant:
        """Set the clock to a time after the start (s)."""
        self.now = START.later(seconds)
        return self.now

    def hear(self, topic: str, payload: bytes) -> None:
        """Take a robot's own message as if read from the broker."""
        for received in read_direct(topic, payload, self.now):
            self.parts.ingest.enqueue(received)

    # --- its ports ----------------------------------------------------------------

    def publish_feedback(self, feedback: Feedback) -> None:
        """Keep the feedback."""
        self.feedback.append(feedback)

    def publish_peer_scan(self, scan: PeerScan) -> None:
        """Ignore; no robot draws a costmap here."""

    def enqueue(self, record: Record) -> None:
        """Keep a decision; ignore other records."""
        if isinstance(record, DecisionRecord):
            self.decisions[record.decision_id] = record

    async def keep(self, *_: object, **named: object) -> None:
        """Ignore; no operator chooses or orders anything here."""

    flushed = set_desired_state = log_desired = keep


def read_direct(topic: str, payload: bytes, now: Instant) -> Iterator[Received]:
    """Decode a robot's own message as the server does."""
    reading = codec.read_measure(topic.split("/")[2], payload)
    assert reading.problems == ()  # noqa: S101 - both ends are ours
    for observation in reading.observations:
        yield Received(observation, now, DIRECT.id)
