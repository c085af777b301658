import asyncio
import logging
from collections.abc import AsyncIterator

import aiomqtt
import pytest

from iveg.lab.embedded.mqtt_broker import MqttBroker
from iveg.lab.embedded.mqtt_server import mqtt_broker


@pytest.fixture
async def broker() -> AsyncIterator[MqttBroker]:
    async with mqtt_broker("127.0.0.1", 0) as running:
        yield running


@pytest.fixture
async def robot(broker: MqttBroker) -> AsyncIterator[aiomqtt.Client]:
    async with aiomqtt.Client("127.0.0.1", broker.port) as client:
        yield client


@pytest.fixture
async def other(broker: MqttBroker) -> AsyncIterator[aiomqtt.Client]:
    async with aiomqtt.Client("127.0.0.1", broker.port) as client:
        yield client


async def heard(client: aiomqtt.Client) -> aiomqtt.Message:
    async with asyncio.timeout(30):
        return await anext(aiter(client.messages))


@pytest.mark.parametrize(
    "topic_filter", ["/iveg/AGI/cmd", "/iveg/+/cmd", "/iveg/#", "+/+/AGI/+", "#"]
)
async def test_a_filter_that_fits_hears(
    robot: aiomqtt.Client, other: aiomqtt.Client, topic_filter: str
) -> None:
    await robot.subscribe(topic_filter, qos=1)
    await other.publish("/iveg/AGI/cmd", b"x", qos=1)
    assert (await heard(robot)).payload == b"x"


async def test_a_subscription_made_later_counts_at_once(
    robot: aiomqtt.Client, other: aiomqtt.Client
) -> None:
    await robot.subscribe("a", qos=1)
    await other.publish("b", b"before", qos=1)
    await robot.subscribe("b", qos=1)
    await other.publish("b", b"after", qos=1)
    assert (await heard(robot)).payload == b"after"


async def test_what_is_unsubscribed_is_not_heard_any_more(
    robot: aiomqtt.Client, other: aiomqtt.Client
) -> None:
    await robot.subscribe([("a", 1), ("b", 1)])
    await other.publish("a", b"1", qos=1)
    await heard(robot)
    await robot.unsubscribe("a")
    await other.publish("a", b"2", qos=1)
    await other.publish("b", b"3", qos=1)
    assert (await heard(robot)).payload == b"3"


async def test_a_retained_level_waits_for_whoever_comes_and_can_be_cleared(
    robot: aiomqtt.Client, other: aiomqtt.Client
) -> None:
    await other.publish("/AGI/iveg/desired", b"stopped", qos=1, retain=True)
    await robot.subscribe("/AGI/iveg/desired", qos=1)
    message = await heard(robot)
    assert (message.payload, message.retain) == (b"stopped", True)
    await other.publish("/AGI/iveg/desired", b"", qos=1, retain=True)
    await heard(robot)
    await robot.unsubscribe("/AGI/iveg/desired")
    await robot.subscribe([("/AGI/iveg/desired", 1), ("end", 1)])
    await other.publish("end", b"end", qos=1)
    assert (await heard(robot)).payload == b"end"


@pytest.mark.parametrize(
    ("published", "subscribed", "heard_with"), [(0, 1, 0), (1, 0, 0), (1, 1, 1)]
)
async def test_a_retained_level_comes_with_the_lesser_quality(
    robot: aiomqtt.Client,
    other: aiomqtt.Client,
    published: int,
    subscribed: int,
    heard_with: int,
) -> None:
    await other.publish("level", b"x", qos=published, retain=True)
    await other.publish("after", b"y", qos=1)
    await robot.subscribe("level", qos=subscribed)
    message = await heard(robot)
    assert (message.payload, message.qos) == (b"x", heard_with)


async def test_a_neighbour_hears_and_publishes_without_a_connection(
    broker: MqttBroker, robot: aiomqtt.Client
) -> None:
    taken: list[tuple[str, bytes]] = []
    broker.listen(lambda topic, payload: taken.append((topic, payload)))
    await robot.subscribe("/iveg/AGI/cmd", qos=1)
    await robot.publish("/iveg/AGI/attrs", b"measure", qos=1)
    broker.publish("/iveg/AGI/cmd", b"order", 0, retain=False)
    message = await heard(robot)
    assert taken == [("/iveg/AGI/attrs", b"measure")]
    assert (message.payload, message.qos) == (b"order", 0)


async def test_a_neighbour_that_fails_hurts_no_client(
    broker: MqttBroker, robot: aiomqtt.Client, caplog: pytest.LogCaptureFixture
) -> None:
    def fail(topic: str, payload: bytes) -> None:
        raise ValueError(topic, payload)

    broker.listen(fail)
    await robot.subscribe("a", qos=1)
    await robot.publish("a", b"x", qos=1)
    assert (await heard(robot)).payload == b"x"
    (told,) = [one for one in caplog.records if one.levelno >= logging.WARNING]
    assert told.getMessage() == "a message on a could not be taken"


async def test_messages_of_one_client_keep_their_order(
    robot: aiomqtt.Client, other: aiomqtt.Client
) -> None:
    await robot.subscribe("n", qos=0)
    sent = [b"%d" % number for number in range(300)]
    for payload in sent:
        await other.publish("n", payload, qos=0)
    assert [(await heard(robot)).payload for _ in sent] == sent
