"""What people's safety needs is read from MQTT without FIWARE."""

import pytest

from iveg.adapters.direct import DirectReader
from iveg.domain.kinds import Scope
from iveg.domain.observations import (
    CommandAnswer,
    DetectionFrame,
    LaserScan,
    Observation,
    Odometry,
    Received,
    SafetyReport,
    kind_of,
)
from iveg.domain.world import World
from iveg.ngsi import codec
from iveg.vital.ingest import Ingest
from tests.builders import (
    detection,
    detection_frame,
    ignore,
    odometry,
    safety_report,
    scan,
)
from tests.fakes.clock import FakeClock


class Bench(Ingest):
    """A reader, and all that it offers and rejects."""

    def __init__(self, scope: Scope = "all") -> None:
        self.offered: list[Received] = []
        self.rejected: list[tuple[str, str, str]] = []
        self.clock = FakeClock()
        super().__init__(World(("AGI",)), ignore, ignore)
        self.reader = DirectReader("iveg", ["AGI"], self.clock, self, scope, ignore)

    def read(self, topic: str, observation: Observation) -> None:
        self.reader.read(topic, codec.write_measure(observation))

    def enqueue(self, received: Received) -> None:
        self.offered.append(received)

    def reject(self, source: str, reason: str, detail: str = "") -> None:
        self.rejected.append((source, reason, detail))


def test_looks_reports_answers_and_poses_come_in_on_the_direct_transport() -> None:
    bench = Bench()
    answer = b'{"cmd": {"id": "01A", "r": "LATCHED", "holds": []}}'

    bench.read("/iveg/AGI_yolox_bounding_boxes/attrs", detection_frame())
    bench.read("/iveg/AGI_safety/attrs", safety_report())
    bench.reader.read("/iveg/AGI/cmdexe", answer)
    bench.read("/iveg/AGI_odom/attrs", odometry())
    bench.read("/AGI/iveg/odom", odometry())

    kinds = [type(one.observation) for one in bench.offered]
    assert kinds == [DetectionFrame, SafetyReport, CommandAnswer, Odometry, Odometry]
    assert {one.transport for one in bench.offered} == {"direct"}


def test_of_scans_at_30_hz_every_second_is_read() -> None:
    bench = Bench()

    for turn in range(30):
        bench.clock.now = turn / 30
        bench.read("/AGI/iveg/lidar2D", scan())
        bench.read("/AGI/iveg/odom", odometry())

    read = [kind_of(one.observation) for one in bench.offered]
    assert (read.count(LaserScan), read.count(Odometry)) == (15, 30)


@pytest.mark.parametrize(
    ("topic", "sparse"), [("/iveg/AGI_safety/attrs", True), ("/AGI/iveg/safety", False)]
)
def test_a_report_says_how_many_its_topic_has(topic: str, sparse: bool) -> None:
    bench = Bench("safety")

    bench.read(topic, safety_report())

    assert [one.sparse for one in bench.offered] == [sparse]


def test_a_scope_of_safety_leaves_poses_and_scans_to_orion() -> None:
    bench = Bench("safety")

    bench.read("/iveg/AGI/attrs", odometry())
    bench.read("/iveg/AGI/attrs", scan())

    assert bench.offered == []


def test_f30_an_apostrophe_that_orion_refuses_costs_nobody_their_ring() -> None:
    bench = Bench()
    frame = detection_frame("AGI", detection("farmer's wife", 1.0))

    bench.read("/iveg/AGI_yolox_bounding_boxes/attrs", frame)

    assert len(bench.offered) == 1


def test_what_the_broker_had_retained_is_no_news_and_counted_by_name() -> None:
    bench = Bench()

    for topic in ("/iveg/AGI_odom/attrs", "/iveg/AGI/cmdexe", "/other/topic"):
        bench.reader.refuse_stored(topic, codec.write_measure(odometry()))

    assert bench.offered == []
    assert bench.rejected == [
        ("AGI", "retained", "/iveg/AGI_odom/attrs"),
        ("AGI", "retained", "/iveg/AGI/cmdexe"),
    ]
