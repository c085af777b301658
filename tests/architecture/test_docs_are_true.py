"""What the documents promise is what the code has.

Routes and live topics are compared with a running iVeg in ``tests/e2e``.
"""

from dataclasses import fields

import pytest

from iveg import settings
from iveg.ngsi import names
from tests.architecture import documents, sensor_pages
from tests.processes import ROOT

TOPICS = documents.named_headings(documents.interfaces())


def test_the_settings_page_is_the_table_of_settings() -> None:
    assert (ROOT / "docs/settings.md").read_text() == settings.describe()


@pytest.mark.parametrize(
    "variable",
    [row.metadata["variable"] for row in fields(settings.Settings)],
)
def test_every_setting_has_its_heading(variable: str) -> None:
    page = (ROOT / "docs/settings.md").read_text()

    assert f"\n## `{variable}`\n" in page


@pytest.mark.parametrize("device", names.ROBOT_DEVICES, ids=lambda d: d.suffix or "-")
def test_every_measure_topic_has_its_heading(device: names.RobotDevice) -> None:
    topic = names.measure_topic("{apikey}", "{robot}" + device.suffix)

    assert topic in TOPICS


@pytest.mark.parametrize(
    "topic",
    [
        names.measure_topic("{apikey}", names.CLIMATE_DEVICE),
        names.measure_topic("{apikey}", names.HEARTBEAT_ID),
        names.command_topic("{apikey}", "{robot}"),
        names.answer_topic("{apikey}", "{robot}"),
        names.FEEDBACK_TOPIC.format(robot_id="{robot}"),
        names.DESIRED_TOPIC.format(robot_id="{robot}"),
        names.PEER_SCAN_TOPIC.format(robot_id="{robot}"),
        *(names.direct_topic("{robot}", suffix) for suffix in names.DIRECT_SUFFIXES),
    ],
)
def test_every_other_topic_has_its_heading(topic: str) -> None:
    assert topic in TOPICS


@pytest.mark.parametrize("name", sensor_pages.PAGES)
def test_what_a_page_says_of_small_sensors_is_fresh(name: str) -> None:
    page = (documents.INTERFACES / name).read_text()

    stale = f"docs/interfaces/{name}: python -m tests.architecture.sensor_pages"
    assert page == sensor_pages.PAGES[name](page), stale


@pytest.mark.parametrize("one", [names.FEEDBACK_FILTER, names.PEER_SCAN_FILTER])
def test_what_robots_subscribe_to_is_in_the_contract(one: str) -> None:
    assert f"`{one}`" in documents.interfaces()
