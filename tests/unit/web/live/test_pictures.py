"""Pictures of the past: what pages were sent is what the past shows."""

import json
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import Any

import orjson
import pytest

from iveg.adapters.recordings.pictures import PICTURES_S, WHOLE_S, PictureFiles
from iveg.adapters.recordings.writer import FLUSH_S
from iveg.domain.errors import NotRecordedError
from iveg.domain.stamps import format_stamp
from iveg.models.base import write_json
from iveg.models.snapshot import PastWorld
from iveg.vital import topics
from iveg.web.live.pictures import PICTURE_S, Past, PictureRecorder, World
from tests.builders import START, detection, scan
from tests.unit.web.desk import WebDesk

FIRST = Path(__file__).parents[3] / "data" / "pictures"
"""A recording of the first version that made pictures; it is read for ever."""
FIRST_AT = 1_795_900_007.0
SPEED = 0.5


class Recorded:
    """A desk whose pictures are written as they are taken."""

    def __init__(self, folder: Path) -> None:
        self.desk = WebDesk(recordings=folder)
        self.recorder = self.desk.recordings
        self.folder = self.recorder.pictures
        self.write: Callable[..., bool] = self.recorder.picture
        self.pictures = PictureRecorder(
            self.desk.encoder,
            self.desk.views,
            self.desk.hub,
            self.desk.clock,
            lambda *picture: self.write(*picture),
        )
        self.past = Past(PictureFiles(self.folder))
        self._is_finished = False

    async def take(self, until: float) -> None:
        """Pictures of a robot that drives, up to a moment (s)."""
        while self.desk.clock.now < until:
            self.desk.clock.now = round(self.desk.clock.now + PICTURE_S, 3)
            self.desk.drive("AGI", SPEED * self.desk.clock.now)
            await self.pictures.take()
            await self.recorder.write()

    async def finish(self) -> None:
        if not self._is_finished:
            self._is_finished = True
            await self.recorder.close()

    async def world(self, seconds: float) -> dict[str, Any]:
        told: dict[str, Any] = orjson.loads(await self.past.world(START.wall + seconds))
        return told

    def live(self) -> dict[str, Any]:
        """What a page that comes now is sent."""
        now = topics.read_all(self.desk.views, self.desk.clock())
        told: dict[str, Any] = orjson.loads(write_json(now))
        return told


@pytest.fixture
async def recorded(tmp_path: Path) -> AsyncIterator[Recorded]:
    recorded = Recorded(tmp_path)
    yield recorded
    await recorded.finish()


def x_of(world: dict[str, Any], robot_id: str = "AGI") -> float:
    robots = {one["robot_id"]: one for one in world["robots"]}
    return float(robots[robot_id]["pose"]["x"])


async def test_the_past_is_what_a_page_that_came_then_was_sent(
    recorded: Recorded,
) -> None:
    desk = recorded.desk
    desk.drive("AGI")
    desk.drive("AGII", 50.0)
    desk.look("AGI", detection(x=4.0))
    desk.hear(scan(origin=desk.next_origin()))
    await recorded.take(3.0)
    desk.look("AGI", detection(x=4.0))
    await desk.commander.stop(["AGII"], "ana", desk.clock())
    await recorded.take(4.0)
    live = recorded.live()
    await recorded.finish()

    told = await recorded.world(4.1)

    PastWorld.model_validate_json(json.dumps(told))
    own = {name: told.pop(name) for name in set(told) - set(live)}
    (swept,) = own["scans"]
    assert swept["points"] == [[1.0, 0.0], [0.0, 2.0], [0.0, -4.0]]
    assert (own["at_s"], own["at"]) == (START.wall + 4.0, format_stamp(own["at_s"]))
    assert own["left_out"] == []
    assert without_ages(told) == without_ages(live)
    ages, lived = ([one["age_s"] for one in by["robots"]] for by in (told, live))
    assert ages == pytest.approx(lived, abs=0.01)


@pytest.mark.parametrize("is_open", [True, False])
async def test_each_moment_is_found_and_what_was_not_recorded_is_a_gap(
    recorded: Recorded, is_open: bool
) -> None:
    await recorded.take(2 * WHOLE_S + 1.0)
    recorded.desk.clock.now += 60.0
    await recorded.take(90.0)
    if not is_open:
        await recorded.finish()

    for seconds in (0.3, 5.7, 11.1, 20.3, 84.0, 87.9):
        shown = await recorded.world(seconds)
        assert abs(x_of(shown) - SPEED * seconds) < 0.3
        assert 0.0 <= START.wall + seconds - shown["at_s"] < 0.3
    gaps = ((-5.0, (None, 0.2)), (50.0, (21.0, 81.2)), (95.0, (90.0, None)))
    for seconds, ends in gaps:
        with pytest.raises(NotRecordedError) as gap:
            await recorded.world(seconds)
        near = gap.value.before, gap.value.after
        told = [None if one is None else one - START.wall for one in near]
        # Of a file that is open the last moments are not there yet.
        late = FLUSH_S if is_open else 0.01
        assert told == [end and pytest.approx(end, abs=late) for end in ends]


async def test_a_file_is_of_five_minutes_and_begins_whole(recorded: Recorded) -> None:
    """Nothing that is played has to be looked for in another one."""
    desk = recorded.desk
    desk.clock.now = PICTURES_S - START.wall % PICTURES_S - 5.0
    ends = desk.clock.now + 30.0
    await recorded.take(ends)
    await recorded.finish()

    assert len([*recorded.folder.glob("*.mcap")]) == 2
    for seconds in (ends - 22.0, ends - 2.0):
        assert abs(x_of(await recorded.world(seconds)) - SPEED * seconds) < 0.3


async def test_a_picture_without_room_is_followed_by_a_whole_one(
    recorded: Recorded,
) -> None:
    await recorded.take(1.0)
    write, recorded.write = recorded.write, lambda *_: False
    recorded.desk.drive("AGII", 7.0)
    await recorded.pictures.take()
    recorded.write = write
    await recorded.take(2.0)
    await recorded.finish()

    assert x_of(await recorded.world(2.0), "AGII") == 7.0


async def test_a_chunk_that_is_damaged_is_a_gap_and_no_wrong_picture(
    recorded: Recorded,
) -> None:
    await recorded.take(30.0)
    await recorded.finish()
    (path,) = recorded.folder.glob("*.mcap")
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(data)

    gaps = []
    for seconds in range(1, 30):
        try:
            shown = await recorded.world(seconds)
        except NotRecordedError:
            gaps.append(seconds)
        else:
            assert x_of(shown) == pytest.approx(SPEED * (shown["at_s"] - START.wall))
    assert 0 < len(gaps) < 20


# --- over HTTP --------------------------------------------------------------------


async def test_a_moment_is_asked_over_http_and_what_cannot_be_shown_is_a_problem(
    recorded: Recorded,
) -> None:
    await recorded.take(5.0)
    await recorded.finish()
    recorded.desk.clock.now = 30.0
    path = "/api/v1/world?at="
    async with recorded.desk.browser("viewer") as browser:
        # Earlier versions of the page named themselves.
        shown = await browser.get(f"{path}{format_stamp(START.wall + 4.0)}&viewer=tab")
        gap = await browser.get(path + format_stamp(START.wall + 20.0))
        future = await browser.get(f"{path}2031-01-01T00:00:00Z")

    assert (shown.status_code, gap.status_code, future.status_code) == (200, 404, 422)
    assert abs(x_of(shown.json()) - SPEED * 4.0) < 0.3
    assert gap.json()["type"] == "urn:iveg:not-recorded"
    assert gap.json()["before"] == format_stamp(START.wall + 5.0)
    assert gap.json()["after"] is None


# --- after updates ----------------------------------------------------------------


def test_a_topic_of_another_version_is_left_out_and_told() -> None:
    world = World()
    world.take({"at": 1.0, "parts": [{"topic": "moods/AGI", "at": 1.0, "data": 3}]})

    assert world.members()["left_out"] == ["moods/AGI"]


async def test_a_recording_of_the_first_version_is_shown_for_ever() -> None:
    past = Past(PictureFiles(FIRST))

    told: dict[str, Any] = orjson.loads(await past.world(FIRST_AT))

    modes = {one["robot_id"]: one["mode"] for one in told["robots"]}
    assert modes == {"AGI": "RUNNING", "AGII": "STOPPED"}
    assert (x_of(told), x_of(told, "AGII")) == (9.987, 13.196)
    counts = [len(told[name]) for name in ("people", "commands", "detections")]
    assert counts == [1, 1, 2]
    assert told["log"][-1]["id"] > told["log"][0]["id"]
    assert told["left_out"] == []
    assert [len(one["points"]) for one in told["scans"]] == [720, 720]


# --- helpers ----------------------------------------------------------------------


def without_ages(value: Any) -> Any:
    """The same without what counts from one moment to the next."""
    if isinstance(value, list):
        return [without_ages(one) for one in value]
    if not isinstance(value, dict):
        return value
    # A page lets rings grow and margins shrink by itself.
    counts = ("age_s", "counters", "radius_m", "margin", "acting")
    return {key: without_ages(one) for key, one in value.items() if key not in counts}
