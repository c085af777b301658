"""The times of STOPs that are remembered."""

from pathlib import Path

from iveg.adapters.history.queries import Queries
from iveg.models.command import Command
from iveg.web.api import day
from tests.databases import remember
from tests.fakes.records import NOON, command_event_record, command_record
from tests.unit.web.desk import WebDesk


async def test_a_command_is_told_from_history_and_this_run_with_what_each_knows(
    tmp_path: Path,
) -> None:
    url = f"sqlite:///{tmp_path / 'history.sqlite'}"
    remember(
        url,
        command_record(state="RUNNING", standing_at=NOON + 2.0),
        command_record(command_id="C2", pressed_at=NOON),
        command_event_record(state="UNCONFIRMED"),
    )
    standing = command_record(state="STANDING", standing_at=NOON + 2.0)
    followed = Command.from_record(standing).model_copy(update={"outcome": None})
    desk, queries = WebDesk(), Queries(url)
    of_now = {"C1": followed}
    desk.app.include_router(
        day.stop_records_router(queries, desk.clock, lambda one, _: of_now.get(one))
    )
    path = "/api/v1/commands"
    async with desk.browser() as browser:
        whole = (await browser.get(f"{path}/C1")).json()
        earlier = (await browser.get(f"{path}/C2")).json()
        missing = await browser.get(f"{path}/C9")
        (tmp_path / "history.sqlite").write_bytes(b"no database")
        alone = await browser.get(f"{path}/C1")
    queries.close()

    assert (whole["state"], whole["outcome"]) == ("STANDING", "stood")
    assert [one["state"] for one in whole["steps"]] == ["UNCONFIRMED"]
    assert whole["was_loud"] is True
    assert earlier["times"]["pressed"] is not None
    assert missing.status_code == 404
    assert (alone.status_code, alone.json()["outcome"]) == (200, None)
