"""One small world, and everything that iVeg answers of it over REST and ``/live``.

``answers.json`` is what was recorded: old keys keep their old values for one version,
new keys may come beside them.  ``python -m tests.data.answers`` records anew, which is
right only where a change of the contract is meant and documented.
"""

import asyncio
import base64
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import httpx
import orjson

from iveg.adapters.history.queries import Queries
from iveg.adapters.history.recorder import Store
from iveg.domain.events import Condition
from iveg.domain.observations import Climate, Instant, Navigation, RobotFault
from iveg.domain.records import Record
from iveg.models.base import write_json
from iveg.vital.publish import Subscriber
from iveg.vital.record import Waiting
from iveg.web.api import day, history
from iveg.web.live.feed import Painting, TelemetryFeed
from iveg.web.security.roles import Principal
from tests.builders import detection, detection_frame, hold, safety_report, scan
from tests.fakes.records import (
    NOON,
    alert_record,
    command_record,
    decision_record,
    detection_record,
    log_record,
)
from tests.fakes.worker import FakeWorker
from tests.unit.web.desk import WebDesk

_ID = re.compile(rb"\bID\d{4}(-\d+)?")
RECORDED = Path(__file__).with_name("answers.json")
_TOPICS = (
    "alerts",
    "rule",
    "health",
    "climate",
)
_PACED = ("robots/AGI", "robots/AGII", "robots/AGI/scan", "people", "detections/AGI")
_ROUTES = (
    "robots",
    "robots/AGI",
    "robots/AGI/scan",
    "people",
    "map",
    "climate",
    "health",
    "rule",
    "rule/versions",
    "decisions",
    "decisions/D1",
    "detections",
    "commands",
    "commands/C1",
    "alerts",
    "log",
    "latency?figures=false",
)
_FILES = ("decisions", "detections", "commands", "alerts", "log")


async def answers() -> dict[str, Any]:
    """Every answer of the small world, by its way: ``REST``, ``NDJSON``, ``live``."""
    desk = await _world()
    with TemporaryDirectory() as directory:
        url = f"sqlite:///{directory}/history.db"
        store, queries = Store(url), Queries(url)
        _remember(store)
        _open(desk, queries)
        async with desk.browser("viewer") as page:
            told = await _over_http(page)
        queries.close()
        store.close()
    told["live alerts/acknowledge"] = await _acknowledge(desk)
    told |= _live(desk) | {"live iveg.2": _paced(desk)}
    # How many ids were drawn before is nobody's business.
    return orjson.loads(_ID.sub(b"ID", orjson.dumps(told)))  # type: ignore[no-any-return]


async def _world() -> WebDesk:
    """A farmer between two robots: one slows down, the other was told to STOP."""
    desk = WebDesk()
    desk.drive("AGI", 3.0)
    desk.drive("AGII", 9.0)
    desk.hear(detection_frame("AGII", origin=desk.next_origin()))
    desk.hear(scan("AGI", origin=desk.next_origin()))
    path = ((3.0, 0.0), (8.0, 0.5))
    desk.hear(Navigation("AGI", desk.next_origin(), "row 4", (8.0, 0.5), path))
    desk.hear(Climate(21.5, 0.7, 430.0))
    faint = detection("farmer", 12.0, 1.0, probability=0.4)
    sure = detection("farmer", 4.5, 0.5, det_id="7")
    desk.hear(detection_frame("AGI", sure, faint, origin=desk.next_origin()))
    await desk.wait(0.1)
    slow = safety_report(
        "AGI", speed_factor=0.5, reason="person", origin=desk.next_origin()
    )
    fault = RobotFault("no_transform", "map → odom", 2.1)
    desk.hear(replace(slow, faults=(fault,)))
    await desk.commander.stop(["AGII"], "ana", desk.clock())
    held = hold(desk.commander.machine("AGII").hold_id or "")
    origin = desk.next_origin()
    desk.hear(
        safety_report("AGII", held, speed_factor=0.0, reason="hold", origin=origin)
    )
    await desk.wait(0.1)
    lost = Condition("P2", "alert.robot_lost", "AGIII", "AGIII", {"robot": "AGIII"})
    desk.evaluator.alerts.sync([lost], desk.clock())
    return desk


def _remember(store: Store) -> None:
    records: tuple[Record, ...] = (
        decision_record(),
        detection_record(person_id="P1"),
        command_record(state="STANDING", standstill_ms=640.0, tries=1),
        alert_record(),
        log_record(),
    )
    store.write([Waiting(record, n, 0.0) for n, record in enumerate(records, 1)])


def _open(desk: WebDesk, queries: Queries) -> None:
    """The routes of the history, beside those that the desk has."""
    seen_at = Instant(0.0, NOON + 60.0)
    find = desk.views.find_command
    desk.app.include_router(day.stop_records_router(queries, desk.clock, find))
    desk.app.include_router(
        history.router(
            queries,
            FakeWorker(),
            present=desk.evaluator.decision_record,
            read_clock=lambda: seen_at,
        )
    )


async def _over_http(page: httpx.AsyncClient) -> dict[str, Any]:
    told: dict[str, Any] = {}
    for path in _ROUTES:
        answer = await page.get(f"/api/v1/{path}")
        told[f"REST {path.partition('?')[0]}"] = answer.json()
    for path in _FILES:
        answer = await page.get(f"/api/v1/{path}?format=ndjson")
        told[f"NDJSON {path}"] = [orjson.loads(one) for one in answer.iter_lines()]
        answer = await page.get(f"/api/v1/{path}?format=csv")
        told[f"CSV {path}"] = answer.text.splitlines()
    return told


async def _acknowledge(desk: WebDesk) -> Any:
    alert_id = desk.views.alerts()[0].alert_id
    async with desk.browser("operator") as page:
        answer = await page.post(
            f"/api/v1/alerts/{alert_id}/acknowledge", json={"note": "seen"}
        )
    return answer.json()


def _live(desk: WebDesk) -> dict[str, Any]:
    """The messages beside telemetry."""
    told = {f"live {topic}": _read(desk.encoder.frame(topic)) for topic in _TOPICS}
    told["live log"] = _read(desk.encoder.event("log", log_record()))
    ana, now = Principal("ana", "operator"), desk.clock()
    told["live snapshot"] = orjson.loads(write_json(desk.face.snapshot(ana, now)))
    del told["live snapshot"]["log"]  # how many lines there are is nobody's business
    stop = desk.commander.machine("AGII").stop
    told["live commands/{id}"] = _read(desk.encoder.event("commands/x", stop))
    return told


def _paced(desk: WebDesk) -> Any:
    """A frame of telemetry that has everything."""
    subscriber = Subscriber()
    for topic in _PACED:
        subscriber.changed(topic)
    painting = Painting(desk.latency)
    feed = TelemetryFeed(desk.encoder.telemetry, subscriber, painting)
    return _read(feed.next_frame(desk.clock()))


def _read(frame: bytes | None) -> Any:
    if frame is None or frame.startswith(b"{"):
        return None if frame is None else orjson.loads(frame)
    start = 4 + int.from_bytes(frame[:4], "little")
    body = base64.b64encode(frame[start:]).decode()
    return {"head": orjson.loads(frame[4:start]), "body": body}


def differences(old: Any, new: Any, where: str = "") -> list[str]:
    """Where an answer says something else than the old one; a new key is none."""
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        found = [f"{where}.{key} is gone" for key in old if key not in new]
        shared = [key for key in old if key in new]
        return found + [
            one for k in shared for one in differences(old[k], new[k], f"{where}.{k}")
        ]
    if isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        pairs = enumerate(zip(old, new, strict=True))
        return [
            one for n, (a, b) in pairs for one in differences(a, b, f"{where}[{n}]")
        ]
    return [] if old == new else [f"{where}: {old!r} became {new!r}"]


def _write(told: dict[str, Any]) -> bytes:
    """One line an answer."""
    lines = (b"%b: %b" % (orjson.dumps(k), orjson.dumps(v)) for k, v in told.items())
    return b"{\n" + b",\n".join(lines) + b"\n}\n"


if __name__ == "__main__":
    RECORDED.write_bytes(_write(asyncio.run(answers())))
