"""What iVeg makes of its models is what they promise, also where nobody validates."""

from typing import Any

from pydantic import TypeAdapter

from iveg.models.alert import Alert, AlertListing
from iveg.models.base import Listing
from iveg.models.climate import Climate
from iveg.models.command import Command
from iveg.models.decision import Decision
from iveg.models.health import Health
from iveg.models.kept_detection import DetectionRow
from iveg.models.latency import LatencyTable
from iveg.models.log_entry import LogEntry
from iveg.models.mapped import Scan
from iveg.models.people import Person
from iveg.models.places import GreenhouseMap
from iveg.models.robot import Robot
from iveg.models.rule import Rule
from iveg.models.stop_latency import Drill, Latency
from tests.data.answers import answers

PROMISED: dict[str, Any] = {
    "REST robots": Listing[Robot],
    "REST robots/AGI": Robot,
    "REST robots/AGI/scan": Scan,
    "REST people": Listing[Person],
    "REST map": GreenhouseMap,
    "REST climate": Climate,
    "REST health": Health,
    "REST rule": Rule,
    "REST rule/versions": Listing[Rule],
    "REST decisions": Listing[Decision],
    "REST decisions/D1": Decision,
    "REST detections": Listing[DetectionRow],
    "REST commands": Listing[Command],
    "REST commands/C1": Command,
    "REST commands/latency": Latency,
    "REST drills": Listing[Drill],
    "REST alerts": AlertListing,
    "REST log": Listing[LogEntry],
    "REST latency": LatencyTable,
    "NDJSON decisions": list[Decision],
    "NDJSON detections": list[DetectionRow],
    "NDJSON commands": list[Command],
    "NDJSON alerts": list[Alert],
    "NDJSON log": list[LogEntry],
}


async def test_every_answer_is_what_its_model_says() -> None:
    told = await answers()

    for name, promised in PROMISED.items():
        TypeAdapter(promised).validate_python(told[name])
