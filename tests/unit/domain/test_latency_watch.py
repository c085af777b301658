"""Messages timed at their hops: a delay lands in the hop that has it, nowhere else."""

from dataclasses import replace

import pytest

from iveg.domain.latency import DATA, SEGMENTS, Segment
from iveg.domain.observations import Origin
from iveg.domain.transports import DIRECT, FIWARE
from tests.unit.domain.chain import Chain, still

CALM: dict[Segment, float] = {
    "uplink": 0.004,
    "fiware": 0.020,
    "robot_orion": 0.024,
    "iveg": 0.001,
    "screen": 0.010,
}


def close(seconds: float) -> object:
    """Within 10 ms or 10 %, the larger."""
    return pytest.approx(seconds, abs=0.010, rel=0.10)


def test_every_message_is_measured_at_every_hop() -> None:
    chain = Chain()

    chain.run(10.0)

    took = {(hop, data): chain.took(hop, data) for hop in SEGMENTS for data in DATA}
    assert {place: one.count for place, one in took.items()} == {
        place: pytest.approx(199, abs=1) for place in took
    }
    assert {place: one.mean for place, one in took.items()} == {
        (hop, data): pytest.approx(CALM[hop], abs=0.001) for hop, data in took
    }


@pytest.mark.parametrize(
    ("chain", "hop", "seconds"),
    [
        (Chain(up=still(0.054)), "uplink", 0.054),
        (Chain(agent=still(0.140)), "fiware", 0.140),
        (Chain(iveg=still(0.060)), "iveg", 0.060),
        (Chain(page=still(0.090)), "screen", 0.090),
    ],
)
def test_a_delay_that_is_put_in_is_found_in_its_hop_alone(
    chain: Chain, hop: Segment, seconds: float
) -> None:
    chain.run(10.0)

    expected = CALM | {hop: seconds}
    expected["robot_orion"] = expected["uplink"] + expected["fiware"]
    assert {one: chain.took(one).mean for one in SEGMENTS} == {
        one: close(expected[one]) for one in SEGMENTS
    }


@pytest.mark.parametrize(
    "written",
    [
        lambda one: replace(one, stamp_s=None),
        lambda one: replace(one, stamp_s=1.7e9),
    ],
)
def test_a_robot_without_usable_stamps_gives_no_uplink(written: object) -> None:
    chain = Chain(written=written)  # type: ignore[arg-type]

    chain.run(5.0)

    assert chain.took("uplink").count <= 1
    assert chain.took("fiware").mean == pytest.approx(0.020, abs=0.001)


def an_hour_off_from(second: float, hours: float) -> object:
    def write(origin: Origin) -> Origin:
        late = origin.mono is not None and origin.mono >= second
        stamp = origin.stamp_s or 0.0
        return replace(origin, stamp_s=stamp + 3600.0 * hours) if late else origin

    return write


@pytest.mark.parametrize("hours", [-1, 1])
def test_a_clock_that_jumps_an_hour_never_shows_as_latency(hours: int) -> None:
    chain = Chain(written=an_hour_off_from(5.0, hours))  # type: ignore[arg-type]

    chain.run(10.0)

    assert chain.watch.clocks["AGI"].jumps == 1
    assert chain.took("uplink").most < 0.1
    assert chain.took("uplink").least >= 0.0


def test_a_message_that_comes_twice_counts_once() -> None:
    chain = Chain()
    chain.run(5.0)
    before = [chain.took(hop, "lidar").count for hop in SEGMENTS]

    chain.watch.arrived(chain.last(DIRECT.id))
    chain.watch.arrived(chain.last(FIWARE.id))

    assert [chain.took(hop, "lidar").count for hop in SEGMENTS] == before
