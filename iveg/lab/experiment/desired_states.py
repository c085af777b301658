"""The retained desired states of a real site's robots, which an experiment gives back.

Its last STOP stays at the broker, where a robot of the site would find it at its next
start and be held for it.
"""

import asyncio
import contextlib
import ssl
from collections.abc import AsyncIterator, Collection, Mapping

import aiomqtt

from iveg.adapters.mqtt import NODELAY
from iveg.cli.nodes import broker_of
from iveg.domain.errors import DataFileError, HopError
from iveg.ngsi import names
from iveg.robot.orders import read_desired_state
from iveg.settings import Settings

_RETAINED_WITHIN_S = 1.0
"""A broker sends what is retained as soon as it is asked."""


async def read_free_robots(
    settings: Settings, robots: Collection[str]
) -> Mapping[str, bytes]:
    """Read what is retained of these robots; no STOP of the site may hold one.

    Returns:
        Desired state by robot, for those that have one.

    Raises:
        DataFileError: one is held.
        HopError: the broker does not answer.
    """
    async with _broker(settings) as client:
        found = await _desired(client, robots)
    for robot_id, payload in found.items():
        if read_desired_state(payload) is not None:
            reason = f"{robot_id} is held there by a STOP; release it first"
            raise DataFileError("--fiware", settings.mqtt_url, reason)
    return found


async def give_back(
    settings: Settings,
    robots: Collection[str],
    ids: Collection[str],
    before: Mapping[str, bytes],
) -> None:
    """Retain what was retained before these STOPs, and touch no other.

    Args:
        settings: Where the broker is.
        robots: Whose desired states are looked at.
        ids: The experiment's own STOPs; a state that names another one stays.
        before: As ``read_free_robots`` found it.

    Raises:
        HopError: the broker does not answer.
    """
    async with _broker(settings) as client:
        for robot_id, payload in (await _desired(client, robots)).items():
            held = read_desired_state(payload)
            if held and set(held) <= set(ids):
                topic = names.DESIRED_TOPIC.format(robot_id=robot_id)
                was = before.get(robot_id, b"")
                await client.publish(topic, was, qos=1, retain=True)


async def _desired(
    client: aiomqtt.Client, robots: Collection[str]
) -> Mapping[str, bytes]:
    """Retained desired states, by robot."""
    topics = {names.DESIRED_TOPIC.format(robot_id=one): one for one in robots}
    found: dict[str, bytes] = {}
    for topic in topics:
        await client.subscribe(topic, qos=1)
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(_RETAINED_WITHIN_S):
            async for message in client.messages:
                found[topics[message.topic.value]] = bytes(message.payload or b"")
    return found


@contextlib.asynccontextmanager
async def _broker(settings: Settings) -> AsyncIterator[aiomqtt.Client]:
    address = broker_of(settings)
    try:
        async with aiomqtt.Client(
            address.host,
            address.port,
            username=address.user,
            password=address.password,
            tls_context=ssl.create_default_context() if address.tls else None,
            socket_options=NODELAY,
        ) as client:
            yield client
    except aiomqtt.MqttError as error:
        raise HopError("mqtt", str(error)) from error
