"""Other equipment from Orion's notification to REST, history and alert."""

from typing import Any

import orjson

from iveg.domain.equipment import Tile
from iveg.web.pages.sentences import read_sentences
from tests.unit.web.desk import WebDesk

CONDUCTIVITY = Tile(
    entity_id="fertigation-1",
    entity_type="FertigationUnit",
    attribute="conductivity",
    name={"es": "Conductividad", "en": "Conductivity"},
    unit="mS/cm",
    limits={"high": 3.5},
)
FLOW = Tile(
    entity_id="fertigation-1",
    entity_type="FertigationUnit",
    attribute="flow",
    name={"es": "Caudal", "en": "Flow"},
    unit="L/min",
    silent_after_s=60.0,
)


async def notify(desk: WebDesk, **values: Any) -> None:
    """Orion tells attributes of the unit."""
    unit = {"id": "fertigation-1", "type": "FertigationUnit"}
    attributes = {
        name: {"type": "Number", "value": value, "metadata": {}}
        for name, value in values.items()
    }
    body = orjson.dumps({"subscriptionId": "ours", "data": [{**unit, **attributes}]})
    async with desk.orion() as orion:
        answer = await orion.post("/ngsi/notifications", content=body)
    assert answer.status_code == 204


async def tiles(desk: WebDesk) -> dict[str, Any]:
    async with desk.program() as program:
        items = (await program.get("/api/v1/equipment")).json()["items"]
    return {one["attribute"]: one for one in items}


def alerts(desk: WebDesk) -> set[str]:
    """What is wrong with equipment now, as people in England read it."""
    desk.parts.equipment.tick(desk.clock())
    desk.loop.step([], desk.clock())
    desk.evaluator.tick(
        desk.clock(), desk.parts.core.supervision.conditions(desk.clock())
    )
    say = read_sentences("en").say
    return {
        say(one.condition.key, one.condition.slots)
        for one in desk.evaluator.alerts.waiting
        if one.condition.key.startswith("alert.tile")
    }


async def test_a_tile_that_loses_its_signal_says_so_and_raises_an_alert() -> None:
    desk = WebDesk(tiles=[CONDUCTIVITY, FLOW])
    await notify(desk, conductivity=2.4)
    told = await tiles(desk)
    assert (told["conductivity"]["value"], told["conductivity"]["state"]) == (2.4, "ok")
    assert told["flow"]["state"] == "waiting"
    assert desk.hub.versions["equipment"] == 1
    # It waits in no queue of robots.
    assert (desk.ingest.waiting, desk.ingest.counters) == (0, {})

    await notify(desk, flow=18.0)
    desk.clock.now += 61.0
    await notify(desk, conductivity=2.5)

    assert alerts(desk) == {"Flow: no signal for 1 min"}
    told = await tiles(desk)
    assert (told["flow"]["state"], told["flow"]["value"]) == ("silent", 18.0)
    assert told["conductivity"]["state"] == "ok"

    await notify(desk, flow=17.0)
    assert alerts(desk) == set()
