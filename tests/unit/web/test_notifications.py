"""Orion's door: who comes in, what is answered, what becomes of it."""

from collections.abc import AsyncIterator

import pytest
from starlette.types import Message

from iveg.domain.observations import Odometry
from tests.builders import notification, pose_value
from tests.unit.web.desk import SECRET, TENANT, WebDesk

URL = "/ngsi/notifications"


def ours(**parts: object) -> bytes:
    return notification(subscription_id="ours", **parts)  # type: ignore[arg-type]


async def test_a_notification_is_taken_and_queued() -> None:
    desk = WebDesk()
    async with desk.orion() as orion:
        answer = await orion.post(URL, content=ours())

    (queued,) = desk.ingest.drain()
    assert (answer.status_code, answer.content) == (204, b"")
    assert isinstance(queued.observation, Odometry)
    assert (queued.transport, queued.asked) == ("fiware", False)
    assert desk.heard == [desk.clock()]


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"no json",
        b"[]",
        b'{"subscriptionId": "ours"}',
        ours().replace(b'"x":0.0', b'"x":NaN'),
        ours().replace(b'"x":0.0', b'"x":1e999'),
        b"[" * 100_000,
    ],
)
async def test_what_cannot_be_read_is_400(body: bytes) -> None:
    desk = WebDesk()
    async with desk.orion() as orion:
        answer = await orion.post(URL, content=body)

    assert answer.status_code == 400
    assert answer.headers["content-type"] == "application/problem+json"
    assert list(desk.ingest.drain()) == []


@pytest.mark.parametrize(
    "secret", [None, "", "wrong", SECRET[:-1], SECRET + "0", "ä" * 64]
)
async def test_f35_a_wrong_secret_is_401_and_counted(secret: str | None) -> None:
    desk = WebDesk()
    headers = [(k.encode(), v.encode()) for k, v in TENANT.items()]
    given = [] if secret is None else [secret.encode("latin-1")]
    headers += [(b"X-Iveg-Notify-Token", text) for text in given]
    async with desk.stranger() as stranger:
        answer = await stranger.post(URL, content=ours(), headers=headers)

    assert answer.status_code == 401
    assert answer.headers["content-type"] == "application/problem+json"
    assert list(desk.ingest.drain()) == []
    assert desk.ingest.counters["rejected.forged_notification"] == 1
    assert desk.heard == []


@pytest.mark.parametrize(
    ("secret", "counted"),
    [
        ("cd" * 32, "former_secret"),
        ("ef" * 32, "forged_notification"),
        (None, "forged_notification"),
    ],
)
async def test_our_own_subscription_of_an_earlier_start_is_no_forgery(
    caplog: pytest.LogCaptureFixture, secret: str | None, counted: str
) -> None:
    desk = WebDesk()
    desk.former_secrets.add("cd" * 32)
    given = {} if secret is None else {"X-Iveg-Notify-Token": secret}
    async with desk.stranger() as stranger:
        answer = await stranger.post(URL, content=ours(), headers=TENANT | given)

    assert answer.status_code == 401
    assert list(desk.ingest.drain()) == []
    assert {n for n in desk.ingest.counters if n.startswith("rejected")} == {
        f"rejected.{counted}"
    }
    assert ("forged" in caplog.text) == (counted == "forged_notification")


@pytest.mark.parametrize(("size", "status"), [(1_048_576, 400), (1_048_577, 413)])
async def test_f26_more_than_a_mebibyte_is_413(size: int, status: int) -> None:
    async with WebDesk().orion() as orion:
        answer = await orion.post(URL, content=b" " * size)

    assert answer.status_code == status


async def test_an_unknown_subscription_is_taken_ignored_and_counted() -> None:
    desk = WebDesk()
    async with desk.orion() as orion:
        answer = await orion.post(URL, content=notification(subscription_id="theirs"))

    assert answer.status_code == 204
    assert list(desk.ingest.drain()) == []
    assert desk.ingest.counters["rejected.unknown_subscription"] == 1


@pytest.mark.parametrize(
    "tenant", [{"Fiware-Service": "other"}, {"Fiware-ServicePath": "/other"}]
)
async def test_another_tenant_is_taken_ignored_and_counted(
    tenant: dict[str, str],
) -> None:
    desk = WebDesk()
    async with desk.orion() as orion:
        answer = await orion.post(URL, content=ours(), headers=tenant)

    assert answer.status_code == 204
    assert list(desk.ingest.drain()) == []
    assert desk.ingest.counters["rejected.foreign_tenant"] == 1


async def test_another_type_is_taken_ignored_and_counted() -> None:
    desk = WebDesk()
    async with desk.orion() as orion:
        answer = await orion.post(URL, content=ours(entity_type="Room"))

    assert answer.status_code == 204
    assert desk.ingest.counters["rejected.foreign_entity"] == 1


async def test_an_unknown_robot_is_taken_ignored_and_counted() -> None:
    desk = WebDesk()
    async with desk.orion() as orion:
        await orion.post(URL, content=ours(robot_id="AGX"))

    assert desk.ingest.counters["rejected.unknown_robot"] == 1


async def test_what_is_replayed_changes_nothing() -> None:
    desk = WebDesk()
    async with desk.orion() as orion:
        for seq, x in ((1, 1.0), (2, 2.0), (1, 1.0)):
            value = pose_value(x, seq=seq)
            await orion.post(URL, content=ours(attributes={ODOMETRY: value}))
    desk.loop.step(desk.ingest.drain(), desk.clock())

    newest = desk.world.robot("AGI").odometry
    assert newest is not None
    assert newest.pose.x == 2.0
    assert desk.world.counters["Odometry.duplicate"] == 1


ODOMETRY = "base_pose_ground_truth"


async def test_one_bad_attribute_is_counted_and_the_good_ones_are_taken() -> None:
    desk = WebDesk()
    attributes = {ODOMETRY: pose_value(), "navigation": {"task": 7}}
    async with desk.orion() as orion:
        answer = await orion.post(URL, content=ours(attributes=attributes))

    assert answer.status_code == 204
    assert len(list(desk.ingest.drain())) == 1
    assert desk.ingest.counters["rejected.bad_navigation"] == 1


async def test_a_signed_in_browser_is_not_orion() -> None:
    async with WebDesk().browser("admin") as browser:
        answer = await browser.post(URL, content=ours(), headers=TENANT)

    assert answer.status_code == 401


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


async def test_a_body_in_parts_is_one_notification() -> None:
    desk = WebDesk()
    whole = ours()

    async def parts() -> AsyncIterator[bytes]:
        for start in range(0, len(whole), 40):
            yield whole[start : start + 40]

    async with desk.orion() as orion:
        answer = await orion.post(URL, content=parts())

    assert answer.status_code == 204
    assert len(list(desk.ingest.drain())) == 1


@pytest.mark.parametrize("method", ["GET", "PUT", "DELETE"])
async def test_only_a_post_is_a_notification(method: str) -> None:
    async with WebDesk().orion() as orion:
        answer = await orion.request(method, URL)

    assert answer.status_code == 405
    assert answer.headers["content-type"] == "application/problem+json"


async def test_a_sender_who_hangs_up_half_way_is_no_notification() -> None:
    desk = WebDesk()
    came: list[Message] = [
        {"type": "http.request", "body": ours()[:20], "more_body": True},
        {"type": "http.disconnect"},
    ]
    answered: list[Message] = []
    secret = {"X-Iveg-Notify-Token": SECRET, **TENANT}
    head = [(name.lower().encode(), text.encode()) for name, text in secret.items()]
    scope = {"type": "http", "method": "POST", "path": URL, "headers": head}

    async def receive() -> Message:
        return came.pop(0)

    async def send(message: Message) -> None:
        answered.append(message)

    await desk.app(scope, receive, send)

    assert answered == []
    assert desk.heard == []
