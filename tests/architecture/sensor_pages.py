"""What the pages of the contract say of small sensors.

It follows from the table of kinds: ``python -m tests.architecture.sensor_pages`` writes
it into the pages, and a test fails while one is stale.
"""

import re
from collections.abc import Callable, Mapping
from typing import get_type_hints

from iveg.domain.kinds import SENSED, Kind
from iveg.domain.quantities import quantities_of
from iveg.robot.ros2.topics import ROS_SENSORS
from tests.architecture.documents import INTERFACES

_HEAD = "| key | type | unit | meaning |\n|---|---|---|---|\n"
_TYPES = {float | None: "number or null", bool | None: "boolean or null"}
_BLOCK = re.compile(r"(<!-- small sensors -->\n)(.*?)(<!-- end -->)", re.DOTALL)
_ROS_ROWS = re.compile(r"(\n\| \(none\) [^\n]*\| mask \|\n)((?:\|[^\n]* s \|\n)*)")


def _rows(kind: Kind) -> str:
    types = get_type_hints(kind.type_)
    return "".join(
        f"| `{name}` | {_TYPES[types[name]]} | {one.unit} | {one.meaning} |\n"
        for name, one in quantities_of(kind.type_).items()
    )


def _measure(kind: Kind) -> str:
    every_s = kind.sensor.every_s if kind.sensor else 0.0
    return (
        f"### `/{{apikey}}/{{robot}}_{kind.name}/attrs`\n\n"
        f"Every {every_s:g} s. Key `{kind.name}`, "
        "an object with the origin keys and:\n\n"
        f"{_HEAD}{_rows(kind)}\n"
    )


def _ros(kind: Kind) -> str:
    sensor = ROS_SENSORS.get(kind.name)
    if sensor is None:
        return ""
    message, sent = sensor.message.ROS, f"sent as `{kind.name}`"
    return (
        f"| `{sensor.topic}` | `{message}` | best effort "
        f"| {sent} every {sensor.every_s:g} s |\n"
    )


def _all(say: Callable[[Kind], str]) -> str:
    return "".join(map(say, SENSED))


def _mqtt(page: str) -> str:
    return _BLOCK.sub(rf"\1\n{_all(_measure)}\3", page)


def _ros2(page: str) -> str:
    return _ROS_ROWS.sub(rf"\1{_all(_ros)}", page)


PAGES: Mapping[str, Callable[[str], str]] = {
    "mqtt.md": _mqtt,
    "ros2.md": _ros2,
}
"""Pages of the contract, and how each is brought up to date."""

if __name__ == "__main__":
    for name, write in PAGES.items():
        (INTERFACES / name).write_text(write((INTERFACES / name).read_text()))
