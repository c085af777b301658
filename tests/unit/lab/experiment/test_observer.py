"""What an experiment hears of a real server, as a program with a token."""

import asyncio

from iveg.lab.experiment.observer import watch
from tests.builders import detection
from tests.unit.web.desk import API_TOKEN, WebDesk


async def test_pictures_and_beliefs_are_heard_while_a_scenario_runs() -> None:
    desk = WebDesk()
    async with desk.serving() as address:
        hearing = asyncio.create_task(
            watch(f"http://{address}", API_TOKEN, 1.6, "AGII")
        )
        for _ in range(12):
            desk.drive("AGI")
            desk.look("AGI", detection("farmer", 3.0))
            desk.clock.now += 0.1
            await asyncio.sleep(0.1)
        watched = await hearing

    assert {one.robot_id for one in watched.reported} == {"AGI"}
    assert len(watched.reported) >= 3
    [seen] = watched.reported[-1].seen
    assert (seen.class_id, seen.x) == ("farmer", 3.0)
    assert watched.beliefs[-1][1](3.0, 0.0) == "nobody"
    assert len(watched.slices) == 1
    assert len(watched.edges) == 2
    assert watched.read["passed"] >= 0 == watched.read["skipped"]


async def test_a_server_that_is_not_there_leaves_nothing_and_ends_in_time() -> None:
    watched = await watch("http://127.0.0.1:9", API_TOKEN, 0.3, "AGII")

    assert (watched.reported, watched.beliefs) == ([], [])
