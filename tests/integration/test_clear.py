"""Clear must be earned: real programs, and robots that write their messages by hand.

One stack; each part begins where the one before ended.
"""

import itertools
import json
from collections.abc import Iterator

import httpx
import pytest

from tests.processes import Site
from tests.strangers import Field, Json, Stranger, box_about, strangers


def spoiled() -> Iterator[str | bytes]:
    """What no reader can use whole, one form after the other."""
    person = box_about(11.6, 10.0)
    forms: list[Json] = [
        {"bounding_boxes": [person] * 257, "detection_header": {}},
        {"bounding_boxes": [], "detection_header": {"stamp": 1_795_000_000}},
        {"bounding_boxes": [box_about(float("nan"), 10.0)], "detection_header": {}},
        {"bounding_boxes": [{**person, "probability": 95}], "detection_header": {}},
    ]
    return itertools.cycle(map(json.dumps, forms))


def alerts(api: httpx.Client) -> dict[str, str]:
    """Keys of what is wrong now, and how grave."""
    items = api.get("alerts").raise_for_status().json()["items"]
    return {one["key"]: one["priority"] for one in items if one["cleared_at"] is None}


async def raised(field: Field, api: httpx.Client, key: str) -> None:
    """Wait for an alert, while the robots go on speaking."""
    await field.until(lambda: alerts(api).get(key) == "P2", key)


@pytest.mark.slow
async def test_f54_a_detector_that_cannot_be_read_lies_about_time_or_is_silent(
    served: Site,
) -> None:
    watcher = Stranger("AGI", 10.0, 10.0)
    near = Stranger("AGII", 12.5, 10.0)
    mqtt = served.settings["IVEG_MQTT_URL"]
    async with strangers(mqtt, watcher, near) as field:
        with served.api() as api:
            await _unreadable_from_the_first_on(field, watcher, api)
            await _stamped_by_another_clock(field, watcher, api)
            await _silent(field, watcher, near, api)


async def _unreadable_from_the_first_on(
    field: Field, watcher: Stranger, api: httpx.Client
) -> None:
    forms = spoiled()
    watcher.spoil = lambda _: next(forms)
    await field.until(lambda: "AGI" in field.limits, "a limit")
    await raised(field, api, "alert.unreadable_detection")
    assert (field.factor("AGI"), field.factor("AGII")) == (0.5, 0.5)
    watcher.spoil = json.dumps
    await field.until(lambda: {"AGI", "AGII"} == set(field.clear), "both clear")


async def _stamped_by_another_clock(
    field: Field, watcher: Stranger, api: httpx.Client
) -> None:
    watcher.detector_off_s = -7200.0
    watcher.boxes = [box_about(11.6, 10.0)]
    await field.until(
        lambda: field.limits.get("AGII", {}).get("reason") == "person", "a person"
    )
    await raised(field, api, "alert.detector_clock")
    watcher.detector_off_s, watcher.boxes = 0.0, []
    await field.until(lambda: {"AGI", "AGII"} == set(field.clear), "both clear")


async def _silent(
    field: Field, watcher: Stranger, near: Stranger, api: httpx.Client
) -> None:
    watcher.boxes = None
    await field.until(lambda: field.factor("AGII") == 0.5, "AGII slow")
    await raised(field, api, "alert.detector_silent")
    near.x = 19.0  # farther away than the camera reaches, and 6 m
    watcher.x = 1.0
    await field.until(lambda: field.clear == ["AGII"], "AGII clear")
