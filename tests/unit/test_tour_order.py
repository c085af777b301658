"""The tour's order is the program's: a frame and a STOP pass its rows one by one.

The server and the safety machine are real, on one clock that is moved by hand; the
broker between them is a list.  ``tests/integration/test_tour.py`` has the rest, where
three programs run at once and nothing says which message a call belonged to.
"""

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from types import FrameType

import pytest

from iveg.adapters.broker_address import BrokerAddress
from iveg.adapters.direct import DirectReader
from iveg.adapters.mqtt import MqttLink
from iveg.adapters.transports import MqttTransport
from iveg.ngsi import codec, names
from tests.architecture.test_tour import DETECTION, STOP
from tests.builders import detection, detection_frame
from tests.processes import ROOT
from tests.unit.pipeline.desk import Desk, settle
from tests.unit.robot.rig import Rig

Call = tuple[str, str]
Row = tuple[str, list[str]]
ROBOTS = ("AGI", "AGII")
OUTSIDE = {
    "iveg/adapters/journal.py",
    "iveg/adapters/mqtt.py",
    "iveg/lab/embedded/iot_agent.py",
    "iveg/lab/embedded/notifier.py",
    "iveg/ngsi/codec/incoming.py",
    "iveg/pipeline/publish.py",
    "iveg/robot/hold_file.py",
    "iveg/robot/lane.py",
    "iveg/robot/node.py",
    "iveg/robot/uplink.py",
    "iveg/web/api/commands.py",
    "iveg/web/live/feed.py",
    "iveg/web/live/line.py",
    "iveg/web/notifications.py",
    "iveg/web/security/requirements.py",
    "iveg/web/views.py",
}
"""Parts of other programs, of the web and of the disk, which this stage lacks."""


class Wire(MqttLink):
    """A link whose broker is a list."""

    def __init__(self) -> None:
        super().__init__(BrokerAddress("nowhere", 1), "tour", {}, lambda *_: None)
        self.sent: list[tuple[str, bytes]] = []

    def enqueue(self, topic: str, payload: bytes, qos: int = 0) -> None:  # noqa: ARG002
        self.sent.append((topic, payload))

    async def publish(
        self,
        topic: str,
        payload: bytes,
        qos: int = 1,  # noqa: ARG002 - the port
        *,
        retain: bool = False,  # noqa: ARG002
    ) -> None:
        self.sent.append((topic, payload))


class Road:
    """A desk with a real direct transport, and AGI's safety machine driving."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.desk, self.rig, self.wire = Desk(ROBOTS), Rig(), Wire()
        transport = MqttTransport(self.wire, "iveg")
        monkeypatch.setattr(
            self.desk.fleet, "publish_feedback", transport.publish_feedback
        )
        monkeypatch.setattr(self.desk.fleet, "stop", transport.stop)
        ingest = self.desk.ingest
        self._reader = DirectReader(
            "iveg", ROBOTS, self.desk.clock, ingest.enqueue, ingest.reject
        )
        self.desk.drive("AGI")
        self.desk.drive("AGII", 1.0)
        self.rig.drive_on()

    def hear(self, topic: str, payload: bytes) -> None:
        """The server reads one message, and acts on it."""
        self._reader.read(topic, payload)
        self.desk.loop.step(self.desk.ingest.drain(), self.desk.clock())

    def report(self) -> None:
        """The newest report of the safety machine reaches the server."""
        self.rig.step()
        origin = self.desk.next_origin()
        report = replace(self.rig.reports[-1], origin=origin)
        topic = names.measure_topic("iveg", "AGI_safety")
        self.hear(topic, codec.write_safety(report))


@contextmanager
def recorded(rows: Sequence[Row]) -> Iterator[list[Call]]:
    """Calls of functions that rows name, in their order; a class for each method."""
    calls: list[Call] = []
    wanted = {(path, name) for path, names in rows for name in names}
    paths = {str(ROOT / path): path for path, _ in rows}

    def note(frame: FrameType, event: str, _: object) -> None:
        code = frame.f_code
        path = paths.get(code.co_filename)
        if event == "call" and path is not None:
            class_, _dot, _method = code.co_qualname.partition(".")
            passed = {(path, code.co_qualname), (path, class_)}
            calls.extend(passed & wanted)

    sys.setprofile(note)
    try:
        yield calls
    finally:
        sys.setprofile(None)


def misplaced(rows: Sequence[Row], calls: Sequence[Call]) -> list[Row]:
    """Rows of which nothing is called after what the row before them called."""
    at, found = 0, []
    for path, named in rows:
        passed = [(path, name) for name in named if (path, name) in calls[at:]]
        if passed:
            at = calls.index(passed[0], at)
        elif path.endswith(".py") and path not in OUTSIDE:
            found.append((path, named))
    return found


@pytest.fixture
def road(monkeypatch: pytest.MonkeyPatch) -> Road:
    return Road(monkeypatch)


def calls_of_a_detection(road: Road) -> list[Call]:
    frame = detection_frame("AGII", detection(x=1.0), origin=road.desk.next_origin())
    topic = names.measure_topic("iveg", "AGII_yolox_bounding_boxes")
    with recorded(DETECTION) as calls:
        road.hear(topic, codec.write_detections(frame))
        feedback = codec.read_feedback(road.wire.sent[-1][1])
        road.rig.hear(feedback, "AGII")
        road.report()
    return calls


async def calls_of_a_stop(road: Road) -> list[Call]:
    with recorded(STOP) as calls:
        await road.desk.commander.stop(["AGI"], "ana", road.desk.clock())
        await settle()
        (order,) = [one for topic, one in road.wire.sent if topic.endswith("/cmd")]
        answer = codec.write_answer(road.rig.command(order))
        road.hear(names.answer_topic("iveg", "AGI"), answer)
        for _ in range(40):
            road.desk.clock.now += 0.05
            road.report()
    assert road.desk.commander.machine("AGI").state == "STANDING"
    return calls


def test_a_detection_passes_the_tours_rows_in_their_order(road: Road) -> None:
    calls = calls_of_a_detection(road)

    assert road.rig.factor == 0.5
    assert misplaced(DETECTION, calls) == []


async def test_a_stop_passes_the_tours_rows_in_their_order(road: Road) -> None:
    assert misplaced(STOP, await calls_of_a_stop(road)) == []


@pytest.mark.parametrize("name", ["Evaluator.apply", "Tracker.track_picture"])
def test_a_row_that_stands_one_too_low_is_found(road: Road, name: str) -> None:
    rows = list(DETECTION)
    at = next(number for number, (_, named) in enumerate(rows) if name in named)
    rows[at : at + 2] = reversed(rows[at : at + 2])

    assert misplaced(rows, calls_of_a_detection(road)) != []
