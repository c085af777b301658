"""What people's safety needs is read from MQTT without FIWARE."""

import orjson
import pytest

from iveg.adapters.direct import DirectReader
from iveg.domain.observations import (
    CommandAnswer,
    DetectionFrame,
    Received,
    SafetyReport,
)
from iveg.ngsi import codec
from tests.builders import detection, detection_frame, odometry, safety_report
from tests.fakes.clock import FakeClock


class Bench:
    def __init__(self) -> None:
        self.offered: list[Received] = []
        self.rejected: list[tuple[str, str, str]] = []
        self.reader = DirectReader(
            "iveg",
            ["AGI"],
            FakeClock(),
            self.offered.append,
            lambda *problem: self.rejected.append(problem),
        )


def test_it_listens_to_looks_reports_answers_and_the_single_uplink() -> None:
    assert Bench().reader.subscriptions() == {
        "/iveg/AGI/attrs": 1,
        "/iveg/AGI_safety/attrs": 1,
        "/iveg/AGI_yolox_bounding_boxes/attrs": 1,
        "/iveg/AGI/cmdexe": 1,
    }


def test_looks_reports_and_answers_come_in_on_the_mqtt_road() -> None:
    bench = Bench()
    frame = detection_frame("AGI", detection("farmer", 1.0))
    answer = b'{"cmd": {"id": "01A", "r": "LATCHED", "holds": []}}'

    bench.reader.read(
        "/iveg/AGI_yolox_bounding_boxes/attrs", codec.write_detections(frame)
    )
    bench.reader.read("/iveg/AGI_safety/attrs", codec.write_safety(safety_report()))
    bench.reader.read("/iveg/AGI/cmdexe", answer)

    kinds = [type(one.observation) for one in bench.offered]
    assert kinds == [DetectionFrame, SafetyReport, CommandAnswer]
    assert {one.road for one in bench.offered} == {"mqtt"}


def test_poses_are_left_to_orion() -> None:
    bench = Bench()

    bench.reader.read("/iveg/AGI/attrs", codec.write_odometry(odometry()))

    assert bench.offered == []


def test_f30_an_apostrophe_that_orion_refuses_costs_nobody_their_ring() -> None:
    bench = Bench()
    frame = detection_frame("AGI", detection("farmer's wife", 1.0))

    bench.reader.read(
        "/iveg/AGI_yolox_bounding_boxes/attrs", codec.write_detections(frame)
    )

    assert len(bench.offered) == 1


@pytest.mark.parametrize("topic", ["/iveg/AGX/attrs", "/other/AGI/attrs", "", "/"])
def test_topics_of_nobody_are_left_alone(topic: str) -> None:
    bench = Bench()

    bench.reader.read(topic, b"whatever")

    assert (bench.offered, bench.rejected) == ([], [])


@pytest.mark.parametrize("topic", ["/iveg/AGI_safety/attrs", "/iveg/AGI/cmdexe"])
def test_what_cannot_be_read_is_counted_with_its_source(topic: str) -> None:
    bench = Bench()

    bench.reader.read(topic, b"null")

    ((source, reason, _),) = bench.rejected
    assert source.startswith("AGI")
    assert reason == "not_an_object"


def test_f27_a_report_with_a_number_that_is_none_is_counted() -> None:
    bench = Bench()
    value = {"speed_factor": 1, "reason": "clear", "v": "here"}
    payload = orjson.dumps({"safety_state": value}).replace(b'"here"', b"NaN")

    bench.reader.read("/iveg/AGI_safety/attrs", payload)

    assert bench.offered == []
    assert len(bench.rejected) == 1
