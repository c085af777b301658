"""The past over HTTP: what is asked of it, and its problems."""

from iveg.domain.errors import NotRecordedError, TooManyLookError, UnreadableError
from tests.unit.web.desk import WebDesk

PATH = "/api/v1/world"


async def test_a_moment_is_asked_of_the_viewer_by_its_name() -> None:
    desk = WebDesk()
    async with desk.browser("viewer") as browser:
        told = await browser.get(f"{PATH}?at=2023-11-14T22:13:00Z&viewer=tab-1")

    assert told.status_code == 200
    assert told.json() == {"at_s": 1}
    assert desk.past.asked == [("tab-1", 1_699_999_980.0)]


async def test_what_cannot_be_shown_is_one_clear_problem() -> None:
    desk = WebDesk()
    async with desk.browser("viewer") as browser:
        future = await browser.get(f"{PATH}?at=2031-01-01T00:00:00Z")
        desk.past.fails = NotRecordedError(9.0, 8.0, None)
        gap = await browser.get(f"{PATH}?at=2023-11-14T22:13:00Z")
        desk.past.fails = UnreadableError("other_version", "recorded by iVeg 2")
        newer = await browser.get(f"{PATH}?at=2023-11-14T22:13:00Z")
        desk.past.fails = TooManyLookError()
        full = await browser.get(f"{PATH}?at=2023-11-14T22:13:00Z")
        nameless = await browser.get(f"{PATH}?at=2023-11-14T22:13:00Z&viewer=a/b")

    assert (future.status_code, nameless.status_code) == (422, 422)
    assert gap.status_code == 404
    assert gap.json()["type"] == "urn:iveg:not-recorded"
    assert gap.json()["before"] == "1970-01-01T00:00:08.000Z"
    assert gap.json()["after"] is None
    assert newer.status_code == 400
    assert newer.json()["reason"] == "other_version"
    assert full.status_code == 503
    assert (full.json()["type"], full.json()["why"]) == ("urn:iveg:hop", "viewers")
