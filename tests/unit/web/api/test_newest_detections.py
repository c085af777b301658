"""Each detection of the last moments, which the log sums up and the history thins."""

import httpx
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


async def asked(desk: WebDesk, question: str = "") -> httpx.Response:
    async with desk.program() as program:
        return await program.get(LATEST + question)


async def test_each_detection_is_told_newest_first_with_source_class_and_confidence(
    desk: WebDesk,
) -> None:
    rows = (await asked(desk, "?class=person")).json()["items"]

    assert [one["probability"] for one in rows] == [
        pytest.approx(0.89 - 0.01 * n) for n in range(10)
    ]
    assert {(one["robot_id"], one["class"], one["class_id"]) for one in rows} == {
        ("AGII", "person", "farmer")
    }
    assert len({one["at"] for one in rows}) == 10
    # What the history keeps of the same second is less.
    assert len(desk.records(DetectionRecord)) < 10


@pytest.mark.parametrize(
    ("question", "count"),
    [
        ("", 20),
        ("?robot=AGII&limit=3", 3),
        ("?robot=AGI", 0),
        ("?min_probability=0.875", 2),
        ("?until=1971-01-01T00:00:00Z", 0),
    ],
)
async def test_detections_are_filtered_as_lists_are(
    desk: WebDesk, question: str, count: int
) -> None:
    assert len((await asked(desk, question)).json()["items"]) == count
