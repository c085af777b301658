"""Each detection of the last moments, which the log sums up and the history thins."""

import pytest

from iveg.domain.records import DetectionRecord
from tests.builders import detection
from tests.unit.web.desk import WebDesk

LATEST = "/api/v1/detections/latest"


@pytest.fixture
def desk() -> WebDesk:
    """A farmer whom AGII sees ten times in a second, and a box of no class."""
    desk = WebDesk()
    desk.drive("AGI", 0.0)
    desk.drive("AGII", 50.0)
    for tenth in range(10):
        desk.clock.now = round(desk.clock.now + 0.1, 6)
        farmer = detection("farmer", 20.0, probability=0.8 + 0.01 * tenth)
        desk.look("AGII", farmer, detection("cat", 22.0, probability=0.3))
    return desk


async def test_each_detection_is_told_newest_first_with_source_class_and_confidence(
    desk: WebDesk,
) -> None:
    async with desk.program() as program:
        rows = (await program.get(f"{LATEST}?class=person")).json()["items"]
        few = (await program.get(f"{LATEST}?robot=AGII&limit=3")).json()["items"]
        sure = (await program.get(f"{LATEST}?min_probability=0.875")).json()["items"]

    assert [one["probability"] for one in rows] == [
        pytest.approx(0.89 - 0.01 * n) for n in range(10)
    ]
    assert {(one["robot_id"], one["class"], one["class_id"]) for one in rows} == {
        ("AGII", "person", "farmer")
    }
    assert len({one["at"] for one in rows}) == 10
    # What the history keeps of the same second is less.
    assert len(desk.records(DetectionRecord)) < 10
    assert (len(few), len(sure)) == (3, 2)
