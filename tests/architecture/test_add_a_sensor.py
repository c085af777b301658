"""A sensor, and a quantity of odometry, are added to a copy of the program."""

import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

from tests.processes import ROOT

pytestmark = pytest.mark.slow

# File → where it is added, and what: before the anchor, so that the anchor stays.
STEPS: Mapping[str, tuple[tuple[str, str], ...]] = {
    "iveg/domain/observations.py": (
        (
            "@dataclass(frozen=True, slots=True)\nclass CommandStatus(",
            """\
@dataclass(frozen=True, slots=True)
class SoilMoisture(Observation):
    \"\"\"Water in the soil at the robot's probe.\"\"\"

    percentage: Annotated[float | None, Quantity("%", "of the volume", 0, 100)] = None


""",
        ),
    ),
    "iveg/domain/kinds.py": (
        ("    kind_of,\n", "    SoilMoisture,\n"),
        (
            "    Kind(CommandStatus,",
            """\
    _sensed(
        SoilMoisture,
        "soil_moisture",
        Sensor(
            shown="percentage",
            every_s=1.0,
            low=Low("percentage", below=15, above=20),
        ),
    ),
""",
        ),
    ),
    "iveg/lab/emulator/world.py": (
        ("\n_BATTERY_LASTS_S", "from iveg.domain.observations import SoilMoisture\n"),
        (
            '}\n"""The observation after',
            '    SoilMoisture: lambda _: SoilMoisture("", UNKNOWN_ORIGIN, 40.0),\n',
        ),
    ),
    "iveg/robot/ros2/topics.py": (
        (
            "\n\n@dataclass(frozen=True, slots=True)\nclass RosSensor",
            """\

from iveg.domain.observations import SoilMoisture

Float32: Any = ros.message("std_msgs/msg/Float32")


def read_moisture(message: Float32) -> SoilMoisture:
    \"\"\"Read per cent of water.\"\"\"
    return SoilMoisture("", UNKNOWN_ORIGIN, message.data)


def write_moisture(_: ros.Header, moisture: Any) -> Float32:
    \"\"\"The inverse.\"\"\"
    return Float32(moisture.percentage)
""",
        ),
        (
            "    )\n}\n",
            """\
        RosSensor(
            SoilMoisture, "soil_moisture", Float32, read_moisture, write_moisture
        ),
""",
        ),
    ),
    **{
        f"iveg/static/i18n/{language}.json": (
            (
                '    "battery": "',
                f'    "soil_moisture": "{name}",\n'
                '    "soil_moisture_level": "{level:0} %",\n',
            ),
            (
                '    "battery_low": "',
                f'    "soil_moisture_low": "{{robot}}: {name} {{level:0}} %",\n',
            ),
        )
        for language, name in (("en", "Soil moisture"), ("es", "Humedad del suelo"))
    },
}
QUANTITY = (
    '    slip: Annotated[float | None, Quantity("0–1", "lost turn", 0, 1)] = None\n'
)
AFTER = "    frame_id: Annotated[FrameName | None, IF_ANY] = None\n"
SLIPS = """
from dataclasses import replace
from iveg.domain.observations import Odometry, Instant
from iveg.ngsi import codec
from iveg.robot.uplink import Sender, Uplink
from tests.builders import odometry

sent = {}
uplink = Uplink(Sender("AGI", "iveg", "boot"), sent.__setitem__)
uplink.send(replace(odometry(), slip=0.25), Instant(1.0, 1.7e9))
(read,) = codec.read_measure("AGI_odom", sent["/iveg/AGI_odom/attrs"]).observations
assert isinstance(read, Odometry) and read.slip == 0.25, read
wrong = sent["/iveg/AGI_odom/attrs"].replace(b"0.25", b"1.25")
(problem,) = codec.read_measure("AGI_odom", wrong).problems
assert problem.reason == "bad_base_pose_ground_truth", problem
"""
GUARDS = ("tests/architecture/test_sensors.py", "tests/unit/test_page_types.py")
WRITERS = "iveg.models.typescript", "tests.architecture.sensor_pages"
WHOLE = """
from dataclasses import replace
from iveg.adapters.reconciler import COMMON_SUBSCRIPTIONS
from iveg.domain.observations import Instant, Received, SoilMoisture
from iveg.domain.records import ReadingRecord
from iveg.domain.world import World
from iveg.models.robot import Robot
from iveg.ngsi import codec, names
from iveg.robot.uplink import Sender, Uplink
from tests.unit.vital.desk import Desk, conditions_of
import asyncio

sent = {}
uplink = Uplink(Sender("AGI", "iveg", "boot"), sent.__setitem__)
uplink.send(SoilMoisture("", codec.read_measure, 12.5), Instant(1.0, 1.7e9))
((topic, payload),) = sent.items()
assert topic == "/iveg/AGI_soil_moisture/attrs", topic
(read,) = codec.read_measure("AGI_soil_moisture", payload).observations
assert isinstance(read, SoilMoisture) and read.percentage == 12.5, read
wet = codec.read_attributes("AGI", {"soil_moisture": {"percentage": 101}})
assert [one.reason for one in wet.problems] == ["bad_soil_moisture"]
assert "soil_moisture" in {want.name for want in COMMON_SUBSCRIPTIONS}
assert "AGI_soil_moisture" in {"AGI" + one.suffix for one in names.ROBOT_DEVICES}

async def main():
    desk = Desk()
    desk.hear(SoilMoisture("AGI", desk.next_origin(), 12.5))
    await desk.wait(0.1)
    assert "alert.soil_moisture_low" in conditions_of(desk)
    (kept,) = desk.records(ReadingRecord)
    assert (kept.kind, kept.value) == ("soil_moisture", {"percentage": 12.5})
    robot = desk.world.robot("AGI")
    told = Robot.sensed(robot, desk.clock())["soil_moisture"]
    assert told.model_dump() == {"age_s": 0.1, "percentage": 12.5}, told

asyncio.run(main())
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the program.

    It is compiled already: what Python has kept of a file is good for its copy.
    """
    folder = tmp_path_factory.mktemp("copy")
    unwanted = shutil.ignore_patterns("vendor", "*.png")
    for name in ("iveg", "tests", "docs"):
        shutil.copytree(ROOT / name, folder / name, ignore=unwanted)
    shutil.copy(ROOT / "pyproject.toml", folder)
    return folder


def add_sensor(copy: Path) -> None:
    """Write the sensor into a copy."""
    for name, additions in STEPS.items():
        text = (ROOT / name).read_text()
        for anchor, added in additions:
            assert anchor in text, f"{name}: {anchor}"
            text = text.replace(anchor, added + anchor, 1)
        (copy / name).write_text(text)


def python(folder: Path, *words: str) -> tuple[int, str]:
    """Run Python in a copy: its end and all that it printed."""
    run = subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": ""},
        capture_output=True,
        text=True,
        check=False,
    )
    return run.returncode, run.stdout + run.stderr


def guards(folder: Path) -> tuple[int, str]:
    # Without what all other tests share, which imports a browser's driver and more.
    alone = ("-p", "no:cacheprovider", "--noconftest")
    return python(folder, "-m", "pytest", "-q", *alone, *GUARDS)


def test_a_sensor_takes_six_files_and_seventy_lines() -> None:
    added = [text for additions in STEPS.values() for _, text in additions]

    assert len(STEPS) <= 6
    assert sum(text.count("\n") for text in added) <= 70


def test_a_quantity_of_odometry_takes_one_line(copy: Path) -> None:
    declared = copy / "iveg/domain/observations.py"
    text = declared.read_text()
    assert text.count(AFTER) == 1
    declared.write_text(text.replace(AFTER, AFTER + QUANTITY))

    assert QUANTITY.count("\n") == 1
    assert python(copy, "-c", SLIPS) == (0, "")


def test_a_sensor_of_two_words_reaches_everything(copy: Path) -> None:
    add_sensor(copy)
    for writer in WRITERS:
        assert python(copy, "-m", writer) == (0, "")

    assert guards(copy)[0] == 0
    assert "| `soil_moisture` |" in python(copy, "-m", "iveg.models.docs")[1]
    assert python(copy, "-c", WHOLE) == (0, "")
    assert (
        "soil_moisture: SoilMoisture | null"
        in (copy / "iveg/static/js/types.d.ts").read_text()
    )
    assert (
        'name: "soil_moisture"' in (copy / "iveg/static/js/core/sensors.js").read_text()
    )
    for page in ("mqtt.md", "ros2.md"):
        assert "soil_moisture" in (copy / "docs/interfaces" / page).read_text()
