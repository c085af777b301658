"""DDS, unicast on loopback: qualities of service, who is there."""

from collections.abc import Iterator
from dataclasses import replace

import pytest

from iveg.domain.errors import HopError
from iveg.ros2 import cdr, names
from iveg.ros2 import detector_messages as d
from iveg.ros2 import messages as ros
from iveg.ros2.cdr import type_hash
from iveg.ros2.messages import Message
from iveg.ros2.names import Qos
from tests.dds import Dds, DdsNetwork, free_domain, loopback, start_stranger
from tests.processes import until

RELIABLE, BEST_EFFORT = names.DEFAULT, names.SENSOR_DATA
KEPT = names.TF_STATIC


@pytest.fixture(scope="module")
def domain() -> int:
    return free_domain()


@pytest.fixture
def dds(domain: int) -> Iterator[Dds]:
    with Dds(loopback(domain)) as found:
        yield found


@pytest.fixture
def other(domain: int) -> Iterator[Dds]:
    with Dds(loopback(domain)) as found:
        yield found


@pytest.mark.parametrize(
    ("offered", "asked"),
    [
        (BEST_EFFORT, BEST_EFFORT),
        (RELIABLE, BEST_EFFORT),
        (RELIABLE, RELIABLE),
        (KEPT, KEPT),
    ],
)
def test_a_reader_hears_a_writer_that_offers_what_it_asks(
    dds: Dds, other: Dds, offered: Qos, asked: Qos
) -> None:
    said = cdr.write(ros.Twist())
    writer = other.writer("/heard", ros.Twist, offered)
    writer.write(said)
    reader = dds.reader("/heard", ros.Twist, asked)

    def heard() -> list[bytes]:
        if offered is not KEPT:
            writer.write(said)
        return reader.take()

    assert set(until(heard, "a message", 10.0)) == {said}


@pytest.mark.parametrize(
    ("offered", "asked"), [(BEST_EFFORT, RELIABLE), (RELIABLE, KEPT)]
)
def test_a_reader_that_asks_for_more_than_is_offered_is_not_met_and_shows_it(
    dds: Dds, other: Dds, offered: Qos, asked: Qos
) -> None:
    other.writer("/missed", ros.Twist, offered)
    reader = dds.reader("/missed", ros.Twist, asked)
    modest = dds.reader("/missed", ros.Twist, BEST_EFFORT)

    until(lambda: modest.writers, "one that asks for less is met", 10.0)
    (met,) = (it for it in dds.endpoints() if it.topic == "/missed" and it.writes)

    assert reader.writers == 0
    assert asked.lacks(met.qos)


def test_a_message_of_another_layout_never_arrives(dds: Dds, other: Dds) -> None:
    """DDS checks payloads against the type before anybody reads them."""
    writer = other.writer("/short", ros.Twist, RELIABLE)
    reader = dds.reader("/short", ros.Twist, RELIABLE)
    until(lambda: writer.readers == 1 and reader.writers == 1, "both met")

    with pytest.raises(HopError):
        writer.write(cdr.write(ros.Vector3()))

    assert reader.take() == []


@pytest.mark.parametrize(
    "message",
    [d.BoundingBoxes, d.BoundingBoxes3d, d.DetectionArray],
)
def test_a_detector_is_met_in_its_type_and_tells_its_hash(
    dds: Dds, domain: int, message: type[Message]
) -> None:
    said = cdr.write(message())
    with Dds(loopback(domain), gate="AGI") as other:
        writer = other.writer("/boxes", message, RELIABLE)
        # Tools of ROS may have readers of other types there.
        dds.reader("/boxes", ros.Detection3DArray, RELIABLE)
        reader = dds.reader("/boxes", message, RELIABLE)
        until(lambda: writer.readers == 1 and reader.writers == 1, "both met")

        writer.write(said)

        assert until(reader.take, "boxes", 10.0) == [said]
        met = [one for one in dds.endpoints() if one.writes and one.topic == "/boxes"]
        assert [(one.type, one.type_hash, one.gate) for one in met] == [
            (message.ROS, type_hash(message), "AGI")
        ]
    until(lambda: "/boxes" not in _topics(dds), "it has gone")


def test_a_domain_that_was_opened_otherwise_is_refused(domain: int) -> None:
    with Dds(loopback(domain)), pytest.raises(HopError, match="otherwise"):
        Dds(type(loopback(domain))(domain, "127.0.0.1", ("127.0.0.2",)))


@pytest.mark.parametrize(
    ("network", "what"),
    [
        (DdsNetwork(0, "iveg-none"), "no interface iveg-none"),
        (DdsNetwork(0, "127.0.0.1", ("iveg.invalid",)), "peer iveg.invalid"),
        (DdsNetwork(0, "127.0.0.1", ("::1",)), "peer ::1"),
    ],
)
def test_an_address_that_does_not_exist_is_named(
    network: DdsNetwork, what: str
) -> None:
    """Cyclone ends the process for a peer that it cannot resolve."""
    with pytest.raises(HopError, match=what):
        Dds(replace(network, domain=free_domain()))


def test_a_publisher_that_came_and_went_between_two_looks_is_told_once(
    dds: Dds, domain: int
) -> None:
    with Dds(loopback(domain)) as other:
        reader = dds.reader("/brief", ros.Twist, RELIABLE)
        other.writer("/brief", ros.Twist, RELIABLE)
        until(lambda: reader.writers == 1, "both met")
    until(lambda: reader.writers == 0, "it has gone")

    assert "/brief" in _topics(dds)
    assert "/brief" not in _topics(dds)


def test_a_process_that_was_killed_is_gone_within_seconds(
    dds: Dds, domain: int
) -> None:
    stranger = start_stranger("humble on this machine", domain)
    until(lambda: "/cmd_vel" in _topics(dds), "it is met")

    stranger.kill()
    stranger.communicate()

    until(lambda: "/cmd_vel" not in _topics(dds), "its writer is forgotten", 30.0)


def _topics(dds: Dds) -> set[str]:
    return {one.topic for one in dds.endpoints() if one.writes and not one.own}
