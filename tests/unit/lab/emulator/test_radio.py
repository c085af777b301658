import asyncio
import itertools
from collections import Counter

import numpy as np
import pytest

from iveg.lab.emulator.orders import LinkFaults
from iveg.lab.emulator.radio import Packet, Radio
from iveg.lab.emulator.relay import read_packet

ODOMETRY, SCAN = "/iveg/AGI_odom/attrs", "/iveg/AGI_lidar2D/attrs"
EVERY_S = 1 / 30


def radio(seed: int = 1, **faults: float) -> Radio:
    made = Radio(frozenset({ODOMETRY}), np.random.default_rng(seed))
    made.faults = LinkFaults(**faults)  # type: ignore[arg-type]
    return made


def telemetry(number: int, topic: str = SCAN) -> Packet:
    return Packet(topic, 0, str(number).encode())


def sent(
    through: Radio, count: int, topic: str = SCAN, first: int = 0
) -> list[tuple[float, int]]:
    """When each of ``count`` messages goes out, and its number."""
    return [
        (due, int(raw))
        for number in range(first, first + count)
        for due, raw in through.pass_on(telemetry(number, topic), number * EVERY_S)
    ]


def numbers(out: list[tuple[float, int]]) -> list[int]:
    return [number for _, number in out]


def test_a_good_radio_passes_everything_on_at_once() -> None:
    assert sent(radio(), 50) == [(n * EVERY_S, n) for n in range(50)]


def test_a_share_is_lost() -> None:
    out = numbers(sent(radio(drop_percent=10.0), 4000))

    assert len(out) / 4000 == pytest.approx(0.9, abs=0.02)
    assert out == sorted(set(out))


def test_a_share_comes_twice() -> None:
    counted = Counter(numbers(sent(radio(duplicate_percent=10.0), 4000)))

    assert set(counted) == set(range(4000))
    assert sum(n == 2 for n in counted.values()) / 4000 == pytest.approx(0.1, abs=0.02)
    assert max(counted.values()) == 2


def test_a_share_is_overtaken_by_the_next_and_none_is_lost() -> None:
    out = numbers(sent(radio(reorder_percent=10.0), 4000))
    swaps = sum(b < a for a, b in itertools.pairwise(out))

    assert set(out) >= set(range(3999))
    assert swaps / 4000 == pytest.approx(0.1 / 1.1, abs=0.02)
    assert max(abs(n - place) for place, n in enumerate(out)) == 1


def test_what_waits_goes_out_with_the_next_even_when_that_is_lost() -> None:
    bad = radio(reorder_percent=100.0)
    assert sent(bad, 1) == []

    bad.faults = LinkFaults(drop_percent=100.0)

    assert numbers(sent(bad, 1, first=1)) == [0]


def test_topics_do_not_overtake_each_other() -> None:
    bad = radio(reorder_percent=100.0)

    assert bad.pass_on(telemetry(1, SCAN), 0.0) == []
    assert bad.pass_on(telemetry(2, ODOMETRY), 0.0) == []
    assert numbers(sent(bad, 1, SCAN, first=3)) == [3, 1]


def test_delay_and_jitter_keep_the_order() -> None:
    out = sent(radio(delay_ms=200.0, jitter_ms=300.0), 2000)
    late = [due - number * EVERY_S for due, number in out]

    assert numbers(out) == list(range(2000))
    assert [due for due, _ in out] == sorted(due for due, _ in out)
    assert 0.2 <= min(late) < 0.25
    assert 0.4 < max(late) <= 0.5


def test_what_has_quality_of_service_is_delayed_and_nothing_else() -> None:
    bad = radio(
        drop_percent=100.0, duplicate_percent=100.0, reorder_percent=100.0, delay_ms=50
    )

    assert bad.pass_on(Packet(ODOMETRY, 1, b"report"), 1.0) == [(1.05, b"report")]


def test_the_connection_itself_is_left_alone() -> None:
    bad = radio(drop_percent=100.0, delay_ms=5000.0)

    assert bad.pass_on(Packet(None, 0, b"ping"), 1.0) == [(1.0, b"ping")]


def test_frozen_odometry_repeats_its_last_message_and_other_topics_go_on() -> None:
    stuck = radio()
    sent(stuck, 3, ODOMETRY)

    stuck.faults = LinkFaults(freeze_odometry="repeat")
    assert numbers(sent(stuck, 4, ODOMETRY, first=3)) == [2, 2, 2, 2]
    assert numbers(sent(stuck, 2, SCAN, first=3)) == [3, 4]

    stuck.faults = LinkFaults()
    assert numbers(sent(stuck, 2, ODOMETRY, first=7)) == [7, 8]


def test_the_same_seed_makes_the_same_mistakes() -> None:
    faults = {"drop_percent": 20.0, "duplicate_percent": 20.0, "reorder_percent": 20.0}
    runs = [numbers(sent(radio(seed, **faults), 500)) for seed in (7, 7, 8)]

    assert runs[0] == runs[1]
    assert runs[0] != runs[2]


def test_of_a_mute_robot_nothing_arrives_and_its_connection_lives() -> None:
    silent = radio()
    silent.faults = LinkFaults(mute=True)

    assert sent(silent, 10) == []
    assert silent.pass_on(Packet(SCAN, 1, b"report", b"ack"), 0.0) == []
    assert silent.pass_on(Packet(None, 0, b"ping"), 0.0) == [(0.0, b"ping")]


async def test_a_message_that_asks_for_a_receipt_brings_the_one_of_its_broker() -> None:
    topic, number = b"/AGI/iveg/safety", b"\x12\x34"
    body = len(topic).to_bytes(2, "big") + topic + number + b"{}"
    sender = asyncio.StreamReader()
    sender.feed_data(bytes((0x32, len(body))) + body)

    packet = await read_packet(sender)

    assert (packet.topic, packet.qos) == (topic.decode(), 1)
    assert packet.receipt == b"\x40\x02" + number
