"""Orion's door: who comes in, what is answered, what becomes of it."""

from collections.abc import AsyncIterator

import pytest

from iveg.domain.observations import Odometry
from tests.builders import notification, pose_value
from tests.unit.web.desk import SECRET, TENANT, WebDesk

URL = "/ngsi/notifications"
ODOMETRY = "base_pose_ground_truth"
FORMER = "cd" * 32


def ours(**parts: object) -> bytes:
    return notification(subscription_id="ours", **parts)  # type: ignore[arg-type]


def met() -> WebDesk:
    """One that AGI's boot has spoken to."""
    desk = WebDesk()
    desk.notifications.receive(ours(attributes={ODOMETRY: pose_value(seq=0)}))
    desk.health_monitor.notified_at = None
    return desk


async def test_a_notification_is_taken_and_queued() -> None:
    desk = met()
    async with desk.orion() as orion:
        answer = await orion.post(URL, content=ours())

    (queued,) = desk.ingest.drain()
    assert (answer.status_code, answer.content) == (204, b"")
    assert isinstance(queued.observation, Odometry)
    assert (queued.transport, queued.is_query_answer) == ("fiware", False)
    assert desk.health_monitor.notified_at == desk.clock().mono


@pytest.mark.parametrize(
    ("secret", "counted"),
    [
        (None, "forged_notification"),
        ("", "forged_notification"),
        ("wrong", "forged_notification"),
        (SECRET[:-1], "forged_notification"),
        (SECRET + "0", "forged_notification"),
        ("ä" * 64, "forged_notification"),
        # Our own subscription of an earlier start is no forgery.
        (FORMER, "former_secret"),
    ],
)
async def test_f35_a_wrong_secret_is_401_and_counted(
    secret: str | None, counted: str
) -> None:
    desk = WebDesk()
    desk.subscriptions.former_secrets = frozenset({FORMER})
    headers = [(k.encode(), v.encode()) for k, v in TENANT.items()]
    given = [] if secret is None else [secret.encode("latin-1")]
    headers += [(b"X-Iveg-Notify-Token", text) for text in given]
    async with desk.stranger() as stranger:
        answer = await stranger.post(URL, content=ours(), headers=headers)

    assert answer.status_code == 401
    assert answer.headers["content-type"] == "application/problem+json"
    assert list(desk.ingest.drain()) == []
    rejected = {name for name in desk.ingest.counters if name.startswith("rejected")}
    assert rejected == {f"rejected.{counted}"}
    assert desk.health_monitor.notified_at is None


@pytest.mark.parametrize(("size", "status"), [(1_048_576, 400), (1_048_577, 413)])
async def test_f26_more_than_a_mebibyte_is_413(size: int, status: int) -> None:
    async with WebDesk().orion() as orion:
        answer = await orion.post(URL, content=b" " * size)

    assert answer.status_code == status


@pytest.mark.parametrize(
    ("subscription", "tenant", "counted"),
    [
        ("theirs", {}, "unknown_subscription"),
        ("ours", {"Fiware-Service": "other"}, "foreign_tenant"),
        ("ours", {"Fiware-ServicePath": "/other"}, "foreign_tenant"),
    ],
)
async def test_an_unknown_subscription_or_tenant_is_taken_ignored_and_counted(
    subscription: str, tenant: dict[str, str], counted: str
) -> None:
    desk = WebDesk()
    body = notification(subscription_id=subscription)
    async with desk.orion() as orion:
        answer = await orion.post(URL, content=body, headers=tenant)

    assert answer.status_code == 204
    assert list(desk.ingest.drain()) == []
    assert desk.ingest.counters[f"rejected.{counted}"] == 1


@pytest.mark.parametrize("boot", ["boot-a", None])
async def test_the_first_of_a_boot_is_no_news_however_often_it_comes(
    boot: str | None,
) -> None:
    desk = WebDesk()
    kept = pose_value(1.0, seq=7, boot=boot)
    for value in (kept, kept) if boot else (kept,):
        desk.notifications.receive(ours(attributes={ODOMETRY: value}))
    desk.loop.step(desk.ingest.drain(), desk.clock())
    robot = desk.world.robot("AGI")

    assert (robot.odometry, robot.link(desk.clock())) == (None, "UNKNOWN")
    assert desk.ingest.counters["alone.Odometry"] == (2 if boot else 1)

    going_on = pose_value(1.1, seq=8, boot=boot)
    desk.notifications.receive(ours(attributes={ODOMETRY: going_on}))
    desk.loop.step(desk.ingest.drain(), desk.clock())
    assert robot.odometry is not None


async def test_boxes_of_the_first_frame_of_a_boot_slow_and_prove_no_detector() -> None:
    desk = WebDesk()
    desk.drive("AGII", linear=0.0)
    desk.look("AGII")
    place = {"xmin": 1.3, "xmax": 1.7, "ymin": -0.2, "ymax": 0.2, "zmin": 0, "zmax": 2}
    box = {"class_id": "person", "probability": 0.9, "frame_id": "map"}
    said = {
        "bounding_boxes": [{**box, "position": place}],
        "detection_header": pose_value(seq=7),
    }
    desk.notifications.receive(ours(attributes=said))
    desk.clock.now += 0.1
    desk.loop.step(desk.ingest.drain(), desk.clock())

    assert desk.evaluator.speed_limits["AGII"].reason == "person"
    assert desk.world.robot("AGI").detector.whole_at is None
    assert desk.ingest.counters["alone.DetectionFrame"] == 1


def test_what_is_replayed_changes_nothing() -> None:
    desk = met()
    for batch in ([(1, 1)], [(1, "")], [(2, "")], [(2, 2)], [(3, 3), (4, 4), (3, 5)]):
        for seq, x in batch:
            said = {ODOMETRY: pose_value(seq=seq) | {"x": x}}
            desk.notifications.receive(ours(attributes=said))
        desk.loop.step(desk.ingest.drain(), desk.clock())
    assert desk.views.robot("AGI", desk.clock()).model_dump()["pose"]["x"] == 4.0
    assert desk.world.counters["Odometry.duplicate"] == 1
    assert desk.ingest.counters["rejected.bad_base_pose_ground_truth"] == 1


async def test_a_body_without_a_length_is_413_as_soon_as_it_is_too_long() -> None:
    desk = WebDesk()
    sent = 0

    async def endless() -> AsyncIterator[bytes]:
        nonlocal sent
        while True:
            sent += 1
            yield b" " * 65_536

    async with desk.orion() as orion:
        answer = await orion.post(URL, content=endless())

    assert answer.status_code == 413
    assert answer.headers["content-type"] == "application/problem+json"
    assert sent <= 18
