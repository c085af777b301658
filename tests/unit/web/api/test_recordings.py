"""Recordings over HTTP: their list, and each that is finished as a file."""

from pathlib import Path

from iveg.web.api.past import MEDIA_TYPE
from tests.unit.web.desk import WebDesk


async def test_recordings_are_listed_and_sent_when_they_are_finished(
    tmp_path: Path,
) -> None:
    desk = WebDesk(recordings=tmp_path)
    (tmp_path / "2026-11-24T10-00-00Z.mcap").write_bytes(b"whole")
    (tmp_path / "2026-11-24T11-00-00Z.mcap.open").write_bytes(b"half")
    (tmp_path / "rules.jsonl").write_bytes(b"not a recording")

    async with desk.browser("viewer") as viewer:
        listed = (await viewer.get("/api/v1/recordings")).json()["items"]
        whole, half = listed
        assert whole["name"] == "2026-11-24T10-00-00Z.mcap"
        assert (whole["size"], whole["is_open"]) == (5, False)
        assert half["name"] == "2026-11-24T11-00-00Z.mcap"
        assert half["is_open"]

        answer = await viewer.get(f"/api/v1/recordings/{whole['name']}")
        assert answer.content == b"whole"
        assert answer.headers["Content-Type"] == MEDIA_TYPE
        for name in (half["name"], "rules.jsonl", "..%2Frules.jsonl", "none.mcap"):
            refused = await viewer.get(f"/api/v1/recordings/{name}")
            assert refused.status_code == 404
