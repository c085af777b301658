"""Recorded answers keep their old keys and values (docs/interfaces/README.md)."""

import orjson

from tests.data.answers import RECORDED, answers, differences


async def test_rest_and_live_say_what_they_said_when_recorded() -> None:
    recorded = orjson.loads(RECORDED.read_bytes())

    assert differences(recorded, await answers()) == []
