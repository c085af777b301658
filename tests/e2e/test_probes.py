"""Names that are markup are text on every page, never more."""

import json
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from paho.mqtt import publish
from playwright.sync_api import expect

import iveg
from iveg.adapters.mqtt import BrokerAddress
from tests.e2e.conftest import OpenPage
from tests.e2e.reading import evaluate, visit
from tests.processes import EMULATOR, Site, site

pytestmark = pytest.mark.e2e

PROBE = "<img src=x onerror=window.probed=1>"
ROUTES = ("/", "/alerts", "/commands", "/history", "/fleet", "/climate", "/settings")


@pytest.fixture(scope="module")
def stack(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A greenhouse whose middle lane is named in markup, with robots that drive."""
    place = tmp_path_factory.mktemp("probed")
    greenhouse = Path(iveg.__file__).parent / "data/greenhouses/mvsim-20x20.toml"
    named = greenhouse.read_text().replace('"Pasillo 3"', f'"{PROBE}"')
    assert PROBE in named
    (place / "house.toml").write_text(named)
    with site(place, IVEG_GREENHOUSE=str(place / "house.toml")) as probed:
        probed.start("fiware").wait_until_ready()
        probed.start("serve")
        probed.wait_until_served()
        probed.start(*EMULATOR)
        probed.wait_until_live()
        yield probed


def test_a_robot_that_nobody_named_is_nobody(stack: Site) -> None:
    told = _notify(stack, PROBE)
    _publish(stack, PROBE.replace(" ", ""), "odom", _odometry())

    # Taken and counted, as Orion would try again for ever.
    assert told == 204
    with stack.api() as api:
        ids = [robot["robot_id"] for robot in api.get("robots").json()["items"]]
    assert ids == ["AGI", "AGII"]


def test_a_class_and_a_lane_in_markup_are_text_on_every_page(
    open_page: OpenPage, stack: Site
) -> None:
    """After all that came before."""
    page = open_page()
    corners = {"xmin": 9, "xmax": 9.5, "ymin": 9, "ymax": 9.5, "zmin": 0, "zmax": 1}
    box = {"class_id": PROBE, "probability": 0.99, "position": corners}
    _publish(stack, "AGI", "yolox_bounding_boxes", {"bounding_boxes": box})
    with stack.api() as api:
        lanes = [lane["label"] for lane in api.get("map").json()["lanes"]]

    assert PROBE in lanes
    expect(page.locator("#log")).to_contain_text("onerror")
    page.locator("[data-opens=people-panel]").click()
    expect(page.locator("#people-list")).to_contain_text("onerror")
    for route in ROUTES:
        visit(page, route)
        assert page.locator("img[src=x]").count() == 0
        assert evaluate(page, "() => window.probed ?? null") is None


def _odometry() -> dict[str, object]:
    pose = {"x": 1, "y": 1, "yaw": 0, "linear_velocity": 0, "angular_velocity": 0}
    return {"base_pose_ground_truth": pose}


def _notify(stack: Site, robot: str) -> int:
    """What the notification of a robot that nobody named is answered."""
    secret = {"X-Iveg-Notify-Token": stack.settings["IVEG_NOTIFY_TOKEN"]}
    attributes = {
        name: {"type": "StructuredValue", "value": value}
        for name, value in _odometry().items()
    }
    entity = {"id": robot, "type": "Robot", **attributes}
    body = {"subscriptionId": "0" * 24, "data": [entity]}
    address = stack.settings["IVEG_NOTIFY_URL"]
    return httpx.post(
        address, json=body, headers=secret, timeout=10.0, trust_env=False
    ).status_code


def _publish(stack: Site, robot: str, kind: str, payload: dict[str, object]) -> None:
    broker = BrokerAddress.from_url(stack.settings["IVEG_MQTT_URL"])
    topic = f"/iveg/{robot}_{kind}/attrs"
    text = json.dumps(payload)
    publish.single(topic, text, qos=1, hostname=broker.host, port=broker.port)
