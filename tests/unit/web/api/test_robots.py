"""The REST twins of what is live say what is known and how old it is."""

from dataclasses import replace

import pytest

from iveg.domain.observations import (
    Battery,
    Climate,
    CommandStatus,
    Hold,
    Navigation,
    RobotFault,
)
from tests.builders import detection, safety_report, scan
from tests.unit.pipeline.desk import settle
from tests.unit.web.desk import WebDesk


async def get(desk: WebDesk, path: str) -> object:
    async with desk.browser("viewer") as browser:
        answer = await browser.get(f"/api/v1{path}")
    assert answer.status_code == 200
    return answer.json()


async def test_a_robot_that_was_never_heard_is_all_unknown() -> None:
    told = await get(WebDesk(), "/robots/AGI")

    assert isinstance(told, dict)
    assert told["link"] == "UNKNOWN"
    assert (told["pose"], told["age_s"], told["speed_factor"]) == (None, None, None)
    assert told["speed_limit"]["speed_factor"] == 0.5


async def test_a_robot_is_told_with_pose_age_speed_limit_and_profile() -> None:
    desk = WebDesk()
    desk.drive("AGI", 3.0)
    desk.report("AGI", factor=0.5, reason="person")
    desk.hear(Navigation("AGI", desk.next_origin(), "harvest", (1.0, 2.0), ((0, 0),)))
    desk.hear(CommandStatus("AGI", "PENDING"))
    desk.clock.now = 0.5

    told = await get(desk, "/robots/AGI")

    assert isinstance(told, dict)
    assert told["pose"] == {"x": 3.0, "y": 0.0, "yaw": 0.0}
    assert (told["link"], told["age_s"], told["mode"]) == ("LIVE", 0.5, "SLOW")
    assert told["stamp"] == "2023-11-14T22:13:20.000Z"
    assert told["applied"]["reason"] == "person"
    assert told["navigation"] == {
        "task": "harvest",
        "goal": {"x": 1.0, "y": 2.0},
        "path": [[0, 0]],
    }
    assert told["cmd_status"] == "PENDING"
    assert told["profile"]["drive"] == "differential"


async def test_a_robot_is_told_with_what_it_finds_wrong_with_its_own_data() -> None:
    desk = WebDesk()
    desk.drive("AGI")
    fault = RobotFault("no_transform", "map → odom", 2.1)
    desk.hear(replace(safety_report("AGI"), faults=(fault,)))

    told = await get(desk, "/robots/AGI")

    assert isinstance(told, dict)
    assert told["applied"]["faults"] == [
        {"code": "no_transform", "about": "map → odom", "for_s": 2.1}
    ]


async def test_a_robot_that_says_nothing_of_its_speed_is_told_by_its_speed_limit() -> (
    None
):
    desk = WebDesk()
    desk.drive("AGI")
    desk.clock.now = 0.1
    desk.loop.step([], desk.clock())

    told = await get(desk, "/robots/AGI")

    assert isinstance(told, dict)
    assert told["mode"] == "SLOW"
    assert told["speed_limit"]["reason"] == "stale"


@pytest.mark.parametrize(
    ("holds", "factor", "mode"),
    [
        ((Hold("hw-1", "hw", "local"),), 0.0, "STOPPED"),
        ((), 0.0, "STOPPED"),
        ((), 0.5, "SLOW"),
        ((), 1.0, "RUNNING"),
    ],
)
async def test_the_mode_is_what_the_robot_says(
    holds: tuple[Hold, ...], factor: float, mode: str
) -> None:
    desk = WebDesk()
    desk.report("AGI", *holds, factor=factor, reason="clear")

    told = await get(desk, "/robots/AGI")

    assert isinstance(told, dict)
    assert told["mode"] == mode
    assert [one["id"] for one in told["holds"]] == [hold.id for hold in holds]


async def test_a_robot_that_is_to_stop_is_told_with_its_command() -> None:
    desk = WebDesk()
    await desk.commander.stop(["AGI"], "ana", desk.clock())
    await settle()

    told = await get(desk, "/robots/AGI")

    assert isinstance(told, dict)
    assert (told["mode"], told["stop_state"]) == ("SLOW", "SENT")
    assert told["stop"]["requested_by"] == "ana"
    assert told["stop"]["transports"] == {"direct": "ok", "fiware": "pending"}
    assert told["stop"]["hold_id"] == told["stop"]["command_id"]
    assert told["stop"]["note"] is None
    assert not told["stop"]["challenge_fresh"]


@pytest.mark.parametrize(
    ("direct", "lag_s", "key"),
    [
        (True, 0.4, None),
        (True, 12.34, "stop.note.direct"),
        (False, 12.34, "stop.note.fiware"),
    ],
)
async def test_an_order_says_what_a_late_agent_means_for_it(
    direct: bool, lag_s: float, key: str | None
) -> None:
    desk = WebDesk()
    desk.fleet.fails = not direct
    desk.lag(lag_s)
    await desk.commander.stop(["AGI"], "ana", desk.clock())
    await settle()

    told = desk.views.robot("AGI", desk.clock()).stop

    assert told is not None
    note = told.note
    assert (None if note is None else note.key) == key
    assert note is None or note.slots == {"lag": 12.3}


async def test_a_robot_is_stopped_when_it_says_so_and_not_when_it_was_asked() -> None:
    desk = WebDesk()
    await desk.commander.stop(["AGI"], "ana", desk.clock())
    asked = desk.views.robot("AGI", desk.clock()).mode
    hold_id = desk.commander.machine("AGI").hold_id or ""

    desk.report("AGI", Hold(hold_id, "iveg", "remote"))

    assert asked == "SLOW"
    assert desk.views.robot("AGI", desk.clock()).mode == "STOPPED"


async def test_a_hold_that_was_last_reported_long_ago_stops_nothing_now() -> None:
    desk = WebDesk()
    desk.report("AGI", Hold("boot-1", "boot", "remote"))
    modes = []
    for age in (0.0, 1.5, 1.6, 60.0):
        desk.clock.now = age
        modes.append(desk.views.robot("AGI", desk.clock()).mode == "STOPPED")

    assert modes == [True, True, False, False]


async def test_the_fleet_is_a_page_of_robots() -> None:
    told = await get(WebDesk(), "/robots")

    assert isinstance(told, dict)
    assert [one["robot_id"] for one in told["items"]] == ["AGI", "AGII"]
    assert told["next"] is None


async def test_a_robot_that_is_not_there_is_404() -> None:
    async with WebDesk().browser() as browser:
        answers = [
            (await browser.get(f"/api/v1/robots/AGX{part}")).status_code
            for part in ("", "/scan")
        ]

    assert answers == [404, 404]


async def test_a_scan_is_points_in_the_map() -> None:
    desk = WebDesk()
    desk.drive("AGI", 10.0)
    desk.hear(scan(origin=desk.next_origin()))

    told = await get(desk, "/robots/AGI/scan")

    assert isinstance(told, dict)
    assert told["frame_id"] == "map"
    assert told["points"] == [[11.0, 0.0], [10.0, 2.0], [10.0, -4.0]]


async def test_before_the_first_scan_there_are_no_points() -> None:
    told = await get(WebDesk(), "/robots/AGI/scan")

    assert isinstance(told, dict)
    assert (told["points"], told["stamp"]) == ([], None)


async def test_people_are_told_with_ring_observers_and_who_acts() -> None:
    desk = WebDesk()
    desk.drive("AGI")
    desk.drive("AGII", 50.0)
    desk.look("AGII", detection("farmer", 1.5))

    told = await get(desk, "/people")

    assert isinstance(told, dict)
    (person,) = told["items"]
    assert (person["class"], person["class_id"]) == ("person", "farmer")
    assert person["stage"] == "seen"
    assert person["radius_m"] == pytest.approx(2.0)
    assert person["observers"] == ["AGII"]
    assert person["acting"] == [
        {"robot_id": "AGI", "distance_m": 1.5, "in_sight": True}
    ]


async def test_somebody_last_seen_long_ago_has_no_ring() -> None:
    desk = WebDesk()
    desk.look("AGII", detection("farmer", 1.5))
    desk.clock.now = 60.0

    told = await get(desk, "/people")

    assert isinstance(told, dict)
    (person,) = told["items"]
    assert (person["stage"], person["radius_m"]) == ("last_seen", None)
    assert person["observers"] == []


async def test_a_look_is_told_with_faint_ones_and_peers() -> None:
    desk = WebDesk()
    desk.drive("AGII", 5.0)
    desk.look("AGI", detection("farmer", 1.0, probability=0.6), detection("husky", 5.0))

    frame = desk.views.frame("AGI", desk.clock())

    assert frame is not None
    assert [one.confident for one in frame.items] == [False, True]
    assert [one.peer for one in frame.items] == [None, "AGII"]
    assert desk.views.frame("AGII", desk.clock()) is None


async def test_the_air_is_told_with_its_age_or_not_at_all() -> None:
    desk = WebDesk()
    assert await get(desk, "/climate") is None
    desk.hear(Climate(21.5, 0.6, None))
    desk.clock.now = 4.0

    told = await get(desk, "/climate")

    assert told == {
        "temperature": 21.5,
        "relative_humidity": 0.6,
        "co2": None,
        "received_at": "2023-11-14T22:13:20.000Z",
        "age_s": 4.0,
    }


async def test_13_11_the_server_tells_when_each_device_was_last_heard_of() -> None:
    desk = WebDesk()
    desk.drive("AGI", 1.0)
    desk.clock.now = 40.0
    desk.look("AGI", detection("farmer", 1.0))
    desk.hear(Battery("AGI", desk.next_origin(), 0.5))
    desk.clock.now = 42.0

    told = await get(desk, "/devices")

    assert isinstance(told, dict)
    ages = {
        one["device"]: one["age_s"] for one in told["items"] if one["robot_id"] == "AGI"
    }
    assert ages == {
        "AGI": 2.0,
        "AGI_odom": 42.0,
        "AGI_lidar2D": None,
        "AGI_yolox_bounding_boxes": 2.0,
        "AGI_safety": None,
        "AGI_nav": None,
        "AGI_battery": 2.0,
    }


async def test_the_map_is_the_greenhouse() -> None:
    told = await get(WebDesk(), "/map")

    assert isinstance(told, dict)
    assert told["name"] == "field"
    assert told["bounds"] == {"xmin": -100, "ymin": -100, "xmax": 100, "ymax": 100}


async def test_alerts_are_told_gravest_first() -> None:
    desk = WebDesk()
    desk.drive("AGI", linear=0.0)
    desk.drive("AGII", 50.0, linear=0.5)
    await desk.wait(3.2)

    assert [one.priority for one in desk.views.alerts()] == ["P1", "P2"]


@pytest.mark.parametrize(
    "path", ["/robots", "/robots/AGI", "/people", "/map", "/climate", "/health"]
)
async def test_a_stranger_is_told_nothing(path: str) -> None:
    async with WebDesk().stranger() as stranger:
        answer = await stranger.get(f"/api/v1{path}")

    assert answer.status_code == 401


async def test_the_margin_to_a_person_is_told_with_its_parts() -> None:
    desk = WebDesk()
    desk.drive("AGI", 0.0, linear=1.0)
    desk.drive("AGII", 50.0)
    desk.look("AGII", detection("farmer", 3.8))

    robot = await get(desk, "/robots/AGI")
    people = await get(desk, "/people")

    assert isinstance(robot, dict)
    assert isinstance(people, dict)
    margin = robot["margin"]
    assert (margin["person_id"], margin["band"]) == ("P1", "inside")
    assert margin["gap_m"] == pytest.approx(3.0, abs=0.01)
    assert sum(margin["parts"].values()) == pytest.approx(margin["needs_m"], abs=0.02)
    assert margin["margin_m"] == pytest.approx(
        margin["gap_m"] - margin["needs_m"], abs=0.02
    )
    (person,) = people["items"]
    assert person["margin"] == margin


async def test_a_robot_alone_has_no_margin() -> None:
    desk = WebDesk()
    desk.drive("AGI", 0.0)

    robot = await get(desk, "/robots/AGI")

    assert isinstance(robot, dict)
    assert robot["margin"] is None
